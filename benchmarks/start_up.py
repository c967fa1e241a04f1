"""How long a verb takes on a single log: the first time ever, and from then on.

Each run is a process of its own, as a user starts it; cold means a kernel cache that is empty. Beside it, the largest
kernels are compiled and run by our compiler and by Numba, from the same text in the same process: what a first run cost
before, and whether the bits are the same.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.targets import misses, say
from estimation.fits import greybox_loops
from estimation.models.flow import FLOW_FORM, MASS_FLOW_FORM
from estimation.models.greybox import GreyBoxModel
from plant.compiled.source import INTRINSICS
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.files import write_record
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_row

VERBS = ("estimate", "diagnose", "identify")
FIRST = {"estimate": 4.0, "diagnose": 6.0, "identify": 6.0}
"""CPU of a first run, at most [s]."""

WARM = {"estimate": 1.0, "diagnose": 1.3, "identify": 1.2}
"""Wall time of a later run on a log at 1 kHz, at most [s]."""

WARM_FAST = 2.0
"""The same at 10 kHz [s]."""

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
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # 0.4 s by itself
    command = [sys.executable, "-m", "experiments.cli", verb, str(log), "--json"]
    begin = time.perf_counter()
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # noqa: S603  our own
    _, status, used = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) != 0:
        raise RuntimeError(f"{' '.join(command)} failed")
    return used.ru_utime + used.ru_stime, time.perf_counter() - begin


def text_of(model: GreyBoxModel) -> str:
    """Return the text of a fit's kernel."""
    texts: list[str] = []
    load: Callable[..., Any] = greybox_loops.load_native

    def caught(name: str, text: Any, entries: Any, made_of: object = None) -> Any:
        texts.append(text())
        return load(name, text, entries, made_of)

    greybox_loops.load_native = caught
    try:
        greybox_loops.compile_kernel.__wrapped__(model)
    finally:
        greybox_loops.load_native = load
    return texts[0]


def by_numba(text: str) -> Callable[..., Any]:
    """Return a kernel that Numba compiles from the same text, without fast-math."""
    names: dict[str, Any] = {}
    exec(f"{INTRINSICS}\n{text.replace('cache=True, ', '')}", names)  # noqa: S102  our own text
    return names["run"]


def arguments(model: GreyBoxModel, samples: int) -> tuple[Any, ...]:
    """Return what a kernel of the flow form is run on."""
    rng = np.random.default_rng(0)
    turns = np.arange(samples)
    drives = np.stack([120.0 * np.sin(0.01 * turns), 0.01 * np.sin(0.003 * turns)], 1)
    theta = np.full(len(model.unknowns), -1.0)
    theta[: len(theta)] = np.log([2e8, 1e-12, 1e-6, 1e-9, 1e4, 1e-13, 1.3])[: len(theta)]
    noise = np.array([2.5e7]), np.array([1e3]), np.zeros((0, 3)), 3.0
    measured = 1e6 * rng.normal(size=(samples, 1))
    row, nothing = parameter_row(EhaParameters()), (np.empty((0, 0)), np.empty((0, 0, 0)))
    return theta, drives, measured, row, 1e-3, np.ones(samples, np.int64), 1, *noise, *nothing


def beside_numba(model: GreyBoxModel) -> None:
    """Print what our compiler and Numba take for one kernel, and whether they give the same bits."""
    text, given = text_of(model), arguments(model, 20_000)
    seconds: list[float] = []
    runs: list[float] = []
    found: list[Any] = []
    with tempfile.TemporaryDirectory() as folder:
        os.environ["HYDROSTATE_CACHE"] = folder
        name = f"beside_numba_{model.name}"
        lengths = {"unknowns": len(model.unknowns), "outputs": 1, "channels": len(model.drives)}
        takes = greybox_loops.signature_of(greybox_loops.run, **lengths)
        ours = lambda: greybox_loops.load_native(name, text + "\n# anew\n", {"run": takes}).run  # noqa: E731
        for compiled in (ours, lambda: by_numba(text)):
            begin = time.process_time()
            run = compiled()
            found.append(run(*given))
            seconds.append(time.process_time() - begin)
            tries: list[float] = []
            for _ in range(5):
                begin = time.process_time()
                run(*given)
                tries.append(time.process_time() - begin)
            runs.append(min(tries))
    same = all(np.array_equal(a, b) for a, b in zip(*found, strict=True))
    print(
        f"fit_{model.name:10} ours {seconds[0]:.2f} s, Numba {seconds[1]:.2f} s, {seconds[1] / seconds[0]:.0f} times; "
        f"a run {1e3 * runs[0]:.1f} and {1e3 * runs[1]:.1f} ms; {'the same bits' if same else 'other bits'}"
    )


def main(argv: Sequence[str]) -> int:
    """Print CPU and wall of the verbs, and compile times beside Numba's."""
    parser = argparse.ArgumentParser(prog="start_up", description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="length of the logs [s]")
    parser.add_argument("--log", type=Path, help="a log of your own in place of the simulated ones")
    parser.add_argument(
        "--without-numba", action="store_true", help="skip the kernels beside Numba, which take a minute"
    )
    chosen = parser.parse_args(argv)
    kept = os.environ.get("HYDROSTATE_CACHE")
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
                say(f"{verb}, first, CPU [s]", cpu, FIRST[verb])
                say(f"{verb}, later, wall [s]", warm, WARM_FAST if k else WARM[verb])
    if not chosen.without_numba:
        for model in (FLOW_FORM, MASS_FLOW_FORM):
            beside_numba(model)
    if kept is not None:
        os.environ["HYDROSTATE_CACHE"] = kept
    return len(misses)
