"""Ranks the logs of a batch study by how near each is to a limit, in one sentence and in two columns."""

from collections import Counter
from collections.abc import Mapping, Sequence
from posixpath import basename
from typing import Any

import pandas as pd
import pyarrow as pa

from experiments.fleet.page import worst_severity_text
from experiments.fleet.rows import LogRow, log_rows
from experiments.page.numbers import fixed

STANDING_COLUMNS = ("file", "verb", "outcome", "found_condition", "reason", "quantities", "against")
"""Columns of a store that show how bad a log is."""

SICK_STATES = ("over", "likely")
"""States of a log whose actuator needs maintenance."""

OTHERS: Mapping[str, str] = {
    "likely": "{} probably past one",
    "open": "{} may be past one",
    "unknown": "{} without a verdict",
    "within": "{} within limits",
    "failed": "{} could not be read",
}
"""Phrases for the number of logs in each other state."""

MOST_NAMED = 5
"""Maximum number of logs to name [count]."""


def logs_by_standing(rows: pa.Table) -> list[LogRow]:
    """Return the diagnosed logs, the worst first; a log that was diagnosed twice counts with its worse row.

    Parameters
    ----------
    rows : pyarrow.Table
        Rows of a batch store.
    """
    found = sorted(log_rows(rows.select(list(STANDING_COLUMNS)).to_pylist(), {}, {}), key=lambda one: one.order)
    first: dict[str, LogRow] = {}
    for one in found:
        first.setdefault(one.file, one)
    return list(first.values())


def standing_in_words(logs: Sequence[LogRow]) -> tuple[str, str]:
    """Return how many logs are past a limit and which to inspect first; empty if there are no logs."""
    if not logs:
        return "", ""
    counts = Counter(one.state for one in logs)
    others = [words.format(counts[name]) for name, words in OTHERS.items() if counts[name]]
    said = f"{counts['over'] or 'None'} of {len(logs)} logs {'is' if counts['over'] < 2 else 'are'} past a limit"
    told = f"{said}; {', '.join(others)}." if others else f"{said}."
    sick = [basename(one.file) for one in logs if one.state in SICK_STATES][:MOST_NAMED]
    return told, f"Start with {', '.join(sick)}." if sick else ""


def with_standing(table: pd.DataFrame, logs: Sequence[LogRow]) -> pd.DataFrame:
    """Return the table of logs, the worst first, with the state of each and its worst severity.

    Parameters
    ----------
    table : pandas.DataFrame
        Table with ``file``.
    logs : sequence of LogRow
        Logs from `logs_by_standing`.

    Returns
    -------
    pandas.DataFrame
        The table with ``state`` and ``worst``; logs that were not diagnosed come last, in their original order.
    """
    known: Mapping[str, LogRow] = {one.file: one for one in logs}
    places = {one.file: place for place, one in enumerate(logs)}
    order = sorted(range(len(table)), key=lambda row: places.get(table["file"].iloc[row], len(logs)))
    sorted_table = table.iloc[order].reset_index(drop=True)
    files: list[Any] = sorted_table["file"].tolist()
    states: list[Any] = [known[file].state if file in known else None for file in files]
    return sorted_table.assign(
        state=states,
        worst=[_worst(known.get(file)) for file in files],
    )


def _worst(log: LogRow | None) -> str:
    """Return the severity nearest to or farthest beyond its limit, and its percentage of the limit."""
    if log is None or log.worst is None or not log.has_verdict:
        return ""
    return f"{worst_severity_text(log)}, {fixed(100.0 * log.worst.share, 0)} % of the limit"
