"""One row for each case: its settings and its result. Nothing in it depends on when or where it was run.

The rows of a task are kept column by column. The settings are stored once for each series and each work, and are copied
to the rows at the end; each result is written directly to its case's place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, NamedTuple, TypeAlias

import pyarrow as pa

from experiments.batch.series import Group, Log, Series, Simulated, Work
from experiments.command.visible_text import valid_text
from plant.errors import HydrostateError

TEXT, NUMBER = pa.string(), pa.float64()

ARROW: Mapping[Any, pa.DataType] = {
    str: TEXT,
    str | None: TEXT,
    float: NUMBER,
    float | None: NUMBER,
    int: pa.int64(),
    bool: pa.bool_(),
}
"""Column types by the annotations of `Simulated` and `Work`."""

NIS: Mapping[str, str] = {
    "position_m": "nis_position",
    "velocity_m_s": "nis_velocity",
    "differential_pressure_pa": "nis_pressure",
}
"""Column of each channel's normalised innovation squared [dimensionless]."""

SIMULATED_FIELDS, WORK_FIELDS = ({one.name: ARROW[one.type] for one in fields(kind)} for kind in (Simulated, Work))

TRUTH = "true_bulk_modulus_pa"

SCHEMA = pa.schema(
    {
        **dict.fromkeys(("key", "plant", "file"), TEXT),
        **SIMULATED_FIELDS,
        **WORK_FIELDS,
        **dict.fromkeys(("outcome", "reason", "warnings"), TEXT),
        **dict.fromkeys((TRUTH, "bulk_modulus_pa", "bulk_modulus_std_pa", "error_percent"), NUMBER),
        "trusted": pa.bool_(),
        **dict.fromkeys(("found_condition", "runner_up"), TEXT),
        **dict.fromkeys(("margin", *NIS.values(), "log_likelihood"), NUMBER),
        **dict.fromkeys(("quantities", "against"), TEXT),
    }
)
"""Columns of the store. ``outcome`` is ok, not_observable, mismatch, diverged or failed, and ``reason`` says why.
``plant`` is ``log`` for a log, whose ``condition`` is known only if it was written down when the log was made; for
other kinds of actuator than the gear-pump one, ``plant`` is the kind, and ``quantities`` holds the findings as JSON.
``against`` (JSON) lists the evidence against every class, each item a note's code and data."""

Row: TypeAlias = dict[str, Any]

RESULT_COLUMNS = tuple(name for name in SCHEMA.names[SCHEMA.names.index("outcome") :] if name != TRUTH)
"""Columns of a case's result; the columns before them, and the truth, describe the case."""


class Failure(NamedTuple):
    """A case that failed.

    Parameters
    ----------
    series, verb, reason : str
        The log's file or a name for the simulated run; the analysis; and why it failed.
    """

    series: str
    verb: str
    reason: str


class Rows:
    """The rows of a task while its cases are run, each identified by its place in the task."""

    def __init__(self, groups: Sequence[Group]) -> None:
        self._keys = [key for group in groups for key in group.keys]
        self._works = [work for group in groups for work in group.works]
        self._series_of = [number for number, group in enumerate(groups) for _ in group.keys]
        self._series = [_series_entries(group.series) for group in groups]
        self._found: dict[str, list[Any]] = {name: [None] * len(self._keys) for name in RESULT_COLUMNS}

    def describe(self, series: int, entries: Mapping[str, Any]) -> None:
        """Record what was learnt about a series when it was read.

        Parameters
        ----------
        entries : Mapping[str, Any]
            Entries by column, for the columns that describe a case.
        """
        self._series[series] |= entries

    def put(self, places: Sequence[int], columns: Mapping[str, Sequence[Any]]) -> None:
        """Write the results of some cases.

        Parameters
        ----------
        columns : Mapping[str, sequence]
            A value for each case, by column of `RESULT_COLUMNS`.
        """
        for name, values in columns.items():
            column = self._found[name]
            for place, value in zip(places, values, strict=True):
                column[place] = value

    def fail(self, places: Sequence[int], reason: str | Exception) -> None:
        """Record that cases could not be run."""
        told = valid_text(" ".join(_reason_text(reason).split()))
        self.put(places, {"outcome": ["failed"] * len(places), "reason": [told] * len(places)})

    def failures(self) -> tuple[Failure, ...]:
        """Return all cases that failed."""
        outcomes, reasons = self._found["outcome"], self._found["reason"]
        places = (place for place, outcome in enumerate(outcomes) if outcome == "failed")
        return tuple(Failure(self._in_words(one), self._works[one].verb, str(reasons[one])) for one in places)

    def table(self) -> pa.Table:
        """Return the rows as a table of the store.

        Returns
        -------
        pyarrow.Table
            The table, with `SCHEMA`; unknown values are null.
        """
        works = {work: number for number, work in enumerate(dict.fromkeys(self._works))}
        work_of = pa.array([works[work] for work in self._works], pa.int32())
        series_of = pa.array(self._series_of, pa.int32())
        columns: dict[str, Any] = {"key": pa.array(self._keys, pa.string())}
        for name, kind in zip(SCHEMA.names[1:], SCHEMA.types[1:], strict=True):
            if name in WORK_FIELDS:
                columns[name] = pa.array([getattr(work, name) for work in works], kind).take(work_of)
            elif name in self._found:
                columns[name] = pa.array(self._found[name], kind)
            else:
                columns[name] = pa.array([one.get(name) for one in self._series], kind).take(series_of)
        return pa.table(columns, schema=SCHEMA)

    def _in_words(self, place: int) -> str:
        """Return the name of a case's series for a sentence: the log's file, or the simulated run."""
        series = self._series[self._series_of[place]]
        if series.get("file"):
            return str(series["file"])
        condition = series["condition"] or f"severity {series['leakage_severity']:g}, {series['friction_severity']:g}"
        return f"{series['plant']} {series['drive']} {condition} seed {series['seed']}"


def error_percent(value: float | None, truth: float | None) -> float | None:
    """Return the error of a value [%].

    Parameters
    ----------
    value, truth : float or None
        Estimate and truth, in one unit.

    Returns
    -------
    float or None
        The error; None if either is unknown.

    Examples
    --------
    >>> error_percent(2.5e8, 2e8)
    25.0
    """
    return None if value is None or truth is None else 100.0 * (value / truth - 1.0)


def _reason_text(reason: str | Exception) -> str:
    if isinstance(reason, str | HydrostateError):
        return str(reason)
    return f"an internal error, {type(reason).__name__}: {str(reason)[:300]}"


def _series_entries(series: Series) -> Row:
    if isinstance(series, Log):
        return {"plant": "log", "file": series.file}
    return {name: getattr(series, name) for name in SIMULATED_FIELDS}
