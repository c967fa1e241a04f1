"""One row per log, from the rows of a batch store: state, worst severity, and its distance from the limit."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from estimation.finding import NORMAL_95
from experiments.fleet.naming import UNNAMED, ActuatorAndDate
from faults.notes import AgainstCode

STATES: Mapping[str, str] = {
    "over": "past a limit",
    "likely": "probably past a limit",
    "alarm": "nearing a limit",
    "unknown": "no verdict",
    "open": "may be past a limit",
    "within": "within limits",
    "failed": "not readable",
}
"""States of a log or an actuator with their descriptions, the most urgent first."""

BETWEEN_CODE, OUTSIDE_CODE = str(AgainstCode.BETWEEN_CONDITIONS), str(AgainstCode.OUTSIDE_CONDITIONS)
"""Codes of logs that fit one circuit, although they fit none of the nine conditions."""

RANKS: Mapping[str, int] = {name: place for place, name in enumerate(STATES)}


@dataclass(frozen=True)
class Amount:
    """A severity of a log.

    Parameters
    ----------
    value, low, high : float
        Estimate and 95 % interval [unit].
    healthy, limit : float
        Value of a healthy actuator, and value at which it stops being sound [unit].
    total : tuple of float
        95 % interval with the rig file's error [unit]; empty if it is unknown.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    healthy: float
    limit: float
    total: tuple[float, ...] = ()

    @property
    def share(self) -> float:
        """Share of the distance from healthy to the limit [fraction]: 1 at the limit, larger beyond it."""
        return (self.value - self.healthy) / (self.limit - self.healthy)

    @property
    def std(self) -> float:
        """Standard deviation, which assumes a normal interval [unit]."""
        return 0.5 * (self.high - self.low) / NORMAL_95

    @property
    def common(self) -> tuple[float, float]:
        """Standard deviations of the rig file's error, below and above: it is the same in all logs [unit]."""
        if not self.total:
            return 0.0, 0.0
        squares = [
            (end - self.value) ** 2 - (own - self.value) ** 2
            for end, own in zip(self.total, (self.low, self.high), strict=True)
        ]
        return math.sqrt(max(squares[0], 0.0)) / NORMAL_95, math.sqrt(max(squares[1], 0.0)) / NORMAL_95

    @property
    def state(self) -> str:
        """Position of value and interval relative to the limit, one of `STATES`."""
        sign = math.copysign(1.0, self.limit - self.healthy)
        limit, value = sign * self.limit, sign * self.value
        low, high = sorted((sign * self.low, sign * self.high))
        if low > limit:
            return "over"
        if value > limit:
            return "likely"
        return "open" if high > limit else "within"


AMOUNT_NUMBERS = len(fields(Amount)) - 3
"""Numbers that every `Amount` has, besides name, unit and total interval [count]."""


@dataclass(frozen=True)
class LogRow:
    """One log of a fleet.

    Parameters
    ----------
    state : str
        One of `STATES`.
    condition : str
        The condition found; empty if none was found.
    reason : str
        Why no condition was found.
    between : Mapping[str, float]
        Leakage and friction if one circuit explains the log but its levels are those of no condition: both to the
        nearest quarter, where 1 is minor and 2 is major [dimensionless]. Empty otherwise.
    beside : bool
        Whether such a circuit lies outside all conditions, not even between two: the rig file may be for another
        actuator.
    """

    file: str
    named: ActuatorAndDate
    state: str
    condition: str
    reason: str
    amounts: Mapping[str, Amount]
    between: Mapping[str, float] = field(default_factory=dict[str, float])
    beside: bool = False

    @property
    def has_verdict(self) -> bool:
        """Whether the severities are valid: a model explains the log, be it one of the nine conditions or not."""
        return self.state not in ("unknown", "failed")

    @property
    def shows_severities(self) -> bool:
        """Whether severities are shown: they are valid, or would be valid if the rig file is right."""
        return self.has_verdict or self.beside

    @property
    def worst(self) -> Amount | None:
        """The severity that is closest to its limit, or farthest beyond it."""
        return max(self.amounts.values(), key=lambda one: one.share, default=None)

    @property
    def order(self) -> tuple[int, float]:
        """Sort key: the sickest first."""
        return RANKS[self.state], -(self.worst.share if self.worst else 0.0)


def log_rows(
    rows: Iterable[Mapping[str, Any]], names: Mapping[str, ActuatorAndDate], limits: Mapping[str, float]
) -> list[LogRow]:
    """Return one row for each log that was diagnosed.

    Parameters
    ----------
    rows : iterable of Mapping
        Rows of a batch store, with ``file``, ``verb``, ``outcome``, ``found_condition``, ``reason`` and ``quantities``,
        and with ``against`` if it is known.
    names : Mapping[str, ActuatorAndDate]
        By file.
    limits : Mapping[str, float]
        Limits that replace those of the store, by severity [its unit].
    """
    return [
        _row(row, names.get(row["file"], UNNAMED), limits) for row in rows if row["file"] and row["verb"] == "diagnose"
    ]


def _row(row: Mapping[str, Any], named: ActuatorAndDate, limits: Mapping[str, float]) -> LogRow:
    amounts = _amounts(row["quantities"], limits)
    code, between = _levels_between(row.get("against"))
    state = _state(row, amounts)
    if state == "unknown" and code == BETWEEN_CODE:  # never certain: a sensor with a wrong gain would look the same
        state = "likely" if any(one.share > 1.0 for one in amounts.values()) else "open"
    beside = code == OUTSIDE_CODE
    return LogRow(
        row["file"], named, state, row["found_condition"] or "", row["reason"] or "", amounts, between, beside
    )


def _levels_between(text: str | None) -> tuple[str, dict[str, float]]:
    """Return code, leakage and friction of a log that is unknown only because its levels are those of no condition."""
    against = json.loads(text or "[]")
    if len(against) != 1 or against[0]["code"] not in (BETWEEN_CODE, OUTSIDE_CODE) or not against[0]["data"]:
        return "", {}
    return against[0]["code"], {name: against[0]["data"][name] for name in ("leakage", "friction")}


def _amounts(text: str | None, limits: Mapping[str, float]) -> dict[str, Amount]:
    """Return the severities that have a value, an interval and a limit."""
    found: dict[str, Amount] = {}
    for name, one in json.loads(text or "{}").items():
        limit = limits.get(name, one.get("limit"))
        told = [one["value"], *(one["ci95"] or ()), one.get("healthy"), limit]
        numbers = [float(number) for number in told if number is not None and math.isfinite(number)]
        if len(numbers) == AMOUNT_NUMBERS and limit != one["healthy"]:
            total = tuple(float(end) for end in one.get("ci95_total") or () if math.isfinite(end))
            found[name] = Amount(name, one["unit"], *numbers, total=total if len(total) == len(one["ci95"]) else ())
    return found


def _state(row: Mapping[str, Any], amounts: Mapping[str, Amount]) -> str:
    if row["outcome"] == "failed":
        return "failed"
    if row["outcome"] != "ok":
        return "unknown"
    if amounts:
        return min((one.state for one in amounts.values()), key=RANKS.__getitem__)
    return "within" if row["found_condition"] in ("normal", "healthy") else "over"
