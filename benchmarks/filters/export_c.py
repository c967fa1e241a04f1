"""Exported C against the Python kernels: agreement in nine conditions, cost of a step, error of float, jitter.

Every filter runs over 100,000 samples. Costs are CPU times: medians over rounds in which C and Python's kernel
alternate. The real-time part wakes every 0.1 ms, first alone and then with other processes that keep every core busy.
"""

import argparse
import multiprocessing
import os
import platform
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from math import inf
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.filters.filter_speed import cost, filter_problems
from benchmarks.peers.c_filter import FUSED_FLAGS, CFilter, build_filter
from benchmarks.targets import Check, keep_figure
from estimation.engine.contract import FilterProblem
from estimation.export.task import EXPORTED_FORMS, filter_task
from estimation.filters.methods import METHODS
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, REDUCED, simulate
from plant.sensors.sensors import BENCH

SAMPLES, SAMPLE_TIME, ROUNDS = 100_000, 1e-4, 9
WANTED = {"agreement": 1e-12, "acceleration": 25.0, "pressure": 60.0}
GCC_FLAGS = (
    "-fno-math-errno",
    "-mtune=generic",
    "-fno-guess-branch-probability",
    "-fno-if-conversion",
    "-fno-if-conversion2",
)
BUILDS = {
    "gcc": ("gcc", ("-march=native", *GCC_FLAGS, "-fno-tree-slp-vectorize")),
    "gcc, choices": ("gcc", FUSED_FLAGS),
    "gcc, no fma": ("gcc", ()),
    "gcc, contracting": ("gcc", ("-std=gnu17", "-march=native")),
    "clang": ("clang", ("-march=native", "-fno-math-errno", "-fno-slp-vectorize")),
    "clang, no fma": ("clang", ()),
}
"""Compilers with their flags in addition to ``-std=c99 -O2``: as in the Makefile, with branch-free choices by the
compiler, for any x86-64 processor, and with the compiler's own contraction of multiply-adds allowed."""

COMPARED_BUILDS = ("gcc", "gcc, choices", "gcc, no fma", "gcc, contracting", "clang", "clang, no fma")
"""Builds compared with Python in every form and condition."""

BINS = (50, 100, 200, 300, 500, 1000, 2000, 5000, 10_000, 100_000, 1_000_000, 10_000_000)
"""Edges of the histogram of step times [ns]."""


def filter_problem(form: str, condition: str, samples: int) -> FilterProblem:
    """Return a filter with the condition's leakage and friction, on a log of the plant that it models.

    Parameters
    ----------
    samples : int
        Length of the log [samples].
    """
    p = parameters_for(CONDITIONS[condition], EhaParameters())
    plant = REDUCED if form == "acceleration" else LUMPED
    drive = sine(samples * SAMPLE_TIME, SAMPLE_TIME, p.rated_speed, 5.0)
    record = simulate(plant, drive, SAMPLE_TIME, p, sensors=BENCH, rng=np.random.default_rng(1))
    return filter_task(record, p, form, start=1e8)


def difference(c: CFilter, method: str) -> tuple[float, Array]:
    """Return the difference between C and Python.

    Returns
    -------
    tuple of (float, ndarray of shape (states,))
        Largest difference of any state at any sample, relative to the largest magnitude of that state; and the same for
        each state.
    """
    problem = replace(c.problem, every=1)
    trace = METHODS[method](problem)
    mean, _ = problem.model.to_si(trace.track)
    values, *_ = c.run()
    each = np.max(np.abs(values - mean), axis=0) / np.max(np.abs(mean), axis=0)
    return float(np.max(each)), each


def agreement(folder: Path, samples: int) -> Iterator[tuple[str, str, str, float]]:
    """Yield form, method, condition, and the worst difference over the compilers and of float."""
    for form in EXPORTED_FORMS:
        for condition in CONDITIONS:
            problem = filter_problem(form, condition, samples)
            for method in ("ekf", "imm") if form == "pressure" else ("ekf",):
                for name in COMPARED_BUILDS:
                    compiler, flags = BUILDS[name]
                    where = folder / f"{form}_{method}_{condition}_{name}".replace(", ", "_").replace(" ", "_")
                    c = build_filter(problem, method, where, compiler=compiler, flags=flags)
                    yield form, f"{method}, {name}", condition, difference(c, method)[0]
                where = folder / f"{form}_{method}_{condition}_float"
                yield (
                    form,
                    f"{method}, float",
                    condition,
                    difference(build_filter(problem, method, where, precision="float"), method)[0],
                )


def costs(folder: Path, form: str) -> dict[str, float]:
    """Return median CPU nanoseconds per step: Python's kernel, and C for each compiler."""
    problem = filter_problems(form, 1, SAMPLES)[0]
    libraries = {
        name: build_filter(problem, "ekf", folder / f"cost_{form}_{i}", compiler=compiler, flags=flags)
        for i, (name, (compiler, flags)) in enumerate(BUILDS.items())
    }
    libraries["gcc, float"] = build_filter(problem, "ekf", folder / f"cost_{form}_float", precision="float")
    rounds: dict[str, list[float]] = {}
    for _ in range(ROUNDS + 1):
        rounds.setdefault("Python's kernel", []).append(cost(lambda: METHODS["ekf"](problem), SAMPLES))
        for name, library in libraries.items():
            rounds.setdefault(name, []).append(cost(library.filter_without_results, SAMPLES))
    return {name: median(values[1:]) for name, values in rounds.items()}


def _busy() -> None:
    while True:
        sum(range(10_000))


def histogram(c: CFilter, *, loaded: bool) -> tuple[Array, Array]:
    """Return lateness and duration of every step at 10 kHz [ns], shape (samples,) each."""
    count = os.cpu_count() or 1
    workers = [multiprocessing.Process(target=_busy, daemon=True) for _ in range(count if loaded else 0)]
    for worker in workers:
        worker.start()
    late, times = c.paced(round(1e9 * SAMPLE_TIME))
    for worker in workers:
        worker.terminate()
        worker.join()
    return late.astype(float), times.astype(float)


def show_real_time(folder: Path) -> None:
    """Print the histogram of the pressure form's steps at 10 kHz, alone and under load."""
    c = build_filter(filter_problems("pressure", 1, SAMPLES)[0], "ekf", folder / "real_time")
    steps = {
        "back to back": c.clocked().astype(float),
        "at 10 kHz": histogram(c, loaded=False),
        "at 10 kHz, all cores busy": histogram(c, loaded=True),
    }
    print(f"\nsteps of the pressure form, {SAMPLES} each [ns]; {platform.machine()}, {os.cpu_count()} cores")
    for name, found in steps.items():
        late, times = found if isinstance(found, tuple) else (None, found)
        marks = [f"{np.percentile(times, share):.0f}" for share in (50.0, 99.0, 99.9, 99.99)]
        print(f"{name}: median, 99, 99.9, 99.99 %: {', '.join(marks)}; worst {np.max(times):.0f}")
        counts = np.histogram(times, bins=(0, *BINS))[0]
        print("  " + ", ".join(f"to {edge}: {count}" for edge, count in zip(BINS, counts, strict=True) if count))
        if late is not None:
            marks = [f"{1e-3 * np.percentile(late, share):.0f}" for share in (50.0, 99.0, 99.9)]
            missed = int(np.sum(late + times > 1e9 * SAMPLE_TIME))
            print(
                f"  woken late by {', '.join(marks)} us (median, 99, 99.9 %), worst {1e-3 * np.max(late):.0f} us;"
                f" {missed} steps ended after the next was due"
            )


def main(arguments: list[str]) -> int:
    """Print all; return how many targets are missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--only", choices=("agreement", "cost", "real-time"))
    options = parser.parse_args(arguments)
    missed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.only in (None, "agreement"):
            worst: dict[tuple[str, str], tuple[float, str]] = {}
            for form, build, condition, found in agreement(folder, options.samples):
                worst[form, build] = max(worst.get((form, build), (0.0, condition)), (found, condition))
            for (form, build), (found, condition) in worst.items():
                bound = inf if "float" in build else WANTED["agreement"]
                met = keep_figure(Check(f"{form}, {build}: largest relative difference", found, most=bound)).met
                missed += not met
                print(f"{form:14s}{build:20s}{found:10.1e}  worst in {condition}{'' if met else '  MISSED'}")
        if options.only in (None, "cost"):
            for form in ("acceleration", "pressure"):
                found = costs(folder, form)
                kernel = found["Python's kernel"]
                for build, value in found.items():
                    print(f"{form:14s}{build:20s}{value:8.1f} ns a step, {value / kernel:5.2f} of Python's kernel")
                quicker = min(found["gcc"], found["clang"])
                met = keep_figure(Check(f"{form}: a step, the quicker compiler [ns]", quicker, most=WANTED[form])).met
                missed += not met
                print(f"{form:14s}wanted: at most {WANTED[form]:g} ns{'' if met else '  MISSED'}", file=sys.stderr)
        if options.only in (None, "real-time"):
            show_real_time(folder)
    return missed
