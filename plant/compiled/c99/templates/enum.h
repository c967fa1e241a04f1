{% macro listed(prefix, entries) %}
enum {
{% for one in entries %}
{% set name, about = (one, "") if one is string else (one[0], " /* " ~ one[1] ~ " */") %}
    {{ prefix }}_{{ name | upper }} = {{ loop.index0 }}{{ "" if loop.last else "," }}{{ about }}
{% endfor %}
};
{% endmacro %}
