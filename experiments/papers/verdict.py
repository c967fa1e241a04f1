"""One row of the page, and the one rule that decides its verdict. No verdict is written anywhere else."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, TypeAlias, get_args

from experiments.published.digits import digits_half
from plant.errors import HydrostateError, require_known

Basis: TypeAlias = Literal["computed", "model", "target"]
"""Origin of our value: computed from printed values or from data; predicted by a model that was not given the printed
number; or a number that a model was given or calibrated to."""


class Verdict(StrEnum):
    """Whether a printed value was reproduced."""

    REPRODUCED = "reproduced"
    PREDICTED = "predicted"
    CALIBRATED = "calibrated"
    NOT_REPRODUCED = "not reproduced"
    ERRATUM = "erratum"


class Drawn(StrEnum):
    """Whether a figure is drawn."""

    ALIKE = "drawn"
    DIFFERS = "drawn with a difference"
    NOT = "cannot be drawn"


AGREES: dict[Basis, Verdict] = {
    "computed": Verdict.REPRODUCED,
    "model": Verdict.PREDICTED,
    "target": Verdict.CALIBRATED,
}
"""The verdict on a value that agrees, by the origin of our value."""

MISSED_VERDICTS = frozenset({Verdict.NOT_REPRODUCED, Verdict.ERRATUM})
"""The verdicts on values that do not agree."""


TONES: Mapping[str, str] = {
    "reproduced": "good",
    "predicted": "good",
    "calibrated": "none",
    "not reproduced": "bad",
    "erratum": "bad",
    "drawn": "good",
    "drawn with a difference": "none",
    "cannot be drawn": "bad",
}
"""The colour of each verdict."""


@dataclass(frozen=True)
class OurResult:
    """Our result for a claim.

    Parameters
    ----------
    value : float, str or None
        The number [the row's unit], or words; None if we have none.
    low, high : float, optional
        Its own interval [the row's unit]; by default the number itself.
    said : str
        Further remarks.
    """

    value: float | str | None
    low: float | None = None
    high: float | None = None
    said: str = ""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One printed value or claim, with our result.

    Parameters
    ----------
    printed : str
        As printed.
    value : float, str or None
        The printed value as a number [`unit`], or as words that our result must equal.
    accept : str
        When our result counts as the printed value; see `accepted_range`.
    errata : str
        Numbers of the errata that find the printed value wrong, ambiguous or contradicted by the paper; empty if there
        are none.
    shown_by : str
        The command that shows the result.
    """

    paper: str
    where: str
    claim: str
    printed: str
    value: float | str | None
    unit: str
    accept: str
    basis: Basis
    ours: OurResult
    errata: str = ""
    shown_by: str
    note: str = ""


def number_row(
    paper: str,
    where: str,
    claim: str,
    printed: str,
    unit: str,
    accept: str,
    ours: OurResult,
    *,
    basis: Basis = "computed",
    errata: str = "",
    shown_by: str,
    note: str = "",
) -> Row:
    """Return the row of a printed number; the arguments are those of `Row`."""
    return Row(
        paper=paper,
        where=where,
        claim=claim,
        printed=printed,
        value=float(printed),
        unit=unit,
        accept=accept,
        basis=basis,
        ours=ours,
        errata=errata,
        shown_by=shown_by,
        note=note,
    )


def accepted_range(row: Row) -> tuple[float, float]:
    """Return the range in which our result counts as the printed value.

    ``same`` is for words, which must be equal. ``digits`` is half a unit of the last printed digit, ``± x`` and ``± x
    %`` are about the printed value, ``a to b``, ``at least a`` and ``at most a`` are absolute.

    Returns
    -------
    tuple of float
        Lowest and highest [the row's unit].

    Raises
    ------
    HydrostateError
        If the row's `accept` is none of these, or there is no printed number that it could be about.

    Examples
    --------
    >>> accepted_range(Row(paper="", where="", claim="", printed="25 Hz", value=25.0, unit="Hz", accept="± 10 %",
    ...              basis="model", ours=OurResult(None), shown_by=""))
    (22.5, 27.5)
    """
    words = row.accept.split()
    if words[:2] == ["at", "least"]:
        return float(words[2]), math.inf
    if words[:2] == ["at", "most"]:
        return -math.inf, float(words[2])
    if len(words) == 3 and words[1] == "to":
        return float(words[0]), float(words[2])
    if not isinstance(row.value, float):
        raise HydrostateError(f"{row.where}: {row.accept!r} needs a printed number, got {row.value!r}")
    if row.accept == "digits":
        half = digits_half(row.printed)
    elif words[:1] == ["±"] and len(words) in {2, 3}:
        half = float(words[1]) * (0.01 * abs(row.value) if words[2:] == ["%"] else 1.0)
    else:
        raise HydrostateError(f"{row.where}: what is accepted cannot be read: {row.accept!r}")
    return row.value - half, row.value + half


def agrees(row: Row) -> bool:
    """Return whether our result agrees: its interval meets the accepted range, or the words are the same.

    Raises
    ------
    HydrostateError
        As `accepted_range`.
    """
    ours = row.ours
    if row.accept == "same":
        return ours.value is not None and ours.value == row.value
    if ours.value is None or isinstance(ours.value, str) or math.isnan(ours.value):
        return False
    low, high = accepted_range(row)
    slack = 1e-9 * max(abs(edge) for edge in (low, high, 0.0) if math.isfinite(edge))
    bottom = ours.value if ours.low is None else ours.low
    top = ours.value if ours.high is None else ours.high
    return bool(low - slack <= top and bottom <= high + slack)


def verdict_of(row: Row) -> Verdict:
    """Return the verdict on a row.

    If the values agree, the verdict is *calibrated* if a model was given the printed value, *predicted* if a model was
    not given it, and *reproduced* if our value was computed or estimated. If they do not agree, it is *erratum* if an
    erratum says that the printed value is wrong or contradicted, and *not reproduced* otherwise.

    Raises
    ------
    HydrostateError
        If the row's basis is unknown, or as `accepted_range`.
    """
    require_known("basis", row.basis, get_args(Basis))
    if agrees(row):
        return AGREES[row.basis]
    return Verdict.ERRATUM if row.errata else Verdict.NOT_REPRODUCED


def exclusion_sentence(row: Row) -> str:
    """Return a sentence if our own interval excludes the printed value and its rounding interval; else an empty text.

    Examples
    --------
    >>> row = Row(paper="", where="", claim="", printed="1.89", value=1.89, unit="", accept="digits", basis="model",
    ...           ours=OurResult(1.95, 1.93, 1.97), shown_by="")
    >>> exclusion_sentence(row)
    'Our 95 % interval excludes it.'
    """
    compared = row.ours.low is not None and not row.accept.startswith(("same", "at "))
    return "Our 95 % interval excludes it." if compared and not agrees(row) else ""


def figure_status(drawing: bool, difference: str, verdicts: Sequence[str]) -> Drawn:
    """Return the status of a figure of a paper.

    Parameters
    ----------
    drawing : bool
        Whether a study draws it.
    difference : str
        Known differences; empty if there are none.
    verdicts : sequence of str
        Verdicts of the rows that refer to the figure; a row that was not reproduced is also a difference.

    Examples
    --------
    >>> print(figure_status(True, "", [Verdict.PREDICTED]), figure_status(True, "", [Verdict.ERRATUM]), sep=", ")
    drawn, drawn with a difference
    """
    if not drawing:
        return Drawn.NOT
    missed = not MISSED_VERDICTS.isdisjoint(verdicts)
    return Drawn.DIFFERS if difference or missed else Drawn.ALIKE
