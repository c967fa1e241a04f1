"""Notes: what a reader should know of a log or a result, as a code with data; sentences are made of it at the edge.

A code is a member of an enum that stands beside the method that raises it, and carries one sentence template.
Programs decide by code and data alone; no sentence is read back.
"""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from string import Formatter
from typing import Any

WORKSHOP: Mapping[str, float] = {
    "bar": 1e-5,
    "MPa": 1e-6,
    "mm": 1e3,
    "mm/s": 1e3,
    "L": 1e3,
    "rpm": 30.0 / math.pi,
    "L/(min bar)": 6e9,
}
"""Units that a sentence may give a number in, and the factor from SI."""

WRITTEN_OUT = 1e7
"""Size below which a reader is spared a power of ten."""


MOST_DECIMALS = 6
"""Decimals that a value with a half-width has at most [count]."""

UNTOLD = " ± inf"
"""What a half width reads that no log bounds."""


def written_out(value: float, spec: str) -> str:
    """Return a number in significant digits as a reader writes it: 100, not 1e+02.

    Parameters
    ----------
    value : float
        The number [any unit].
    spec : str
        How many digits, as `format` has it: ``.2g``.

    Examples
    --------
    >>> written_out(100.0, ".2g"), written_out(123456.0, ".3g"), written_out(1.5e-5, ".3g")
    ('100', '123000', '1.5e-05')
    >>> written_out(120000.0, "+.2g")
    '+120000'
    """
    said, sign = format(value, spec), "+" if spec.startswith("+") else ""
    return f"{float(said):{sign}.0f}" if "e+" in said and abs(value) < WRITTEN_OUT else said


class _Sentence(Formatter):
    """Fills a template; a number in significant digits is written out, in bar where a field says ``{a_pa:.3g|bar}``."""

    def format_field(self, value: Any, format_spec: str) -> Any:
        format_spec, _, unit = format_spec.partition("|")
        value = WORKSHOP[unit] * value if unit else value
        if format_spec.endswith("g") and isinstance(value, int | float):
            return written_out(value, format_spec)
        return super().format_field(value, format_spec)

    def convert_field(self, value: Any, conversion: Any) -> Any:
        """Return a name without underscores where a template says so: ``{quantity!w}``."""
        return str(value).replace("_", " ") if conversion == "w" else super().convert_field(value, conversion)


_SENTENCE = _Sentence()

_WITH_HALF_WIDTH = re.compile(r"(\{\w+:z?\.\d)[fg](\|[^}]+)?\} ± \{(\w+):\.2g(\|[^}]+)?\}")
"""A value and its half-width, which has two significant digits."""


def _in_step(template: str, data: Mapping[str, Any]) -> str:
    """Return a template whose values have as many decimals as their half-widths."""

    def decimals(found: re.Match[str]) -> str:
        value, unit, half_width, _ = found.groups("")
        size = abs(data[half_width]) * WORKSHOP.get(unit[1:], 1.0)
        if not (math.isfinite(size) and size > 0.0):
            return found.group()
        digits = min(max(0, 1 - math.floor(math.log10(size))), MOST_DECIMALS)
        return f"{value[:-1]}{digits}f{unit}}} ± {{{half_width}:.{digits}f{unit}}}"

    return _WITH_HALF_WIDTH.sub(decimals, template)


class Code(Enum):
    """A kind of note; each layer and each actuator has an enum of its own, without members in common.

    A member is written ``NAME = "sentence with {fields}"``; a note's data fill the fields. A field such as
    ``{drop_pa:.3g|bar}`` converts its number from SI to one of the units in `WORKSHOP`. Its name in small letters is
    the code, and equals that text.

    Examples
    --------
    >>> class Colour(Code):
    ...     FADED = "the colour is {share:.0f} % of what it was"
    >>> str(Colour.FADED), str(Colour.FADED.note(share=40.0))
    ('faded', 'the colour is 40 % of what it was')
    >>> class Pressure(Code):
    ...     DROPS = "pressure drops by {drop_pa:.3g|bar} bar"
    >>> str(Pressure.DROPS.note(drop_pa=250000.0))
    'pressure drops by 2.5 bar'
    """

    template: str

    def __init__(self, template: str) -> None:
        self.template = template

    def __str__(self) -> str:
        return self.name.lower()

    def __eq__(self, other: object) -> bool:
        return str(self) == str(other) if isinstance(other, Code | str) else NotImplemented

    def __hash__(self) -> int:
        return hash(str(self))

    def note(self, **data: Any) -> "Note":
        """Return a note of this kind.

        Parameters
        ----------
        **data : float, int, str, bool or None
            What the template's fields are filled with, in SI where the template does not say otherwise.
        """
        return Note(self, data)


@dataclass(frozen=True)
class Note:
    """One thing that a reader should know.

    Parameters
    ----------
    data : Mapping[str, float | int | str | bool | None]
        Its numbers and names, by the fields of the code's template.
    """

    code: Code
    data: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def __str__(self) -> str:
        said = _SENTENCE.format(_in_step(self.code.template, self.data), **self.data)
        return (
            said if UNTOLD not in said else f"{said.replace(UNTOLD, '')}; the log does not tell how far off this may be"
        )

    def __repr__(self) -> str:
        """Return code and sentence, since lists of notes are read at a prompt; the data where they do not fill it."""
        try:
            return f"<{self.code}: {self}>"
        except (KeyError, TypeError, ValueError):
            return f"<{self.code}: {dict(self.data)}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the note for JSON.

        Returns
        -------
        dict[str, Any]
            ``code``, ``data`` and ``text``, the sentence.
        """
        return {"code": str(self.code), "data": dict(self.data), "text": str(self)}


def distinct(notes: Iterable[Note]) -> tuple[Note, ...]:
    """Return notes in order, each once.

    Returns
    -------
    tuple of Note
        Those that are equal to none before them.
    """
    kept: list[Note] = []
    for one in notes:
        if one not in kept:
            kept.append(one)
    return tuple(kept)
