"""Time of a verb on a single log: on the first run ever, and on later runs.

Each run is a process of its own, as a user starts it; the first run has an empty kernel cache.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.targets import check_target, misses
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.files import write_record
from plant.sensors.sensors import BENCH

VERBS = ("estimate", "diagnose", "identify")
MOST_FIRST_RUN = {"estimate": 4.0, "diagnose": 6.0, "identify": 6.0}
"""Maximum CPU time of a first run [s]."""

MOST_LATER_RUN = {"estimate": 1.0, "diagnose": 1.3, "identify": 1.2}
"""Maximum wall time of a later run on a log at 1 kHz [s]."""

MOST_LATER_RUN_10_KHZ = 2.0
"""Maximum wall time of a later run on a log at 10 kHz [s]."""

REPEATS = 3


def log_at(folder: Path, rate: float, seconds: float) -> Path:
    """Write a log of the lumped plant."""
    p, rng, path = EhaParameters(), np.random.default_rng(1), folder / f"log_{rate:g}_hz.csv"
    drive = make_drive("multisine", seconds, 1.0 / rate, p, rng)
    write_record(simulate(LUMPED, drive, 1.0 / rate, p, sensors=BENCH, rng=rng), path)
    return path


def timed(verb: str, log: Path, cache: Path) -> tuple[float, float]:
    """Return CPU and wall time of one process [s]."""
    environment = {**os.environ, "HYDROSTATE_CACHE": str(cache)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # this variable alone costs 0.4 s
    command = [sys.executable, "-m", "experiments.cli", verb, str(log), "--json"]
    begin = time.perf_counter()
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # noqa: S603  our own
    _, status, used = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) != 0:
        raise RuntimeError(f"{' '.join(command)} failed")
    return used.ru_utime + used.ru_stime, time.perf_counter() - begin


def main(argv: Sequence[str]) -> int:
    """Print CPU and wall time of the verbs."""
    parser = argparse.ArgumentParser(prog="start_up", description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="length of the logs [s]")
    parser.add_argument("--log", type=Path, help="a log of your own in place of the simulated ones")
    chosen = parser.parse_args(argv)
    misses.clear()
    with tempfile.TemporaryDirectory() as folder:
        room = Path(folder)
        logs = [chosen.log] if chosen.log else [log_at(room, rate, chosen.seconds) for rate in (1e3, 1e4)]
        for k, log in enumerate(logs):
            for verb in VERBS:
                cache = room / f"cache_{verb}_{k}"
                cpu, wall = timed(verb, log, cache)
                later = [timed(verb, log, cache) for _ in range(REPEATS)]
                warm_cpu, warm = (min(one) for one in zip(*later, strict=True))
                print(f"{log.name:20} {verb:9} first {cpu:.2f} s CPU, {wall:.2f} s; then {warm_cpu:.2f}, {warm:.2f} s")
                check_target(f"{verb}, first, CPU [s]", cpu, MOST_FIRST_RUN[verb])
                check_target(f"{verb}, later, wall [s]", warm, MOST_LATER_RUN_10_KHZ if k else MOST_LATER_RUN[verb])
    return len(misses)
