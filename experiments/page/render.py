"""A report as one HTML file that needs nothing beside it: the words of its template, with tables and figures inside."""

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from experiments.page.errata import linked, linked_errata
from experiments.page.numbers import exact, number
from experiments.page.tables import Columns, html_table

_HEADING = re.compile(r'<section id="([^"]+)">\s*<h2>([^:<]*)')
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=%|(?:V|Hz|kHz|mm|ms|psi)\b)")


def render_page(
    template: str, facts: Mapping[str, Any], columns: Mapping[str, Columns], files: Mapping[str, bytes]
) -> str:
    """Return a report as one HTML page with its figures inside, and the errata that it cites.

    Parameters
    ----------
    template : str
        The page's words, by their path below ``experiments``; it extends ``page/templates/page.html``. There
        ``table(name, caption)`` and ``figure(name, caption)`` stand for what they name.
    facts : Mapping[str, Any]
        What was found, by name: data frames that the page shows, and what else its words need.
    columns : Mapping[str, Columns]
        How each data frame is shown.
    files : Mapping[str, bytes]
        The figures, as `figure_files` returns them.

    Returns
    -------
    str
        The page; it loads nothing.
    """

    def table(name: str, caption: str) -> Markup:
        return html_table(facts[name], columns[name], " ".join(caption.split()))

    def figure(name: str, caption: str) -> Markup:
        caption = " ".join(caption.split())
        data = b64encode(files[f"figures/{name}.svg"]).decode("ascii")
        image = Markup('<img alt="{}" src="data:image/svg+xml;base64,{}">').format(caption, data)
        return Markup('<figure id="figure-{}">{}<figcaption>{}</figcaption></figure>').format(name, image, caption)

    environment = Environment(
        loader=PackageLoader("experiments", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"linked": linked, "number": number, "exact": exact}
    made = {"table": table, "figure": figure, "headings_of": _headings_of, "errata_of": linked_errata}
    page = environment.get_template(template).render({**facts, **made})
    return _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", page)


def _headings_of(body: str) -> Sequence[tuple[str, Markup]]:
    """Return anchor and heading of each section; what stands before a colon names it."""
    return [(name, Markup(heading)) for name, heading in _HEADING.findall(body)]  # noqa: S704 - already on the page
