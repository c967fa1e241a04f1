"""Draws figures from named tables and turns them into files."""

import re
from base64 import b64encode
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from markupsafe import Markup

from experiments.page.frames import Tables
from experiments.page.style import project_style
from experiments.running.refusal import os_errors_as
from plant.atomic import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Drawings: TypeAlias = "Mapping[str, Callable[[Tables], Figure]]"
"""Maps file names to functions that draw figures from a study's tables."""

PNG_DOTS_PER_INCH, LOG_DOTS_PER_INCH = 150, 130
"""Resolution of the PNG figures of studies, 1500 pixels wide, and of logs."""


TALL = 0.7
"""Ratio of height to width above which a figure counts as tall: at 9.2 cm high it would be under 13 of 18 cm wide."""


def figure_files(drawings: Drawings, tables: Tables) -> dict[str, bytes]:
    """Return figures as SVG and PNG files.

    Returns
    -------
    dict[str, bytes]
        By path within a result folder: ``figures/name.svg``, ``figures/name.png``.
    """
    files: dict[str, bytes] = {}
    with project_style():
        for name, draw in drawings.items():
            figure = draw(tables)
            files[f"figures/{name}.svg"] = svg_of(figure)
            pixels = BytesIO()
            figure.savefig(pixels, format="png", dpi=PNG_DOTS_PER_INCH)
            files[f"figures/{name}.png"] = pixels.getvalue()
    return files


def svg_of(figure: "Figure") -> bytes:
    """Return a figure as an SVG file that is identical in every run."""
    buffer = BytesIO()
    with project_style():
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def image_of(figure: "Figure | bytes", words: str) -> Markup:
    """Return a figure as an image embedded in its page.

    Parameters
    ----------
    figure : Figure or bytes
        The figure, or its SVG file.
    words : str
        Text alternative for readers who do not see the image.
    """
    content = figure if isinstance(figure, bytes) else svg_of(figure)
    data = b64encode(content).decode("ascii")
    return Markup('<img alt="{}" src="data:image/svg+xml;base64,{}">').format(words, data)


def is_tall(svg: bytes) -> bool:
    """Return whether a figure is so tall that its text would be unreadable on a third of a sheet.

    Examples
    --------
    >>> is_tall(b'<svg viewBox="0 0 720 680">'), is_tall(b'<svg viewBox="0 0 720 400">')
    (True, False)
    """
    box = re.search(rb'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg)
    return box is not None and float(box[2]) > TALL * float(box[1])


def write_png(draw: "Callable[[], Figure]", path: Path) -> None:
    """Write the figure of one log as a PNG; no partial file is left behind.

    Raises
    ------
    HydrostateError
        If it cannot be written.
    """
    with os_errors_as(f"--figure {path}: cannot be written"), project_style(), replacing(path) as file:
        draw().savefig(file, format="png", dpi=LOG_DOTS_PER_INCH)
