"""Notes on a log or a result for the reader: each is a code with data; sentences are formed only for output.

A code is a member of an enum that stands next to the method that raises it, and has one sentence template. Programs use
only code and data; no sentence is parsed.
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
"""Units that a sentence may use for a number, and their factor from SI."""

LARGEST_WRITTEN_OUT = 1e7
"""Size below which a number is written without a power of ten."""


MOST_DECIMALS = 6
"""Largest number of decimals of a value with a half-width [count]."""

UNBOUNDED = " ± inf"
"""Text of a half-width that no log bounds."""


def written_out(value: float, spec: str) -> str:
    """Return a number with a given number of significant digits, as a reader writes it: 100, not 1e+02.

    Parameters
    ----------
    value : float
        The number [any unit].
    spec : str
        Number of digits, in the syntax of `format`: ``.2g``.

    Examples
    --------
    >>> written_out(100.0, ".2g"), written_out(123456.0, ".3g"), written_out(1.5e-5, ".3g")
    ('100', '123000', '1.5e-05')
    >>> written_out(120000.0, "+.2g")
    '+120000'
    """
    said, sign = format(value, spec), "+" if spec.startswith("+") else ""
    return f"{float(said):{sign}.0f}" if "e+" in said and abs(value) < LARGEST_WRITTEN_OUT else said


class _Sentence(Formatter):
    """Fills a template; writes numbers without a power of ten, and in bar if a field says ``{a_pa:.3g|bar}``."""

    def format_field(self, value: Any, format_spec: str) -> Any:
        format_spec, _, unit = format_spec.partition("|")
        value = WORKSHOP[unit] * value if unit else value
        if format_spec.endswith("g") and isinstance(value, int | float):
            return written_out(value, format_spec)
        return super().format_field(value, format_spec)

    def convert_field(self, value: Any, conversion: Any) -> Any:
        """Return a name without underscores if a template asks for it: ``{quantity!w}``."""
        return str(value).replace("_", " ") if conversion == "w" else super().convert_field(value, conversion)


_SENTENCE = _Sentence()

_WITH_HALF_WIDTH = re.compile(r"(\{\w+:z?\.\d)[fg](\|[^}]+)?\} ± \{(\w+):\.2g(\|[^}]+)?\}")
"""A value and its half-width, which has two significant digits."""


def _with_matching_decimals(template: str, data: Mapping[str, Any]) -> str:
    """Return a template in which each value has as many decimals as its half-width."""

    def decimals(found: re.Match[str]) -> str:
        value, unit, half_width, _ = found.groups("")
        size = abs(data[half_width]) * WORKSHOP.get(unit[1:], 1.0)
        if not (math.isfinite(size) and size > 0.0):
            return found.group()
        digits = min(max(0, 1 - math.floor(math.log10(size))), MOST_DECIMALS)
        return f"{value[:-1]}{digits}f{unit}}} ± {{{half_width}:.{digits}f{unit}}}"

    return _WITH_HALF_WIDTH.sub(decimals, template)


class Code(Enum):
    """A kind of note; each layer and each actuator has its own enum, and no two enums share a member.

    A member is written ``NAME = "sentence with {fields}"``; a note's data fill the fields. A field such as
    ``{drop_pa:.3g|bar}`` converts its number from SI to one of the units in `WORKSHOP`. The code is the member's name
    in lower case, and equals that text.

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
            Values of the template's fields, in SI unless the template says otherwise.
        """
        return Note(self, data)


@dataclass(frozen=True)
class Note:
    """One fact for the reader.

    Parameters
    ----------
    data : Mapping[str, float | int | str | bool | None]
        Its numbers and names, by field of the code's template.
    """

    code: Code
    data: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def __str__(self) -> str:
        said = _SENTENCE.format(_with_matching_decimals(self.code.template, self.data), **self.data)
        return (
            said
            if UNBOUNDED not in said
            else f"{said.replace(UNBOUNDED, '')}; the log does not tell how far off this may be"
        )

    def __repr__(self) -> str:
        """Return code and sentence, for lists of notes at a prompt; code and data if they do not fill the template."""
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
    """Return notes in order, without repetitions.

    Returns
    -------
    tuple of Note
        The notes that do not equal an earlier one.
    """
    kept: list[Note] = []
    for one in notes:
        if one not in kept:
            kept.append(one)
    return tuple(kept)
