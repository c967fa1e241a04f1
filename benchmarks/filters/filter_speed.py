"""Cost of one filter step: compiled filters, alone and in lanes, compared with the same filter in other tools.

All peers are measured in the same run, interleaved with ours, by CPU time, as medians over the rounds. "Lanes" is the
verb, from separate logs to separate results. "Lanes, kernel" gets logs that are already side by side, as the C++ kernel
and JAX do, so their ratios refer to it. filterpy is written as its users write it (`benchmarks.peers.filterpy_user`),
C++ and JAX as an expert would (`ekf_simd.cpp`, `jax_lanes.py`); C++ is built in several ways, and the fastest counts.
"Bridge" is filterpy with our compiled model. JAX has one thread and runs in the environment given by ``--jax`` (a
Python that imports jax), since it is no dependency of this project. ``--processor avx2`` compiles ours and C++ for a
processor with AVX2 and without AVX-512. The arithmetic floor is the time for a step's operations at the rate of fused
multiply-adds measured on a core in the same run. A fused operation counts once; divisions, loads and stores are free.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from ctypes import CDLL
from dataclasses import astuple, replace
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.peers import cpp_lanes, filterpy_user
from benchmarks.peers.acceleration_form import coefficients
from benchmarks.targets import Check, print_and_keep
from estimation.engine.contract import FilterProblem
from estimation.engine.kernels import LANES, compile_kernel
from estimation.engine.layout import full_sample_update, halves_of, layout, step_at_sample, with_missing_counted
from estimation.engine.runner import aligned_array, constant_row
from estimation.filters.batch import filter_batch
from estimation.filters.ekf import EKF, ekf
from estimation.filters.filterpy_bridge import filterpy_ekf
from estimation.filters.run import filter_problem
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import ACCELERATION_FORM, FORMS
from plant.arrays import Array
from plant.compiled.expression import ordered
from plant.compiled.native import machine
from plant.compiled.simplify import FUSED
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import REDUCED, simulate
from plant.sensors.sensors import BENCH

CHANNELS = ("position_m", "velocity_m_s")
VARIANCES = {"position_m": 1e-12, "velocity_m_s": 1e-6}
SAMPLE_TIME = 1e-4
ROUNDS = 7
WANTED = {
    "floor, %": 50.0,
    "lanes ns": 13.0,
    "of C++": 1.6,
    "filterpy": 3500.0,
    "JAX": 5.0,
    "one ns": 35.0,
    "pressure filterpy": 2000.0,
    "pressure bridge": 1000.0,
}
SAME_STATES = 1e-4
"""Largest relative difference between states that count as equal: the peer's Jacobian uses finite differences
[fraction]."""

CPP = "C++ SIMD, "
"""Prefix of the names of C++ builds."""


def cost(work: Callable[[], object], steps: int) -> float:
    """Return CPU nanoseconds per filter step."""
    begin = time.process_time_ns()
    work()
    return (time.process_time_ns() - begin) / steps


def filter_problems(form: str, count: int, samples: int) -> list[FilterProblem]:
    """Return filters on one run of the reduced plant, each with its own noise."""
    p, rng = EhaParameters(), np.random.default_rng(1)
    drive = make_drive("sine", samples * SAMPLE_TIME, SAMPLE_TIME, p, rng)
    record = simulate(REDUCED, drive, SAMPLE_TIME, p, sensors=BENCH, rng=rng)
    first = filter_problem(
        FORMS[form], first_belief(FORMS[form], record, 1e8, 3e8), record, p, channels=CHANNELS, variances=VARIANCES
    )
    noise = np.sqrt([VARIANCES[channel] for channel in CHANNELS])
    return [
        replace(
            first,
            drives=first.drives.copy(),
            measured=first.measured + noise * rng.normal(size=first.measured.shape),
            every=len(first.measured),
        )
        for _ in range(count)
    ]


def scaled(problem: FilterProblem) -> tuple[tuple[float, float, float], Array, Array, Array]:
    """Return steps, process noise, variances and measurements in the scaled units of the hand-written peers."""
    scale = np.array([state.scale for state in ACCELERATION_FORM.states])
    T = problem.sample_time
    steps = (T, T * scale[1] / scale[0], T * scale[2] / scale[1])
    return steps, problem.noise * T, problem.variances / scale[:2] ** 2, problem.measured / scale[:2]


def kernel_work(batch: list[FilterProblem]) -> Callable[[], None]:
    """Return the work of our kernel alone, on logs that are already side by side, as for the C++ kernel."""
    places, first = layout(EKF, batch[0].model, batch[0].channels), batch[0]
    kernel = compile_kernel(EKF, first.model, first.channels, LANES, separate=False)
    blocks = [batch[i : i + LANES] for i in range(0, len(batch), LANES)]
    data: list[tuple[Array, Array]] = []
    for block in blocks:
        full = [*block, *[block[0]] * (LANES - len(block))]
        data.append((_lanes([one.drives for one in full]), _lanes([one.measured for one in full])))
    begin = np.concatenate([places.start(first.mean, first.covariance), constant_row(first, {})])
    works = [aligned_array(kernel.LINES, LANES) for _ in blocks]
    track, logs = np.empty((1, first.model.width, LANES)), np.zeros((len(first.channels), LANES))
    count, nothing = len(first.measured), np.empty((0, 0))

    def run() -> None:
        for work, (drives, measured) in zip(works, data, strict=True):
            work[: len(begin)] = begin[:, None]
            where = (drives.ctypes.data, measured.ctypes.data, 0, 0, count, first.substeps, first.every)
            kernel.steps(work.ravel(), *where, (track, np.empty_like(track), logs, nothing, nothing))

    return run


def cpp_work(batch: list[FilterProblem], library: CDLL) -> Callable[[], None]:
    """Return the work of a build of the C++ kernel on all filters."""
    steps, noise, variances, _ = scaled(batch[0])
    blocks = [batch[i : i + LANES] for i in range(0, len(batch), LANES)]
    data: list[tuple[Array, Array]] = []
    for block in blocks:
        full = [*block, *[block[0]] * (LANES - len(block))]
        data.append((_lanes([one.drives[:, 0] for one in full]), _lanes([scaled(one)[3] for one in full])))
    first = np.zeros((16, LANES))
    first[:4], first[4:14] = batch[0].mean[:, None], batch[0].covariance[np.triu_indices(4)][:, None]
    state = first.copy()

    def work() -> None:
        for speed, measured in data:
            state[:] = first
            cpp_lanes.run(library, steps, coefficients(EhaParameters()), noise, variances, speed, measured, state)

    return work


def _lanes(arrays: list[Array]) -> Array:
    return np.ascontiguousarray(np.stack(arrays, axis=-1))


def jax_costs(python: str, batch: list[FilterProblem], rounds: int) -> tuple[list[float], Array]:
    """Return JAX's CPU nanoseconds in every round, and its final means."""
    steps, noise, variances, _ = scaled(batch[0])
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "in.npz", Path(folder) / "out.npy"
        np.savez(
            source,
            steps=[steps[1], steps[2], steps[0]],
            coefficients=astuple(coefficients(EhaParameters())),
            noise=noise,
            variances=variances,
            mean=_lanes([one.mean for one in batch]),
            covariance=batch[0].covariance,
            speed=_lanes([one.drives[:, 0] for one in batch]),
            measured=_lanes([scaled(one)[3] for one in batch]),
        )
        script = str(Path(__file__).parents[1] / "peers" / "jax_lanes.py")
        # one thread, as for every other engine here: XLA's thread pool would spend processor time on waiting
        alone = {
            "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
            "OMP_NUM_THREADS": "1",
        }
        done = subprocess.run(  # noqa: S603  the user names the interpreter, the script is ours
            [python, script, str(source), str(target), str(rounds)],
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, **alone},
        )
        return [float(line) for line in done.stdout.split()], np.load(target)


def filterpy_work(problem: FilterProblem) -> Callable[[], None]:
    """Return filterpy's work on one log."""
    speed, measured = problem.drives[:, 0], problem.measured

    def work() -> None:
        kalman = filterpy_user.AccelerationFilter(EhaParameters(), problem.sample_time)
        unit = np.array([state.scale for state in ACCELERATION_FORM.states])
        unit[3] = 1.0
        kalman.x, kalman.P = problem.mean * unit, problem.covariance * np.outer(unit, unit)
        kalman.Q = np.diag(problem.noise * problem.sample_time * unit**2)
        kalman.R = np.diag(problem.variances)
        filterpy_user.run(kalman, speed, measured)

    return work


def filterpy_pressure(problem: FilterProblem) -> tuple[Callable[[], None], Array]:
    """Return the work of a user's own loop on the pressure form, and its final mean."""
    scale = np.array([state.scale for state in problem.model.states])
    speed, measured = problem.drives[:, 0], problem.measured / scale[:2]
    ended = np.empty(4)

    def work() -> None:
        kalman = filterpy_user.PressureFilter(EhaParameters(), problem.sample_time, scale)
        kalman.x, kalman.P = problem.mean.copy(), problem.covariance.copy()
        kalman.Q = np.diag(problem.noise * problem.sample_time)
        kalman.R = np.diag(problem.variances / scale[:2] ** 2)
        filterpy_user.run_pressure(kalman, speed, measured)
        ended[:] = kalman.x

    return work, ended


def acceleration_table(count: int, samples: int, jax: str | None, processor: str) -> Iterator[tuple[str, float]]:
    """Yield each engine's median cost on the acceleration form; the first is ours in lanes."""
    batch = filter_problems("acceleration", count, samples)
    short = replace(batch[0], drives=batch[0].drives[:1000], measured=batch[0].measured[:1000])
    long = filter_problems("acceleration", 1, 100_000)[0]
    kernel, slow = kernel_work(batch), filterpy_work(short)
    cpp = {f"{CPP}{name}": cpp_work(batch, library) for name, library in cpp_lanes.builds(processor).items()}
    rounds: dict[str, list[float]] = {}
    for _ in range(ROUNDS + 1):
        rounds.setdefault("lanes", []).append(cost(lambda: list(filter_batch(batch)), count * samples))
        rounds.setdefault("lanes, kernel", []).append(cost(kernel, -(-count // LANES) * LANES * samples))
        for name, work in cpp.items():
            rounds.setdefault(name, []).append(cost(work, -(-count // LANES) * LANES * samples))
        rounds.setdefault("one filter", []).append(cost(lambda: ekf(long), len(long.measured)))
        rounds.setdefault("filterpy", []).append(cost(slow, 1000))
        if jax is not None:
            rounds.setdefault("JAX", []).extend(jax_costs(jax, batch, 1)[0])
    for name, values in rounds.items():
        yield name, median(values[1:])


def pressure_table(count: int, samples: int) -> Iterator[tuple[str, float]]:
    """Yield each engine's median cost on the pressure form; the bridge gives filterpy our compiled model."""
    batch = filter_problems("pressure", count, samples)
    short = replace(batch[0], drives=batch[0].drives[:1000], measured=batch[0].measured[:1000], every=1)
    long = filter_problems("pressure", 1, 100_000)[0]
    by_hand, ended = filterpy_pressure(short)
    rounds: dict[str, list[float]] = {}
    for _ in range(ROUNDS + 1):
        rounds.setdefault("lanes", []).append(cost(lambda: list(filter_batch(batch)), count * samples))
        rounds.setdefault("one filter", []).append(cost(lambda: ekf(long), len(long.measured)))
        rounds.setdefault("filterpy", []).append(cost(by_hand, 1000))
        rounds.setdefault("bridge", []).append(cost(lambda: filterpy_ekf(short), 1000))
    apart = np.max(np.abs(ended - ekf(short).track[-1]) / np.abs(ended))
    if apart > SAME_STATES:
        raise SystemExit(f"filterpy by hand and our filter are {apart:.1g} apart on the pressure form")
    for name, values in rounds.items():
        yield name, median(values[1:])


def operations() -> int:
    """Return the number of arithmetic instructions of a filter step in lanes, acceleration form, no sample missing."""
    halves = halves_of(EKF, ACCELERATION_FORM, CHANNELS)
    update = full_sample_update(with_missing_counted(halves.update))
    kept = layout(EKF, ACCELERATION_FORM, CHANNELS).carried
    outputs = [*step_at_sample(halves.predict).values(), *(value for name, value in update.items() if name in kept)]
    return sum(item.operation in FUSED or item.operation in "+-*/" for item in ordered(outputs))


def only_avx2() -> None:
    """Compile our kernels for a processor with AVX2 and without AVX-512, into a separate cache."""
    llvm = machine.binding()
    features = llvm.get_host_cpu_features()
    for name in features:
        features[name] &= not name.startswith(("avx512", "avx10", "amx", "evex512"))
    llvm.get_host_cpu_features = lambda: features
    llvm.get_host_cpu_name = lambda: cpp_lanes.PROCESSORS["avx2"]


def main(arguments: list[str]) -> int:
    """Print both tables and every ratio; return how many targets are missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--filters", type=int, default=1000)
    parser.add_argument("--samples", type=int, default=20_000)
    parser.add_argument("--jax", help="a Python that imports jax")
    parser.add_argument("--processor", choices=cpp_lanes.PROCESSORS, default="own")
    options = parser.parse_args(arguments)
    if options.processor == "avx2":
        only_avx2()
    found = dict(acceleration_table(options.filters, options.samples, options.jax, options.processor))
    pressure = dict(pressure_table(options.filters, options.samples))
    print(f"{'engine':24s}{'acceleration ns':>18s}{'pressure ns':>14s}")
    for name in (*found, "bridge"):
        print(f"{name:24s}{found.get(name, float('nan')):18.1f}{pressure.get(name, float('nan')):14.1f}")
    peak, cpp = (
        cpp_lanes.peak_arithmetic(options.processor),
        [cost for name, cost in found.items() if name.startswith(CPP)],
    )
    floor = None if peak is None else 1e9 * operations() / (peak / 2.0)
    if floor is not None:
        print(f"{operations()} arithmetic instructions a step: floor {floor:.1f} ns")
    measured = {
        "floor, %": None if floor is None else 100.0 * floor / found["lanes, kernel"],
        "lanes ns": found["lanes"],
        "of C++": found["lanes, kernel"] / min(cpp) if cpp else None,
        "filterpy": found["filterpy"] / found["lanes"],
        "JAX": found["JAX"] / found["lanes, kernel"] if "JAX" in found else None,
        "one ns": found["one filter"],
        "pressure filterpy": pressure["filterpy"] / pressure["lanes"],
        "pressure bridge": pressure["bridge"] / pressure["lanes"],
    }
    missed = 0
    for name, wanted in WANTED.items():
        value, most = measured[name], name in ("lanes ns", "of C++", "one ns")
        if value is None:
            print(f"{name:20s} not measured: no compiler, or no --jax", file=sys.stderr)
            continue
        [check] = print_and_keep([Check(name, value, most=wanted) if most else Check(name, value, least=wanted)])
        missed += not check.met
    return missed
