"""A fleet of 200 actuators x 60 logs: its page from the store and from raw logs, and whether faulty ones rank on top.

One actuator in ten leaks more from log to log and ends near or past its limit. The store is written with severities
that scatter as those of real logs do. The shipped command makes its page, including pages of the 20 worst actuators.
Raw logs are 2 s at 1 kHz with pressure. By default, a quarter of 480 of them, then all 480, go through the shipped
command. The time for the whole fleet is extrapolated from the difference, so that process start and pages count once.
``--raw-logs 12000`` measures it in full and needs 4 GB of disk space; ``--raw-logs 0`` measures only the page from the
store.
"""

import argparse
import json
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.targets import check_target, misses
from estimation.finding import NORMAL_95
from experiments.batch.part_store import open_store
from experiments.batch.rows import SCHEMA
from faults.conditions import severity
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.files import write_record
from plant.sensors.sensors import BENCH

SAMPLE_TIME, DURATION = 1e-3, 2.0
PATTERN = "{actuator}_{date}.csv"
ONE_FAULTY_IN = 10
"""One actuator in this many is faulty [count]."""

HEALTHY, LIMIT, STD = 1.0, 3.0, 0.06
"""Leakage of a healthy actuator, its limit, and the standard deviation of one log [L/min]."""

PAGE_IN, WHOLE_IN = 5.0, 240.0
"""Time for the page from the store, and for all from raw logs [s]."""


def is_sick(actuator: int) -> bool:
    """Return whether an actuator has growing leakage."""
    return actuator % ONE_FAULTY_IN == ONE_FAULTY_IN // 2


def name_of(actuator: int, log: int) -> str:
    """Return the file name of a log; there is one each week."""
    date = np.datetime64("2025-01-06") + 7 * log
    return f"A{actuator:03d}_{date}.csv"


def severity_courses(actuators: int, logs: int) -> Array:
    """Return how close each actuator is to its limit after each log, shape (actuators, logs) [fraction]."""
    sick = np.array([is_sick(one) for one in range(actuators)])
    reached = np.linspace(0.95, 1.4, actuators)
    begin = logs // 3
    return np.where(sick, reached, 0.0)[:, None] * np.clip((np.arange(logs) - begin) / (logs - 1 - begin), 0.0, 1.0)


def write_store(place: Path, course: Array) -> None:
    """Write the rows that a batch would write for these logs."""
    rng = np.random.default_rng(4)
    rows: list[dict[str, Any]] = []
    for actuator, log in np.ndindex(course.shape):
        truth = HEALTHY + (LIMIT - HEALTHY) * float(course[actuator, log])
        leakage, stiff = truth + STD * rng.standard_normal(), 2.07e8 + 1e6 * rng.standard_normal()
        found = {
            "leakage_flow": _amount(leakage, STD, "L/min", HEALTHY, LIMIT),
            "bulk_modulus": _amount(stiff, 1e6, "Pa", 2.07e8, 1.656e8),
        }
        condition = "normal" if course[actuator, log] < 1.0 else "minor_leakage"
        told = {"key": f"{len(rows):032x}", "plant": "log", "file": name_of(actuator, log), "verb": "diagnose"}
        rows.append({**told, "outcome": "ok", "found_condition": condition, "quantities": json.dumps(found)})
    table, keys, sink = pa.Table.from_pylist(rows, schema=SCHEMA), [row["key"] for row in rows], pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    store = open_store(place)
    with store.writing():
        store.describe({"study": "fleet"}, keys)
        store.add(sink.getvalue().to_pybytes(), keys)


def _amount(value: float, std: float, unit: str, healthy: float, limit: float) -> dict[str, Any]:
    ends = [value - NORMAL_95 * std, value + NORMAL_95 * std]
    return {"value": value, "unit": unit, "ci95": ends, "healthy": healthy, "limit": limit}


def write_logs(folder: Path, course: Array, most: int) -> int:
    """Write raw logs, the last ones of every actuator first, and return how many."""
    folder.mkdir()
    places = [(actuator, log) for log in range(course.shape[1])[::-1] for actuator in range(course.shape[0])][:most]
    for actuator, log in places:
        rng = np.random.default_rng([actuator, log])
        p = severity(float(course[actuator, log]), 0.0)
        record = simulate(
            CIRCUIT, make_drive("steps", DURATION, SAMPLE_TIME, p, rng), SAMPLE_TIME, p, sensors=BENCH, rng=rng
        )
        write_record(record, folder / name_of(actuator, log))
    return len(places)


class CommandTime(NamedTuple):
    """Time of the shipped command: wall time, and processor time of all its processes [s]."""

    wall: float
    used: float


def _time_difference(all_of: CommandTime, part: CommandTime) -> CommandTime:
    """Return the difference in time between two runs."""
    return CommandTime(all_of.wall - part.wall, all_of.used - part.used)


def _child_time() -> float:
    """Return the processor time of child processes that have ended [s]."""
    all_so_far = resource.getrusage(resource.RUSAGE_CHILDREN)
    return all_so_far.ru_utime + all_so_far.ru_stime


def fleet_of(place: Path, out: Path, *options: str) -> tuple[CommandTime, list[str]]:
    """Return the time of the shipped command, and its actuators in ranked order."""
    command = [sys.executable, "-m", "experiments.cli", "fleet", str(place), "--pattern", PATTERN, "--out", str(out)]
    begin, before = time.perf_counter(), _child_time()
    subprocess.run([*command, *options], check=True, capture_output=True)  # noqa: S603 -- our own command
    taken = CommandTime(time.perf_counter() - begin, _child_time() - before)
    (data,) = re.findall(r'class="rows">(.*?)</script>', (out / "index.html").read_text("utf-8"), re.DOTALL)
    return taken, [row[0] for row in json.loads(data)["rows"]]


def wrong_rows(order: list[str]) -> int:
    """Return how many of the top rows are healthy actuators."""
    sick = {name for name in order if is_sick(int(name[1:]))}
    return len(sick - set(order[: len(sick)]))


def main(arguments: list[str]) -> int:
    """Print the figures with their targets; return the count of misses."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--actuators", type=int, default=200)
    parser.add_argument("--logs", type=int, default=60)
    parser.add_argument("--raw-logs", type=int, default=480)
    options = parser.parse_args(arguments)
    misses.clear()
    course = severity_courses(options.actuators, options.logs)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write_store(folder / "store", course)
        fleet_of(folder / "store", folder / "warm")
        taken, order = fleet_of(folder / "store", folder / "pages")
        check_target("page from the store, pages of the 20 sickest included [s]", taken.wall, PAGE_IN)
        check_target("sound actuators among the top rows, from the store", wrong_rows(order), 0)
        if not options.raw_logs:
            print(f"processor time of the page from the store: {taken.used:.1f} s")
            return len(misses)
        count = write_logs(folder / "logs", course, options.raw_logs)
        taken, order = fleet_of(folder / "logs", folder / "from-logs")
        pages, _ = fleet_of(folder / "logs", folder / "from-logs")
        print(f"{count} raw logs: {taken.wall:.0f} s, {pages.wall:.0f} s of it for the pages")
        whole, used = taken
        if count < course.size:
            few = write_logs(folder / "few", course, count // 4)
            start = _time_difference(
                fleet_of(folder / "few", folder / "from-few")[0], fleet_of(folder / "few", folder / "from-few")[0]
            )
            wall, processor = (one / (count - few) for one in _time_difference(_time_difference(taken, pages), start))
            print(f"a log: {wall:.3f} s, {processor:.3f} s of processor time, the start of the processes apart")
            whole, used = (
                all_of + one * (course.size - count) for all_of, one in zip(taken, (wall, processor), strict=True)
            )
        said = "measured" if count == course.size else "reckoned from these"
        check_target(f"all {course.size} raw logs, {said} [s]", whole, WHOLE_IN)
        print(f"their processor time on two processors that have nothing else to do: {used / 2.0:.0f} s")
        check_target("sound actuators among the top rows, from raw logs", wrong_rows(order), 0)
    return len(misses)
