"""A study of 100,000 EKF runs of 10,000 steps, kept in a store: cost over the bare kernels, memory, cost by size.

Four conditions; all seeds of a condition share its motion, and ten first guesses share a series. The bare run does the
same simulation, noise and filters in a loop, without keys, rows, tasks or store, on both workers at once as in the
study. Start-up of the workers, including imports and finding kernels, is measured by the difference between a first and
a second small study, and counts as overhead. CPU time counts all processes; wall time is printed too. Needs Linux's
/proc.
"""

import argparse
import multiprocessing
import os
import statistics
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np

from estimation.engine.contract import FilterProblem
from estimation.filters.batch import filter_batch
from estimation.filters.run import filter_problem
from estimation.log_checks.first_belief import START_STD, first_belief
from estimation.models.eha_forms import ACCELERATION_FORM, BULK_MODULUS
from experiments.batch.cases import Plan, plan_study
from experiments.batch.part_store import open_store
from experiments.batch.runner import manifest_of, run_batch
from experiments.batch.study_file import parse_study
from experiments.batch.work import TRACK_ROWS
from experiments.running.executors import open_executor
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.simulate import REDUCED, simulate
from plant.sensors.sensors import BENCH, measure

STARTS = tuple(0.5e8 * k for k in range(10))
SAMPLE_TIME = 1e-4
CHANNELS = ("position_m", "velocity_m_s")
VARIANCES = {"position_m": 1e-12, "velocity_m_s": 1e-6}
NAMES = ("normal", "major_leakage", "major_friction", "major_leakage_major_friction")
WANTED_OVERHEAD, WANTED_BYTES, WANTED_RATIO = 0.20, 2e9, 1.3
MACHINES = (1, 10, 100)
NIGHT_CASES, CASE_SECONDS = 1_000_000, (2.5e-4, 2.5e-3, 2.5e-2)


def plan_of(cases: int, samples: int) -> Plan:
    """Return a study of the given number of cases, in four conditions."""
    seeds = cases // (len(NAMES) * len(STARTS))
    runs = {
        "plants": ["reduced"],
        "drives": ["sine"],
        "conditions": list(NAMES),
        "seeds": seeds,
        "starts_pa": list(STARTS),
        "duration_s": samples * SAMPLE_TIME,
        "sample_time_s": SAMPLE_TIME,
        "methods": [{"verb": "filter", "form": "acceleration", "method": "ekf"}],
    }
    return plan_study(parse_study({"name": "scale", "runs": [runs]}, "scale"), Path())


def bare_filters(cases: int, samples: int) -> float:
    """Run the same filters on the same kind of series without any overhead; return CPU seconds [s]."""
    begin = time.process_time()
    values = [float(trace.track[-1, 3]) for trace in filter_batch(_problems(cases, samples))]
    assert len(values) == cases  # noqa: S101 -- a benchmark of nothing would be fast
    return time.process_time() - begin


def _problems(cases: int, samples: int) -> Iterator[FilterProblem]:
    place = ACCELERATION_FORM.index(BULK_MODULUS)
    for number, name in enumerate(NAMES):
        p = parameters_for(CONDITIONS[name])
        speed = make_drive("sine", samples * SAMPLE_TIME, SAMPLE_TIME, p, np.random.default_rng(1))
        truth = simulate(REDUCED, speed, SAMPLE_TIME, p)
        for seed in range(cases // (len(NAMES) * len(STARTS))):
            record = measure(truth, BENCH, np.random.default_rng([seed, number]))
            prior = first_belief(ACCELERATION_FORM, record, 1e8, START_STD)
            first = filter_problem(ACCELERATION_FORM, prior, record, p, channels=CHANNELS, variances=VARIANCES)
            for start in STARTS:
                mean = first.mean.copy()
                mean[place] = start / ACCELERATION_FORM.states[place].scale
                yield replace(first, mean=mean, every=max(1, samples // TRACK_ROWS))


class Memory:
    """Monitors the total memory of this process and its children; shared pages count once for each process."""

    def __init__(self) -> None:
        self.peak = self.now = 0.0
        self.at: list[tuple[int, float]] = []
        self._done = Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "Memory":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._done.wait(0.5):
            self.now = float(sum(int(stat[21]) for stat in _processes()) * os.sysconf("SC_PAGE_SIZE"))
            self.peak = max(self.peak, self.now)


def study(cases: int, samples: int, executor: Executor, width: int) -> tuple[float, float, Memory]:
    """Run a study into a store; return CPU seconds of all processes, wall seconds, and memory during the run."""
    with tempfile.TemporaryDirectory() as folder, Memory() as memory:
        begin, wall = cpu_seconds(), time.perf_counter()
        plan, store = plan_of(cases, samples), open_store(Path(folder) / "store")
        with store.writing():
            done, _ = store.done()
            store.describe(manifest_of(plan, "scale"), plan.keys)
            seen = [0]

            def look(count: int, part: object) -> None:
                del part
                seen[0] += count
                memory.at.append((seen[0], memory.now))

            run_batch(plan, store, done, lambda: nullcontext((executor, width)), stop=Event(), on_part=look)
        spent = cpu_seconds() - begin, time.perf_counter() - wall
        rows = store.rows(["outcome"])
        assert rows["outcome"].to_pylist() == ["ok"] * cases  # noqa: S101 -- as above
    return (*spent, memory)


def cpu_seconds() -> float:
    """Return the CPU time that this process and its children have used [s]."""
    return sum(int(stat[11]) + int(stat[12]) for stat in _processes()) / os.sysconf("SC_CLK_TCK")


def _processes() -> list[list[str]]:
    """Return Linux's status fields of this process and its children, from the state on."""
    numbers = [os.getpid(), *(child.pid for child in multiprocessing.active_children())]
    return [Path(f"/proc/{number}/stat").read_text().rsplit(")", 1)[1].split() for number in numbers]


def bare_in_parallel(executor: Executor, width: int, cases: int, samples: int) -> float:
    """Return the CPU seconds of a bare case, with every worker busy at once as in a study."""
    futures = [executor.submit(bare_filters, cases, samples) for _ in range(width)]
    return statistics.mean(future.result() for future in futures) / cases


def dispatch_seconds(executor: Executor, width: int, tasks: int) -> float:
    """Return the seconds that the dispatching side needs for one empty task, run as in a batch."""
    flying: set[Future[bytes]] = set()
    begin = time.perf_counter()
    for _ in range(tasks):
        flying.add(executor.submit(bytes, 2000))
        if len(flying) >= 2 * width:
            _, flying = wait(flying, return_when=FIRST_COMPLETED)
    wait(flying)
    return (time.perf_counter() - begin) / tasks


def extrapolate(per_task: float, writing: float, cores: int) -> None:
    """Print the time on many machines if only the measured overhead limited them."""
    print(f"\nExtrapolation, not measured: {NIGHT_CASES:,} cases on machines of {cores} cores.")
    held = f"one scheduler, {1e3 * per_task:.2f} ms a task, and one writer, {1e3 * writing:.2f} ms a part"
    print(f"Held up by {held} (both measured).")
    print("A task is as many cases as take 2 s, at most 2048. Networks, stragglers and shared disks are left out.")
    print(f"{'a case takes':>14} " + " ".join(f"{f'{count} machine' + 's' * (count > 1):>22}" for count in MACHINES))
    for seconds in CASE_SECONDS:
        tasks = NIGHT_CASES / min(2048.0, 2.0 / seconds)
        cells: list[str] = []
        for count in MACHINES:
            work, held = NIGHT_CASES * seconds / (cores * count), tasks * (per_task + writing)
            total = max(work, held)
            cells.append(f"{total:10.1f} s, {100.0 * work / total:3.0f} % busy")
        print(f"{1e3 * seconds:11.2f} ms " + " ".join(f"{cell:>22}" for cell in cells))


def main(arguments: list[str]) -> int:
    """Print cost, memory and the extrapolation; return how many targets are missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=100_000)
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    each: dict[int, float] = {}
    idle = cpu_seconds()
    with open_executor(options.workers) as (executor, width):
        warm = 4 * len(NAMES) * len(STARTS)
        study(warm, options.samples, executor, width)
        begun = cpu_seconds() - idle
        begun -= study(warm, options.samples, executor, width)[0]
        bare_in_parallel(executor, width, warm, options.samples)
        bares: list[float] = []
        for size in sorted({size for size in (1_000, 10_000, options.cases) if size <= options.cases}):
            size -= size % (len(NAMES) * len(STARTS))
            repeats = max(1, min(5, 20_000 // size))
            bares.append(bare_in_parallel(executor, width, 4000, options.samples))
            runs = [study(size, options.samples, executor, width) for _ in range(repeats)]
            bares.append(bare_in_parallel(executor, width, 4000, options.samples))
            cpu, wall = (statistics.median(run[place] for run in runs) for place in (0, 1))
            each[size], memory = cpu / size, runs[-1][2]
            print(
                f"{size:7,} runs of {options.samples:,} steps: {cpu:.1f} s CPU, {wall:.1f} s wall, "
                f"{1e6 * each[size]:.0f} us CPU a case; peak memory {memory.peak / 1e6:.0f} MB"
            )
        dispatch_seconds(executor, width, 20)
        per_task = dispatch_seconds(executor, width, 500)
    kernel = statistics.median(bares)
    overhead, ratio = (each[max(each)] + begun / max(each)) / kernel - 1.0, max(each.values()) / min(each.values())
    at = memory.at
    early, late = (statistics.median(held for _, held in part) for part in (at[: len(at) // 4], at[-len(at) // 4 :]))
    print(f"bare: {1e6 * kernel:.0f} us CPU a case (each of {', '.join(f'{1e6 * one:.0f}' for one in bares)})")
    print(f"workers and project begin in {begun:.1f} s CPU, {100.0 * begun / max(each) / kernel:.1f} % of the bare run")
    print(
        f"overhead over the bare run, with it: {100.0 * overhead:.0f} % (wanted: under {100.0 * WANTED_OVERHEAD:.0f} %)"
    )
    print(f"cost a case, dearest over cheapest size: {ratio:.2f} (wanted: within {WANTED_RATIO})")
    print(f"memory in the first and last quarter: {early / 1e6:.0f} and {late / 1e6:.0f} MB")
    print(f"memory at its peak: {memory.peak / 1e6:.0f} MB (wanted: flat, under {WANTED_BYTES / 1e6:.0f} MB)")
    extrapolate(max(per_task, _dask_dispatch()), _write_seconds(), options.workers)
    return int(overhead >= WANTED_OVERHEAD) + int(ratio > WANTED_RATIO) + int(memory.peak >= WANTED_BYTES)


def _dask_dispatch() -> float:
    """Return the scheduling time of Dask for one task, zero if it is not installed."""
    try:
        from distributed import LocalCluster
    except ImportError:
        print("Dask is not installed: the processes' own queue stands for its scheduler")
        return 0.0
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        open_executor(cluster=cluster.scheduler_address) as (executor, width),
    ):
        dispatch_seconds(executor, width, 20)
        return dispatch_seconds(executor, width, 500)


def _write_seconds() -> float:
    """Return the seconds for storing a part of 2048 rows."""
    with tempfile.TemporaryDirectory() as folder:
        store, content = open_store(Path(folder) / "store"), os.urandom(200_000)
        begin = time.perf_counter()
        for number in range(20):
            store.add(content, [str(number)])
        return (time.perf_counter() - begin) / 20.0
