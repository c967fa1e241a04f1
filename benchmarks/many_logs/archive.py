"""An archive of 1,000 CSV logs, three of them bad, diagnosed in one command; and how fast they are read.

Reading uses `plant.log.files`, including its checks, and alternates with pandas' plain `read_csv` on the same files.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.files import read_record, write_record
from plant.sensors.sensors import BENCH

SAMPLE_TIME = 1e-3
WANTED_SPEED = 5.0
ROUNDS = 5
UNUSABLE_LOGS = ("empty.csv", "words.csv", "short.csv")


def make_archive(folder: Path, logs: int, duration: float) -> None:
    """Write logs of all nine conditions in turn, and three unusable ones."""
    names = list(CONDITIONS)
    for number in range(logs - len(UNUSABLE_LOGS)):
        name, rng = names[number % len(names)], np.random.default_rng(number)
        p = parameters_for(CONDITIONS[name])
        speed = make_drive("steps", duration, SAMPLE_TIME, p, rng)
        record = simulate(CIRCUIT, speed, SAMPLE_TIME, p, sensors=BENCH, rng=rng).annotate(condition=name)
        write_record(record, folder / f"actuator{number // 50:02d}" / f"run{number:04d}.csv")
    good = (folder / "actuator00" / "run0000.csv").read_text(encoding="utf-8")
    header, first, *rest = good.splitlines()
    (folder / UNUSABLE_LOGS[0]).write_text("", encoding="utf-8")
    (folder / UNUSABLE_LOGS[1]).write_text(
        "\n".join([header, first, *rest[:100], "not,a,number,at,all"]), encoding="utf-8"
    )
    (folder / UNUSABLE_LOGS[2]).write_text("\n".join([header, first[: len(first) // 2]]), encoding="utf-8")


def read_rates(paths: list[Path]) -> tuple[float, float, float, float]:
    """Return the read rates of ours and of pandas in megabytes per second, by wall time, then by CPU time."""

    def ours(path: Path) -> object:
        return read_record(path)

    size = sum(path.stat().st_size for path in paths) / 1e6
    measured = {
        name: [_read_times(read, paths) for _ in range(ROUNDS)]
        for name, read in (("ours", ours), ("pandas", pd.read_csv))
    }
    wall = {name: statistics.median(one[0] for one in times) for name, times in measured.items()}
    cpu = {name: statistics.median(one[1] for one in times) for name, times in measured.items()}
    return size / wall["ours"], size / wall["pandas"], size / cpu["ours"], size / cpu["pandas"]


def _read_times(read: Callable[[Path], object], paths: list[Path]) -> tuple[float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    for path in paths:
        read(path)
    return time.perf_counter() - wall, time.process_time() - cpu


def diagnose_archive(folder: Path, workers: int) -> tuple[int, int]:
    """Diagnose the archive in one command, and print the outcome; return how many logs succeed and how many fail."""
    (folder / "study.toml").write_text(
        'name = "archive"\n[[logs]]\nglob = "archive/**/*.csv"\nmethods = [{ verb = "diagnose" }]\n', encoding="utf-8"
    )
    command = [sys.executable, "-m", "experiments.cli", "batch", str(folder / "study.toml"), "--out"]
    begin = time.perf_counter()
    done = subprocess.run(  # noqa: S603 -- our own command
        [*command, str(folder / "store"), "--workers", str(workers), "--json"],
        capture_output=True,
        text=True,
        check=False,
    )
    seconds = time.perf_counter() - begin
    (found,) = json.loads(done.stdout)
    right = pd.read_csv(folder / "store" / "tables" / "diagnosis.csv")
    correct, classes = int(right["right"].sum()), int(right["cases"].sum())
    print(f"{found['done']} logs in one command: {seconds:.1f} s with {workers} workers")
    print(f"{found['failed']} failed, {len(UNUSABLE_LOGS)} are bad; {correct} of {classes} classes right")
    print("\n".join(f"  {line}" for line in done.stderr.splitlines() if ".csv" in line))
    return found["done"], found["failed"]


def compare_with_pandas(folder: Path) -> float:
    """Print read rates of short logs and a long one; return the smallest ratio to pandas' rate by wall time."""
    logs = sorted((folder / "archive").glob("actuator*/*.csv"))[:200]
    long = folder / "long.csv"
    rows = pd.concat([pd.read_csv(logs[0])] * 50, ignore_index=True)
    rows.assign(time_s=SAMPLE_TIME * rows.index).to_csv(long, index=False, float_format="%.9g")
    ratios: list[float] = []
    for words, paths in (("archive's logs", logs), ("one long log", [long] * 5)):
        ours, theirs, our_cpu, their_cpu = read_rates(paths)
        ratios.append(ours / theirs)
        size = statistics.mean(path.stat().st_size for path in paths) / 1e6
        print(
            f"reading {words} ({size:.2f} MB each): {ours:.0f} MB/s, pandas {theirs:.0f} MB/s, "
            f"{ours / theirs:.1f} times "
            f"by wall time, {our_cpu / their_cpu:.1f} times by CPU time (wanted: {WANTED_SPEED:g})"
        )
    return min(ratios)


def main(arguments: list[str]) -> int:
    """Print the outcome of the archive and the read rates; return how many targets are missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=1000)
    parser.add_argument("--duration", type=float, default=2.0)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "archive").mkdir()
        for number in range(options.logs // 50 + 1):
            (folder / "archive" / f"actuator{number:02d}").mkdir()
        make_archive(folder / "archive", options.logs, options.duration)
        done, failed = diagnose_archive(folder, options.workers)
        speed = compare_with_pandas(folder)
    return int(failed != len(UNUSABLE_LOGS) or done != options.logs) + int(speed < WANTED_SPEED)
