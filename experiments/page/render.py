"""A report as one self-contained HTML file: the text of its template, with tables and figures embedded."""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from experiments.command.visible_text import visible_page
from experiments.page.errata import link_errata, linked_errata
from experiments.page.figure_files import image_of, is_tall
from experiments.page.numbers import exact, number
from experiments.page.scripting import with_scripts
from experiments.page.sentences import rig_in_words, whole_dates
from experiments.page.tables import Columns, folded_tables, html_table

_HEADING = re.compile(r'<section id="([^"]+)"[^>]*>\s*<h2>([^:<]*)')
_UNBREAKABLE_SPACE = re.compile(
    r"(?<=\d) (?=%|\N{MULTIPLICATION SIGN} 10|(?:V|Hz|kHz|mm|ms|psi|MPa|MB|rpm|bar|N|s|L/min)\b)"
    r"|(?<=\d \N{MULTIPLICATION SIGN}) (?=10)"
)


def render_page(
    template: str, facts: Mapping[str, Any], columns: Mapping[str, Columns], files: Mapping[str, bytes]
) -> str:
    """Return a report as one HTML page with embedded figures and the errata that it cites.

    Parameters
    ----------
    template : str
        Template with the page's text, by its path below ``experiments``; it extends ``page/templates/page.html``. In
        it, ``table(name, caption)``, ``folded(name, by, count)``, ``figure(name, caption)`` and ``chart(name,
        caption)`` insert the named item.
    facts : Mapping[str, Any]
        Findings by name: data frames that the page shows, `Charts` by name under ``charts``, and other values used in
        its text.
    columns : Mapping[str, Columns]
        How each data frame is shown.
    files : Mapping[str, bytes]
        The figures, in the form that `figure_files` returns.

    Returns
    -------
    str
        The page; it loads nothing from elsewhere.
    """

    def table(name: str, caption: str, *, cards: bool = False) -> Markup:
        return html_table(facts[name], columns[name], " ".join(caption.split()), cards=cards)

    def folded(name: str, by: str, count: str) -> Markup:
        return folded_tables(facts[name], columns[name], by, count)

    def figure(name: str, caption: str) -> Markup:
        caption = " ".join(caption.split())
        image = image_of(files[f"figures/{name}.svg"], caption)
        box = Markup('<div class="picture" tabindex="0" role="region" aria-label="{}">{}</div>').format(name, image)
        tall = Markup(' class="tall"') if is_tall(files[f"figures/{name}.svg"]) else ""
        return Markup('<figure id="figure-{}"{}>{}<figcaption>{}</figcaption></figure>').format(
            name, tall, box, caption
        )

    def chart(name: str, caption: str) -> Markup:
        return facts["charts"][name].html(name, " ".join(caption.split()))

    made = {"table": table, "folded": folded, "figure": figure, "chart": chart}
    made |= {"headings_of": _headings_of, "errata_of": linked_errata}
    page = _templates().get_template(template).render({**facts, **made})
    return with_scripts(_UNBREAKABLE_SPACE.sub("\N{NO-BREAK SPACE}", with_whole_options(visible_page(page))))


_OPTIONS = re.compile(
    r"<(?P<skipped>script|style|title|span class=\"option\").*?</(?:script|style|title|span)>"
    r"|<[^>]*>|(?<![\w-])(?P<option>--[a-z][a-z-]*)",
    re.DOTALL,
)


def with_whole_options(page: str) -> str:
    """Return a page on which no line ends between the two hyphens of an option of the command.

    Examples
    --------
    >>> with_whole_options('<p title="--rig">add --rig</p>')
    '<p title="--rig">add <span class="option">--rig</span></p>'
    """
    return _OPTIONS.sub(
        lambda found: f'<span class="option">{found["option"]}</span>' if found["option"] else found[0], page
    )


@cache
def _templates() -> Environment:
    """Return the template environment, which compiles each template once for all pages."""
    environment = Environment(
        loader=PackageLoader("experiments", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"linked": link_errata, "rig_in_words": rig_in_words, "number": number, "exact": exact}
    environment.filters["whole_dates"] = whole_dates
    return environment


def _headings_of(body: str) -> Sequence[tuple[str, Markup]]:
    """Return anchor and heading of each section; the heading is the text before a colon."""
    return [(name, Markup(heading)) for name, heading in _HEADING.findall(body)]  # noqa: S704 - already on the page
