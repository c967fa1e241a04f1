"""One-line texts of the errata for reports, from ``errata.txt``; ``docs/errata.md`` gives them in full with reasons."""

import re
from collections.abc import Mapping
from importlib.resources import files

from markupsafe import Markup, escape

_LINES = files("experiments.page").joinpath("errata.txt").read_text(encoding="utf-8").splitlines()

ERRATA: Mapping[str, str] = dict(line.split(": ", 1) for line in _LINES)
"""One sentence for each of the errata, by number."""

_CITED_OR_TAG = re.compile(
    r"<script\b.*?</script>|<[^>]*>|\berrat(?:a|um)(?:(?:,|\s+and|\s+to)?\s+[EPM]\d{1,2}\b)+", re.DOTALL
)
_NUMBER = re.compile(r"[EPM]\d{1,2}")
_LINK = re.compile(r'href="#([EPM]\d{1,2})"')


def link_errata(text: str) -> Markup:
    """Return a text or part of a page in which cited errata are linked to the report's list.

    Only a number after the word "errata" or "erratum" counts, since columns and actuators may have names such as P1.

    Parameters
    ----------
    text : str
        Plain text, or markup whose tags stay unchanged.

    Returns
    -------
    Markup
        The escaped text, in which each number of `ERRATA` is a link.

    Examples
    --------
    >>> link_errata("P1 sticks (errata E9) & stays")
    Markup('P1 sticks (errata <a href="#E9">E9</a>) &amp; stays')
    """

    def cited(found: re.Match[str]) -> str:
        return found[0] if found[0].startswith("<") else link_numbers(found[0])

    return Markup(_CITED_OR_TAG.sub(cited, str(escape(text))))  # noqa: S704 - escaped just before, or markup


def link_numbers(text: str) -> Markup:
    """Return a list of errata in which each number of `ERRATA` is a link.

    Examples
    --------
    >>> link_numbers("E9, E99")
    Markup('<a href="#E9">E9</a>, E99')
    """

    def link(found: re.Match[str]) -> str:
        number = found[0]
        return f'<a href="#{number}">{number}</a>' if number in ERRATA else number

    return Markup(_NUMBER.sub(link, str(escape(text))))  # noqa: S704 - escaped just before


def linked_errata(html: str) -> Mapping[str, str]:
    """Return the errata that a page links to, in order of number.

    Parameters
    ----------
    html : str
        A page with links made by `link_errata`.

    Returns
    -------
    Mapping[str, str]
        The one-line text by number.
    """
    found = set(_LINK.findall(html))
    return {number: text for number, text in ERRATA.items() if number in found}
