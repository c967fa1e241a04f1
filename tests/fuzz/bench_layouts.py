"""One log in the layouts of bench programs, with mishaps: it is read as that log, or with a warning, or refused.

Mishaps are a repeated header, a second table, a decimal comma that begins below the examined lines, reversed rows, and
lines of messages. If rows or samples are lost, a warning says so, and no number is changed.

Run it as ``python -m tests.fuzz.bench_layouts 3000``.
"""

import sys
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from plant.errors import LogError
from plant.log.files import read_record
from plant.log.record import Record
from tests.fuzz.guard import limited
from tests.fuzz.seeds import small_log

N = 400
"""Rows: more than are examined for the layout [count]."""

NAMES = ("Time", "Motor speed", "Position", "Velocity", "Differential pressure")
UNITS = ("ms", "rpm", "um", "mm/s", "kPa")
SCALES = (1e3, 60.0 / (2.0 * np.pi), 1e6, 1e3, 1e-3)

Rows = Sequence[Sequence[str]]
Laid = tuple[list[str], list[str]]
"""Lines of the header, and of the rows."""


def _labview(rows: Rows, by: str) -> Laid:
    above = ["LabVIEW Measurement", by.join(("X_Columns", "One")), "***End_of_Header***", ""]
    told = [by.join(("Y_Unit_Label", *UNITS[1:])), "***End_of_Header***", by.join(("X_Value", *NAMES[1:], "Comment"))]
    seconds = [[f"{float(one[0].replace(',', '.')) / 1e3!r}".replace(".", _point(one[1])), *one[1:]] for one in rows]
    return [*above, *told], [by.join(one) for one in seconds]


def _point(cell: str) -> str:
    return "," if "," in cell else "."


def _twincat(rows: Rows, by: str) -> Laid:
    pairs = (("Name", NAMES[1:]), ("SampleTime[ms]", ("1",) * 4), ("Port", ("851",) * 4), ("Unit", UNITS[1:]))
    above = [by.join(cell for one in some for cell in (key, one)) for key, some in pairs]
    return [by.join(("Name", "Project")), "", *above, ""], [
        by.join(x for v in one[1:] for x in (one[0], v)) for one in rows
    ]


def _pairs(rows: Rows, by: str) -> Laid:
    head = by.join(x for one in BRACKETED[1:] for x in (BRACKETED[0], one))
    return [head], [by.join(x for v in one[1:] for x in (one[0], v)) for one in rows]


def _plain(rows: Rows, by: str, *above: Sequence[str]) -> Laid:
    return [by.join(one) for one in above], [by.join(one) for one in rows]


BRACKETED = tuple(f"{name} [{unit}]" for name, unit in zip(NAMES, UNITS, strict=True))
LAYOUTS: Mapping[str, Callable[[Rows, str], Laid]] = {
    "brackets": lambda rows, by: _plain(rows, by, BRACKETED),
    "a row of units": lambda rows, by: _plain(rows, by, NAMES, UNITS),
    "PicoScope": lambda rows, by: _plain(rows, by, NAMES, [f"({unit})" for unit in UNITS], [""]),
    "ETAS": lambda rows, by: _plain(rows, by, ["ETASAsciiItemFile record 0 0"], NAMES, UNITS, ["f8"] * 5),
    "a title": lambda rows, by: _plain(rows, by, ["Bench 2"], ["Operator", "7"], [""], NAMES, UNITS),
    "Excel": lambda rows, by: _plain(
        rows, by, ["Bench 2", *[""] * 4], ["Rate", "1000", *[""] * 3], [""] * 5, BRACKETED
    ),
    "a clock for each": lambda rows, by: _pairs(rows, by),
    "LabVIEW": _labview,
    "TwinCAT Scope": _twincat,
}


class Laying(NamedTuple):
    """A log in a layout, and the row of its mishap."""

    head: list[str]
    rows: list[str]
    at: int
    by: str

    def with_row(self, *lines: str) -> list[str]:
        """Return the rows with others in place of that row."""
        return [*self.rows[: self.at], *lines, *self.rows[self.at + 1 :]]

    def with_more(self, *lines: str) -> list[str]:
        """Return the rows with others before that row."""
        return [*self.rows[: self.at], *lines, *self.rows[self.at :]]

    @property
    def row(self) -> str:
        """The row of the mishap."""
        return self.rows[self.at]


_OTHER_SIGN = str.maketrans(".,", ",.")
MISHAPS: Mapping[str, Callable[[Laying], list[str]]] = {
    "none": lambda log: log.rows,
    "header again": lambda log: log.with_more(log.head[-1] or log.head[-2]),
    "whole header again": lambda log: log.with_more(*log.head),
    "two logs": lambda log: [*log.rows, *log.head, *log.rows],
    "a mark of order": lambda log: log.with_row(f"\ufeff{log.row}"),
    "some turned round": lambda log: [
        *log.rows[: log.at],
        *log.rows[log.at : log.at + 5][::-1],
        *log.rows[log.at + 5 :],
    ],
    "a row turned round": lambda log: log.with_row(log.by.join(log.row.split(log.by)[::-1])),
    "rows lost": lambda log: [*log.rows[: log.at], *log.rows[log.at + 3 :]],
    "two rows in a line": lambda log: log.with_row(log.row + log.row),
    "a cut row": lambda log: log.with_row(log.row[: len(log.row) // 2]),
    "a message": lambda log: log.with_more("*** overload ***"),
    "the other decimal sign": lambda log: [
        *log.rows[: log.at],
        *(x.translate(_OTHER_SIGN) for x in log.rows[log.at :]),
    ],
    "a second table": lambda log: [*log.rows, "", log.by.join("abcde"), *[log.by.join("12345")] * 9],
    "an end": lambda log: [*log.rows, "EOF"],
}


def laid_out(log: pd.DataFrame, rng: np.random.Generator) -> tuple[str, bytes]:
    """Return a label of the layout and the mishap, and the file's content."""
    kind, mishap = (str(rng.choice(list(some))) for some in (LAYOUTS, MISHAPS))
    by, point = (str(rng.choice(some)) for some in ((";", "\t"), (".", ",")))
    columns = [[f"{scale * one:.10g}" for one in log[name]] for name, scale in zip(log.columns, SCALES, strict=True)]
    rows = [[cell.replace(".", point) for cell in row] for row in zip(*columns, strict=True)]
    head, lines = LAYOUTS[kind](rows, by)
    lines = MISHAPS[mishap](Laying(head, lines, int(rng.integers(1, N - 6)), by))
    encoding = str(rng.choice(("utf-8", "utf-8-sig", "utf-16", "cp1252")))
    text = "\r\n".join([*head, *lines, ""])
    return f"{kind}, {mishap}, {by!r}, {point!r}, {encoding}", text.encode(encoding, errors="replace")


def difference(record: Record, log: pd.DataFrame, told: bool) -> str:
    """Return how a record differs from the log, or an empty string; with a warning, parts may be missing."""
    if abs(record.sample_time - 1e-3) > 1e-6:
        return f"a sample time of {record.sample_time:g} s"
    if not (len(record) == len(log) or (told and len(record) < len(log))):
        return f"{len(record)} rows"
    for name in log.columns[1:]:
        if name not in record:
            if not told:
                return f"no {name}"
            continue
        wanted, got = log[name].to_numpy()[: len(record)], record[name]
        if np.nanmax(np.abs(got - wanted), initial=0.0) > 2e-6 * np.abs(wanted).max() or (
            np.isnan(got).any() and not told
        ):
            return f"{name} differs"
    return ""


def run(count: int, first: int = 0) -> list[str]:
    """Write the log in a number of layouts, and return the failures with their seeds."""
    log, wrong = small_log(N), []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        for seed in range(first, first + count):
            label, content = laid_out(log, np.random.default_rng(seed))
            path.write_bytes(content)
            said = limited(lambda: _require_the_log(path, log))
            wrong += [f"{label}, seed {seed}: {said}"] if said else []
    return wrong


def _require_the_log(path: Path, log: pd.DataFrame) -> None:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        record = read_record(path)
    if off := difference(record, log, bool(told)):
        raise AssertionError(f"read as another log: {off}")


def read_unspoilt(kind: str, folder: Path) -> Record:
    """Return the log as read from a layout without a mishap."""
    log = small_log(N)
    columns = [[f"{scale * one:.10g}" for one in log[name]] for name, scale in zip(log.columns, SCALES, strict=True)]
    head, lines = LAYOUTS[kind](list(zip(*columns, strict=True)), "\t")
    path = folder / "log.csv"
    path.write_text("\n".join([*head, *lines, ""]))
    record = read_record(path)
    if off := difference(record, log, told=False):
        raise LogError(off)
    return record


if __name__ == "__main__":
    failures = run(int(sys.argv[1]))
    sys.stdout.write("\n".join([*failures, f"{len(failures)} wrong"]) + "\n")
