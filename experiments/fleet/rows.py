"""One row a log, from the rows of a batch store: state, worst severity, and how near to its limit that is."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from estimation.finding import NORMAL_95
from experiments.fleet.naming import UNNAMED, Named
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
"""States of a log or an actuator, the most urgent first, and what a reader is told."""

BETWEEN, BESIDE = str(AgainstCode.BETWEEN_CONDITIONS), str(AgainstCode.OUTSIDE_CONDITIONS)
"""Codes of logs that one circuit explains, though none of the nine conditions does."""

RANKS: Mapping[str, int] = {name: place for place, name in enumerate(STATES)}


@dataclass(frozen=True)
class Amount:
    """A severity of a log.

    Parameters
    ----------
    value, low, high : float
        Estimate and 95 % interval [unit].
    healthy, limit : float
        Of the healthy actuator, and where it stops being sound [unit].
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    healthy: float
    limit: float

    @property
    def share(self) -> float:
        """Share of the way from healthy to the limit [fraction]: 1 at the limit, more beyond."""
        return (self.value - self.healthy) / (self.limit - self.healthy)

    @property
    def std(self) -> float:
        """Standard deviation, from a normal interval [unit]."""
        return 0.5 * (self.high - self.low) / NORMAL_95

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


@dataclass(frozen=True)
class LogRow:
    """One log of a fleet.

    Parameters
    ----------
    state : str
        One of `STATES`.
    condition : str
        That was found; empty where none was.
    reason : str
        Why there is none.
    between : Mapping[str, float]
        Where one circuit explains the log, but its leakage and friction are those of no condition: both to the nearest
        quarter, where 1 is minor and 2 is major [dimensionless]; else empty.
    beside : bool
        Whether such a circuit does not even lie between two conditions: the rig file may be another actuator's.
    """

    file: str
    named: Named
    state: str
    condition: str
    reason: str
    amounts: Mapping[str, Amount]
    between: Mapping[str, float] = field(default_factory=dict[str, float])
    beside: bool = False

    @property
    def told(self) -> bool:
        """Whether the severities are the actuator's: a model explains the log, of one of the nine conditions or not."""
        return self.state not in ("unknown", "failed")

    @property
    def shown(self) -> bool:
        """Whether severities are shown: they are the actuator's, if the rig file is."""
        return self.told or self.beside

    @property
    def worst(self) -> Amount | None:
        """The severity that is farthest towards its limit."""
        return max(self.amounts.values(), key=lambda one: one.share, default=None)

    @property
    def order(self) -> tuple[int, float]:
        """The sickest first."""
        return RANKS[self.state], -(self.worst.share if self.worst else 0.0)


def log_rows(
    rows: Iterable[Mapping[str, Any]], names: Mapping[str, Named], limits: Mapping[str, float]
) -> list[LogRow]:
    """Return one row a log that was diagnosed.

    Parameters
    ----------
    rows : iterable of Mapping
        Of a batch store, with ``file``, ``verb``, ``outcome``, ``found_condition``, ``reason`` and ``quantities``.
    names : Mapping[str, Named]
        By file.
        ``against`` too, where it is known.
    limits : Mapping[str, float]
        That replace those of the store, by severity [its unit].
    """
    return [
        _row(row, names.get(row["file"], UNNAMED), limits) for row in rows if row["file"] and row["verb"] == "diagnose"
    ]


def _row(row: Mapping[str, Any], named: Named, limits: Mapping[str, float]) -> LogRow:
    amounts = _amounts(row["quantities"], limits)
    code, between = _placed(row.get("against"))
    state = _state(row, amounts)
    if state == "unknown" and code == BETWEEN:  # never surely: a sensor with a wrong gain would look alike
        state = "likely" if any(one.share > 1.0 for one in amounts.values()) else "open"
    beside = code == BESIDE
    return LogRow(
        row["file"], named, state, row["found_condition"] or "", row["reason"] or "", amounts, between, beside
    )


def _placed(text: str | None) -> tuple[str, dict[str, float]]:
    """Return code, leakage and friction of a log that is unknown only because they are those of no condition."""
    against = json.loads(text or "[]")
    if len(against) != 1 or against[0]["code"] not in (BETWEEN, BESIDE) or not against[0]["data"]:
        return "", {}
    return against[0]["code"], {name: against[0]["data"][name] for name in ("leakage", "friction")}


def _amounts(text: str | None, limits: Mapping[str, float]) -> dict[str, Amount]:
    """Return the severities that have a value, an interval and a limit."""
    found: dict[str, Amount] = {}
    for name, one in json.loads(text or "{}").items():
        limit = limits.get(name, one.get("limit"))
        told = [one["value"], *(one["ci95"] or ()), one.get("healthy"), limit]
        numbers = [float(number) for number in told if number is not None and math.isfinite(number)]
        if len(numbers) == len(fields(Amount)) - 2 and limit != one["healthy"]:
            found[name] = Amount(name, one["unit"], *numbers)
    return found


def _state(row: Mapping[str, Any], amounts: Mapping[str, Amount]) -> str:
    if row["outcome"] == "failed":
        return "failed"
    if row["outcome"] != "ok":
        return "unknown"
    if amounts:
        return min((one.state for one in amounts.values()), key=RANKS.__getitem__)
    return "within" if row["found_condition"] in ("normal", "healthy") else "over"
