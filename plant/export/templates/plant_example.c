/* Runs the plant along drives from standard input, one a line [rad/s]. Prints {{ output_names | join(", ") }}
 * at every sample. */
#include "{{ name }}.h"

#include <stdio.h>
#include <stdlib.h>

static {{ name }}_plant plant;

int main(void)
{
    char line[256];
    {{ real }} outputs[{{ NAME }}_OUTPUTS];
    int begun = 0;
    while (fgets(line, (int)sizeof line, stdin) != NULL) {
        const {{ real }} drive = strto{{ "f" if f else "d" }}(line, NULL);
        if (begun != 0) {
            {{ name }}_step(&plant, drive);
        } else {
            {{ name }}_start(&plant, &{{ name }}_defaults, drive);
            begun = 1;
        }
        {{ name }}_outputs(&plant, outputs);
        for (int i = 0; i < {{ NAME }}_OUTPUTS; ++i) {
            printf("%.{{ digits }}g%c", (double)outputs[i], (i + 1 < {{ NAME }}_OUTPUTS) ? ',' : '\n');
        }
    }
    return EXIT_SUCCESS;
}
