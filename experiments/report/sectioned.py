"""A report of sections, each a heading with words, a figure and tables: one HTML file that needs nothing beside it."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from experiments.report.errata import linked, linked_errata


@dataclass(frozen=True)
class Section:
    """A section of a report.

    Parameters
    ----------
    name : str
        Its anchor.
    heading : str
        Its heading; what stands before a colon names it in the list of sections.
    sentences : sequence of str
        Paragraphs of plain text, errata by number.
    figure : bytes or None
        An SVG file.
    caption : str
        The figure's, errata by number.
    tables : sequence of Markup
        As `html_table` returns them.
    """

    name: str
    heading: str
    sentences: Sequence[str] = ()
    figure: bytes | None = None
    caption: str = ""
    tables: Sequence[Markup] = ()

    @property
    def image(self) -> Markup | None:
        """The figure as an element that holds it; None where there is none."""
        if self.figure is None:
            return None
        data = b64encode(self.figure).decode("ascii")
        return Markup('<img alt="{}" src="data:image/svg+xml;base64,{}">').format(self.heading, data)


def render_sections(title: str, kicker: str, introduction: str, sections: Sequence[Section]) -> str:
    """Return a report as one HTML page with its figures inside, and the errata that it cites.

    Parameters
    ----------
    title : str
        Of the page.
    kicker : str
        The line above it.
    introduction : str
        The paragraph below it.
    sections : sequence of Section
        In the order of the page.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    environment = Environment(
        loader=PackageLoader("experiments.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"linked": linked}
    template = environment.get_template("sections.html")
    return template.render(
        title=title, kicker=kicker, introduction=introduction, sections=sections, linked_errata=linked_errata
    )
