"""Public sets with their authors' splits: test errors of ours, of a first-order model, of scipy and of peers.

Ours runs as a new user would run it: ``default`` chooses order and dead time of a linear model, ``auto`` also the
structure, and ``narx`` is the polynomial one. Every figure is the root-mean-square error of the free run on the test
data, relative to that of the mean (0 is perfect, 1 is as good as the mean), with initial states estimated for all
alike. ``first`` is a first-order model with offset, ``scipy`` is output error of orders 1 to 4 from ARX, by BIC; both
use `scipy.optimize.least_squares`. Peers run in environments of their own (`make peers`), each with its size chosen on
the last third of the training data; missing ones are skipped. ``--simulated 0 3`` uses our own sets of seeds 0 to 2
instead, each with a nonlinearity, ``--machines 0 3`` simulated machines and circuits, ``--stand-ins 0 3`` those that
stand in for held-back data. How often the default loses to the better baseline is printed at the end. ``--begun 0.2``
estimates initial states from only the first fifth of the test: a model with an unstable pole and a state fitted to the
whole test follows the output without its inputs. If a peer's state grows a hundredfold over the test, its error is
shown but not compared. If a peer is ahead by more than the targets allow, the ratio of errors is printed with its 95 %
interval over resampled blocks of the test; the last lines count these leads, and how many there would be if ours and
the best peer were equally good. ``--again 16`` makes that many other records of each stand-in, and reports
whether the default is worse there than ``first``, and ``auto`` worse than the default: one test of a nonlinear machine
decides little.
"""

import argparse
import os
import signal
import subprocess
import tempfile
import time
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter
from threadpoolctl import threadpool_limits

from benchmarks.identification.identification_machines import machine_sets
from benchmarks.identification.identification_sets_data import DATA, Part, PublicSet, public_sets
from benchmarks.identification.identification_simulated import simulated_sets
from benchmarks.identification.identification_stand_ins import stand_in_sets
from benchmarks.identification.other_records import WORSE_RATIO, OtherRecords
from benchmarks.identification.peer_leads import PeerLeads
from estimation.arrays import Array
from estimation.identification.free_run.data import channels_from
from estimation.identification.free_run.identify import identify_channels

PEERS = {
    "sippy": "sippy",
    "jax-sysid": "jax-sysid",
    "jax-sysid-nonlinear": "jax-sysid",
    "sysidentpy": "sysidentpy",
}
"""Environment of each peer."""

PUBLISHED = {
    "cascaded tanks": "best linear 0.75 V, Volterra 0.54, state space with GP 0.45, NL-SS 0.34, grey box 0.18 "
    "(Forgione and Piga 2020, Table 3)",
    "Bouc-Wen multisine": "PNLSS degrees 2-3 -90.4 dB, 3-5-7 -98.3 dB (arXiv 1610.09138); dynoNet 4.52e-5 m",
    "EMPS position": "best linear fit 25.4 %, dynoNet 96.8 % (dynoNet, table)",
}
"""Published figures, with their source."""

MOST_PEER_SAMPLES = 10_000
"""Maximum samples given to peers, so that they finish."""

LOSING_RATIO = 1.05
"""Ratio to the better baseline's error from which the default counts as losing."""

LOOKAHEAD_GROWTH = 100.0
"""Growth of a peer's state over the test from which its start encodes outputs instead of inputs."""

OUR_STRUCTURES = {"default": "output-error", "auto": "auto", "narx": "narx", "hammerstein": "hammerstein"}
"""Our columns and their structures."""


def main(arguments: list[str]) -> int:
    """Print the table; return on how many sets a default is worse than a baseline."""
    parser = argparse.ArgumentParser(prog="identification_sets", description=__doc__)
    parser.add_argument("sets", nargs="*", help="parts of names; all unless told")
    seeds = ("FIRST", "END")
    parser.add_argument("--simulated", type=int, nargs=2, default=(0, 0), metavar=seeds, help="our own sets")
    parser.add_argument("--machines", type=int, nargs=2, default=(0, 0), metavar=seeds, help="simulated machines")
    parser.add_argument("--stand-ins", type=int, nargs=2, default=(0, 0), metavar=seeds, help="of sets kept back")
    parser.add_argument("--again", type=int, default=0, metavar="COUNT", help="other records of each stand-in")
    parser.add_argument(
        "--ours", nargs="*", default=list(OUR_STRUCTURES), choices=list(OUR_STRUCTURES), help="columns of ours"
    )
    parser.add_argument("--peers", nargs="*", default=list(PEERS), choices=list(PEERS))
    parser.add_argument("--begun", type=float, default=1.0, metavar="SHARE", help="of the test that states come from")
    parser.add_argument("--timeout", type=float, default=300.0, help="for each peer and set [s of CPU]")
    options = parser.parse_args(arguments)
    made = [one for seed in range(*options.simulated) for one in simulated_sets(seed)]
    made += [one for seed in range(*options.machines) for one in machine_sets(seed)]
    made += [one for seed in range(*options.stand_ins) for one in stand_in_sets(seed, options.again)]
    chosen = made or public_sets(options.sets)
    if not chosen:
        parser.error(_no_set_reason(options.sets))
    peers = [name for name in options.peers if _python(name).exists()] if not made else []
    names = ("first", "scipy", *options.ours, *peers)
    wide = {name: max(11, len(name)) for name in names}
    print(f"{'set':28s}" + "".join(f" {name:>{wide[name]}s}" for name in names) + "   seconds of ours")
    missed, ratios, others, leads = 0, list[float](), OtherRecords(), PeerLeads()
    for one in chosen:
        with threadpool_limits(1), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            runs, seconds, ahead = _runs(_with_initial_share(one, options.begun), options.ours, peers, options.timeout)
        for test, part in one.tests.items():
            errors = {name: _error(run.get(test), part, one.skipped) for name, run in runs.items()}
            title = f"{one.name} {test}".strip()
            shown = "".join(f" {errors[name]:{wide[name]}.4f}" for name in names)
            print(f"{title:28s}{shown}   {seconds}", flush=True)
            auto, default = (errors.get(name, float("nan")) for name in ("auto", "default"))
            rmse = auto * float(np.std(part[1]))
            if title in PUBLISHED and rmse > 0.0:
                print(f"{'':28s}auto {rmse:.4g} = {20.0 * np.log10(rmse):.1f} dB; published: {PUBLISHED[title]}")
            shared = {name: run[test][one.skipped :] for name, run in runs.items() if test in run and name not in ahead}
            for line in leads.lines(part[1][one.skipped :], shared):
                print(f"{'':28s}{line}")
            for line in others.comparison_lines(one, runs):
                print(f"{'':28s}{line}")
            missed += default > WORSE_RATIO * errors["first"] or auto > WORSE_RATIO * default
            ratios.append(default / min(errors["first"], errors["scipy"]))
    print(f"default worse than first order, or auto than default: {missed}")
    lost, mean = sum(one > LOSING_RATIO for one in ratios), float(np.exp(np.mean(np.log(ratios))))
    print(f"default over the better of first and scipy: {lost} of {len(ratios)} lose more than 5 %,", end=" ")
    print(f"worst {max(ratios):.2f}-fold, geometric mean {mean:.3f}")
    for line in [*leads.summary(), *others.summary()]:
        print(line)
    return missed


def _no_set_reason(wanted: list[str]) -> str:
    """Return why there is nothing to compare: no data, or no set with one of these parts in its name."""
    known = ", ".join(one.name for one in public_sets())
    if not known:
        return f"no public set in {DATA}"
    return f"no set's name has {' or '.join(map(repr, wanted))} in it; there are {known}"


def _peer_folder() -> Path:
    return Path(os.environ.get("HYDROSTATE_PEERS", ".peers"))


def _python(peer: str) -> Path:
    return _peer_folder() / PEERS[peer] / "bin" / "python"


def _with_initial_share(one: PublicSet, share: float) -> PublicSet:
    """Return a set whose tests give the runs only an initial share of their outputs."""

    def begun(parts: dict[str, Part]) -> dict[str, Part]:
        return {test: (u, np.where(np.arange(y.size) < share * y.size, y, np.nan)) for test, (u, y) in parts.items()}

    return replace(one, tests=begun(one.tests), again=begun(one.again))


def _error(run: Array | None, part: Part, skipped: int) -> float:
    if run is None:
        return float("nan")
    y = part[1][skipped:]
    return float(np.sqrt(np.mean((run[skipped:] - y) ** 2)) / np.std(y))


def _runs(
    one: PublicSet, ours: list[str], peers: list[str], timeout: float
) -> tuple[dict[str, dict[str, Array]], str, list[str]]:
    inputs = [f"u{k}" for k in range(one.train[0].shape[1])]
    data = channels_from([one.train[0]], [one.train[1]], one.sample_time, inputs, "y")
    found: dict[str, dict[str, Array]] = {"first": _first_order_runs(one), "scipy": _scipy(one)}
    seconds: list[str] = []
    for name in ours:
        begun = time.process_time()
        try:
            model = identify_channels(data, structure=OUR_STRUCTURES[name]).model
        except ValueError as error:
            print(f"{one.name} {name}: {error}")
            found[name] = {}
            continue
        seconds.append(f"{time.process_time() - begun:.1f}")
        found[name] = {test: model.simulate(*part) for test, part in one.parts.items()}
    ahead = list[str]()
    for name in peers:
        found[name], growth = _peer(name, one, timeout)
        if growth > LOOKAHEAD_GROWTH:
            ahead.append(name)
            print(f"{one.name} {name}: grows {growth:.1g}-fold over the test, so its start looks ahead: not compared")
    return found, " ".join(seconds), ahead


def _simulated(theta: Array, n: int, u: Array) -> Array:
    m = u.shape[1]
    f = np.concatenate([[1.0], theta[:n]])
    out = np.full(u.shape[0], theta[n])
    for k in range(m):
        b = theta[n + 1 + k * (n + 1) : n + 1 + (k + 1) * (n + 1)]
        out = out + lfilter(b, f, u[:, k])
    return out


def _with_start(theta: Array, n: int, part: Part, scale: tuple[Array, Array, float, float]) -> Array:
    u, y = (part[0] - scale[0]) / scale[1], (part[1] - scale[2]) / scale[3]
    driven = _simulated(theta, n, u)
    f = np.concatenate([[1.0], theta[:n]])
    free = np.column_stack([lfilter([1.0], f, np.eye(y.size, 1, -k)[:, 0]) for k in range(n)])
    known = np.isfinite(y)
    start = np.linalg.lstsq(free[known], (y - driven)[known], rcond=None)[0]
    return scale[2] + scale[3] * (driven + free @ start)


def _fitted(one: PublicSet, n: int) -> tuple[Array, float, tuple[Array, Array, float, float]]:
    """Return scipy's output-error model started from ARX, its BIC and its scale."""
    u, y = one.train
    scale = (u.mean(axis=0), u.std(axis=0), float(y.mean()), float(y.std()))
    u, y = (u - scale[0]) / scale[1], (y - scale[2]) / scale[3]
    past = np.column_stack([-np.roll(y, k) for k in range(1, n + 1)])
    inputs = np.column_stack([np.roll(u[:, k], lag) for k in range(u.shape[1]) for lag in range(n + 1)])
    rows = np.column_stack([past, np.ones(y.size), inputs])[n:]
    theta = np.linalg.lstsq(rows, y[n:], rcond=None)[0]
    most = 20_000

    def residual(values: Array) -> Array:
        with np.errstate(over="ignore", invalid="ignore"):
            out = _simulated(values, n, u[:most]) - y[:most]
        return np.clip(np.nan_to_num(out, nan=1e3), -1e3, 1e3)

    best = least_squares(residual, theta, max_nfev=60).x
    cost = float(np.mean(residual(best) ** 2))
    return best, y.size * float(np.log(cost)) + theta.size * float(np.log(y.size)), scale


def _first_order_runs(one: PublicSet) -> dict[str, Array]:
    theta, _, scale = _fitted(one, 1)
    return {test: _with_start(theta, 1, part, scale) for test, part in one.parts.items()}


def _scipy(one: PublicSet) -> dict[str, Array]:
    found = {n: _fitted(one, n) for n in (1, 2, 3, 4)}
    n = min(found, key=lambda order: found[order][1])
    return {test: _with_start(found[n][0], n, part, found[n][2]) for test, part in one.parts.items()}


def _peer(name: str, one: PublicSet, timeout: float) -> tuple[dict[str, Array], float]:
    """Return a peer's runs of the tests, and the growth factor of its model's state over one test."""
    python, worker = _python(name), Path(__file__).with_name("identification_sets_peer.py")
    single = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    with tempfile.TemporaryDirectory() as folder:
        data, result = Path(folder) / "set.npz", Path(folder) / "result.npz"
        parts = {f"{key}{k}": part[i] for k, part in enumerate(one.tests.values()) for i, key in enumerate("uy")}
        train = {
            "u": one.train[0][:MOST_PEER_SAMPLES],
            "y": one.train[1][:MOST_PEER_SAMPLES],
            "tests": np.array(len(one.tests)),
        }
        np.savez(data, allow_pickle=False, **train, **parts)
        try:
            subprocess.run(  # noqa: S603 - our own worker, in an environment that the user made
                [str(python), str(worker), name, str(data), str(result), f"{timeout:.0f}"],
                env={**os.environ, **single, "JAX_PLATFORMS": "cpu", "MPLBACKEND": "Agg"},
                check=True,
                capture_output=True,
            )
        except subprocess.CalledProcessError as error:
            late = error.returncode == -signal.SIGXCPU
            why = f"stopped after {timeout:.0f} s" if late else error.stderr.decode(errors="replace").strip()[-200:]
            print(f"{one.name} {name}: {why}")
            return {}, 0.0
        stored = np.load(result)
        return {test: stored[f"y{k}"] for k, test in enumerate(one.tests)}, float(stored["growth"])
