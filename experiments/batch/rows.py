"""One row a case: what it was, and what came of it. Nothing in it depends on when or where it was run."""

from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any

import pyarrow as pa

from experiments.batch.series import Log, Series, Simulated, Work

SCHEMA = pa.schema(
    [
        ("key", pa.string()),
        ("plant", pa.string()),
        ("file", pa.string()),
        ("drive", pa.string()),
        ("sensors", pa.string()),
        ("condition", pa.string()),
        ("leakage_severity", pa.float64()),
        ("friction_severity", pa.float64()),
        ("seed", pa.int64()),
        ("duration_s", pa.float64()),
        ("sample_time_s", pa.float64()),
        ("verb", pa.string()),
        ("form", pa.string()),
        ("method", pa.string()),
        ("pressure", pa.bool_()),
        ("told", pa.string()),
        ("start_pa", pa.float64()),
        ("start_std_pa", pa.float64()),
        ("outcome", pa.string()),
        ("reason", pa.string()),
        ("warnings", pa.string()),
        ("true_bulk_modulus_pa", pa.float64()),
        ("bulk_modulus_pa", pa.float64()),
        ("bulk_modulus_std_pa", pa.float64()),
        ("error_percent", pa.float64()),
        ("trusted", pa.bool_()),
        ("found_condition", pa.string()),
        ("runner_up", pa.string()),
        ("margin", pa.float64()),
        ("nis_position", pa.float64()),
        ("nis_velocity", pa.float64()),
        ("nis_pressure", pa.float64()),
        ("log_likelihood", pa.float64()),
    ]
)
"""Columns of the store. ``outcome`` is ok, not_observable, mismatch, diverged or failed, and ``reason`` says why;
``plant`` is ``log`` for a log, whose ``condition`` is known only if whoever made the log wrote it down."""

NIS: Mapping[str, str] = MappingProxyType(
    {
        "position_m": "nis_position",
        "velocity_m_s": "nis_velocity",
        "differential_pressure_pa": "nis_pressure",
    }
)
"""Column of each channel's normalised innovation squared [dimensionless]."""

Row = dict[str, Any]


def case_row(key: str, series: Series, work: Work) -> Row:
    """Return the entries of a row that say which case it is.

    Parameters
    ----------
    key : str
        The case's key.
    series : Series
        Its series.
    work : Work
        What is done with it.

    Returns
    -------
    dict[str, Any]
        Entries by column.
    """
    return {"key": key, **_series_entries(series), **work.__dict__}


def failed(case: Row, reason: str) -> Row:
    """Return the row of a case that could not be run.

    Parameters
    ----------
    case : dict[str, Any]
        From `case_row`.
    reason : str
        Why.

    Returns
    -------
    dict[str, Any]
        The row.
    """
    return {**case, "outcome": "failed", "reason": " ".join(reason.split())}


def in_words(row: Row) -> str:
    """Return what a case is called in a sentence.

    Parameters
    ----------
    row : dict[str, Any]
        Its row.

    Returns
    -------
    str
        The log's file, or what was simulated; and what was done.
    """
    if row["plant"] == "log":
        return f"{row['file']} ({row['verb']})"
    condition = row["condition"] or f"severity {row['leakage_severity']:g}, {row['friction_severity']:g}"
    return f"{row['plant']} {row['drive']} {condition} seed {row['seed']} ({row['verb']})"


def _series_entries(series: Series) -> Row:
    if isinstance(series, Log):
        return {"plant": "log", "file": series.file}
    return {one.name: getattr(series, one.name) for one in SIMULATED_FIELDS}


SIMULATED_FIELDS = fields(Simulated)


def as_table(rows: list[Row]) -> pa.Table:
    """Return rows as a table of the store.

    Parameters
    ----------
    rows : list of dict
        Entries by column; a column that a row lacks is null.

    Returns
    -------
    pyarrow.Table
        The table, with `SCHEMA`.
    """
    return pa.Table.from_pydict({name: [row.get(name) for row in rows] for name in SCHEMA.names}, schema=SCHEMA)
