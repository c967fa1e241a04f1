"""One log with its numbers, timestamps and lines in many notations: it is read as that log, or refused.

Run it as ``python -m tests.fuzz.spellings 3000``.
"""

import sys
import tempfile
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from plant.log.files import read_record
from plant.log.record import Record
from tests.fuzz.guard import limited
from tests.fuzz.seeds import small_log

RPM = 60.0 / (2.0 * np.pi)
N = 400
"""Rows: more than are examined for the layout [count]."""

SCALES: Mapping[str, float] = {
    "Motor speed [rpm]": RPM,
    "Position [um]": 1e6,
    "Velocity [mm/s]": 1e3,
    "Differential pressure [Pa]": 1.0,
}


def grouped(value: float, between: str, point: str, digits: int) -> str:
    """Return a number with thousands separators."""
    return f"{value:,.{digits}f}".translate({ord(","): between, ord("."): point})


Spell = Callable[[float], str]
SPELLINGS: Mapping[str, Spell] = {
    "shortest": lambda v: repr(float(v)),
    "exponents": lambda v: f"{v:+.9E}",
    "Fortran": lambda v: f"{v:.9e}".replace("e", "D"),
    "padded": lambda v: f"{v:25.9f}",
    "quoted": lambda v: f'"{v:.9f}"',
    "decimal comma": lambda v: f"{v:.9f}".replace(".", ","),
    "Swedish minus": lambda v: f"{v:.9f}".replace("-", "\u2212"),
    "thousands": lambda v: grouped(v, ",", ".", 9),
    "German thousands": lambda v: grouped(v, ".", ",", 9),
    "Swiss thousands": lambda v: grouped(v, "'", ".", 9),
    "French thousands": lambda v: grouped(v, "\u202f", ",", 9),
    "whole thousands": lambda v: grouped(v, ",", ".", 0),
    "whole German thousands": lambda v: grouped(v, ".", ",", 0),
    "underscores": lambda v: f"{v:_.9f}",
    "brackets": lambda v: f"({-v:.9f})" if v < 0.0 else f"{v:.9f}",
    "minus behind": lambda v: f"{-v:.9f}-" if v < 0.0 else f"{v:.9f}",
    "percent": lambda v: f"{100.0 * v:.9f}%",
    "hexadecimal": lambda v: float(v).hex(),
    "formula": lambda v: f'="{v:.9f}"',
    "full width": lambda v: f"{v:.9f}".translate({ord("0") + one: 0xFF10 + one for one in range(10)}),
}
"""Notations for a number; "whole" ones round it."""

STAMPS: tuple[str, ...] = (
    *("%Y-%m-%dT%H:%M:%S.%fZ", "%d.%m.%Y %H:%M:%S.%f", "%m/%d/%Y %I:%M:%S.%f %p", "%d-%b-%Y %H:%M:%S.%f"),
    *("%Y%m%dT%H%M%S.%f", "%H:%M:%S.%f", "%Y-%m-%d %H:%M:%S:%f", "%d/%m/%y %H:%M:%S.%f", "%I:%M:%S.%f"),
)
MOMENTS = (
    "1969-12-31 23:59:59.9",
    "1900-01-01",
    "2024-02-29 23:59:59.9",
    "2026-03-29 00:59:59.9",
    "2026-03-01 12:59:59.9",
)
"""Start times of a log: before 1970, and at a change of day, year or hour."""

LINES: Mapping[str, Callable[[list[str], str], list[str]]] = {
    "as they are": lambda lines, _: lines,
    "closed": lambda lines, by: [f"{line}{by}" for line in lines],
    "units below": lambda lines, by: [lines[0], by.join(("s", "rpm", "um", "mm/s", "Pa")), *lines[1:]],
    "wrong units below": lambda lines, by: [lines[0], by.join(("ms", "rpm", "mm", "m/s", "bar")), *lines[1:]],
    "header twice": lambda lines, _: [lines[0], *lines],
    "row numbers": lambda lines, by: [f"{by}{lines[0]}", *(f"{row}{by}{one}" for row, one in enumerate(lines[1:]))],
    "every row twice": lambda lines, _: [lines[0], *(one for line in lines[1:] for one in (line, line))],
    "backwards": lambda lines, _: [lines[0], *lines[:0:-1]],
    "two logs": lambda lines, _: [*lines, *lines[1:]],
    "a mean below": lambda lines, by: [*lines, by.join(("Mean", "1", "2", "3", "4"))],
    "mode": lambda lines, by: [f"{lines[0]}{by}mode", *(f"{one}{by}RUN" for one in lines[1:])],
}
ENCODINGS = ("utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "cp1252")


def spelt(log: pd.DataFrame, rng: np.random.Generator) -> tuple[str, bytes]:
    """Return a label of the notation, and the file's content."""
    how = str(rng.choice(list(SPELLINGS)))
    by, ends, lines_are = (str(rng.choice(some)) for some in ((",", ";", "\t", "|"), ("\n", "\r\n"), list(LINES)))
    time, stamps = log["time_s"].to_numpy(), [SPELLINGS[how](1e3 * one + 1.0) for one in log["time_s"]]
    heading = "Time [ms]"
    if rng.random() < 0.4:
        moments = pd.Timestamp(str(rng.choice(MOMENTS))) + pd.to_timedelta(
            np.rint(1e6 * time).astype("int64"), unit="us"
        )
        heading, stamps = "Time", list(moments.strftime(str(rng.choice(STAMPS))))
    columns = [stamps, *([SPELLINGS[how](scale * one) for one in log[si]] for si, scale in _scaled(log))]
    # unquoted, a cell with the delimiter would be two cells, and no reader could know better
    kept = [[f'"{cell}"' if by in cell and '"' not in cell else cell for cell in column] for column in columns]
    lines = LINES[lines_are]([by.join([heading, *SCALES]), *map(by.join, zip(*kept, strict=True))], by)
    encoding = str(rng.choice(ENCODINGS))
    label = f"{how}, {heading}, {stamps[0]!r}, {lines_are}, {by!r}, {encoding}"
    return label, (ends.join(lines) + ends).encode(encoding, errors="replace")


def _scaled(log: pd.DataFrame) -> list[tuple[str, float]]:
    return list(zip(log.columns[1:], SCALES.values(), strict=True))


def difference(record: Record, log: pd.DataFrame, how: str) -> str:
    """Return how a record differs from the log, or an empty string; channels or samples may be missing."""
    if abs(record.sample_time - 1e-3) > 1e-6:
        return f"a sample time of {record.sample_time:g} s"
    if not 0.97 * len(log) <= len(record) <= len(log):
        return f"{len(record)} rows"
    for name in set(log.columns[1:]) & set(record.channels):
        wanted, got = log[name].to_numpy()[: len(record)], np.asarray(record[name])
        rounding = 0.6 / SCALES[list(SCALES)[list(log.columns[1:]).index(name)]] if how.startswith("whole") else 0.0
        off = np.abs(got - wanted)
        if np.nanmax(off, initial=0.0) > 2e-6 * np.abs(wanted).max() + rounding:
            return f"{name} off by {np.nanmax(off):g}"
    return ""


def run(count: int, first: int = 0) -> list[str]:
    """Write the log in a number of notations, and return the failures with their seeds."""
    log, wrong = small_log(N), []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            label, content = spelt(log, np.random.default_rng(seed))
            path = Path(folder) / "log.csv"
            path.write_bytes(content)
            said = limited(lambda path=path, label=label: _require_the_log(path, log, label))
            wrong += [f"{label}, seed {seed}: {said}"] if said else []
    return wrong


def _require_the_log(path: Path, log: pd.DataFrame, label: str) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        record = read_record(path)
    if off := difference(record, log, label):
        raise AssertionError(f"read as another log: {off}")


if __name__ == "__main__":
    found = run(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    sys.stdout.write("\n".join([*found, f"{sys.argv[1]} files, {len(found)} wrong\n"]))
    sys.exit(bool(found))
