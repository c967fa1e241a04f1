"""A user's own equations against the usual way: SciPy's least_squares around solve_ivp, in one run.

Three models of the tutorial (pendulum, tank, friction after Stribeck) are fitted to the same simulated logs from the
same starts. The peer integrates the same derivative on floats with LSODA or RK45, at tolerances that make the answers
equal, and differentiates by finite differences. Its default difference step is lost in the integrator's error and would
leave it at the start, so it gets a suitable one. Then interval coverage is counted on logs with fresh noise.
"""

import argparse
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

import hydrostate as hs
from benchmarks.targets import check_target, misses, processor_time
from estimation.arrays import Array
from estimation.equations.kernel import compile_equations

WANTED_RATIO = 20.0
"""Ratio of the peer's processor time to ours."""

EQUAL_DISTANCE = 0.1
"""Distance from the peer's own optimum within which answers count as equal, in standard deviations."""

SETTINGS: Mapping[str, Any] = {"diff_step": 1e-5, "xtol": 1e-12, "ftol": 1e-12}
"""Settings of the peer: relative step of its finite differences [fraction], and stopping tolerances."""


@dataclass(frozen=True)
class Case:
    """One model with its truth, noise, and log without outputs."""

    name: str
    model: hs.GreyBox
    truth: Mapping[str, float]
    noise: float
    first: Mapping[str, float]
    log: pd.DataFrame
    method: Any


def pendulum(state: Any, inputs: Any, p: Any) -> Any:
    """Return the rates of angle [rad/s] and speed [rad/s^2]."""
    turned_back = p.weight * np.sin(state.angle) + p.damping * state.speed
    return state.speed, (inputs.torque - turned_back) / p.inertia


def tank(state: Any, inputs: Any, p: Any) -> Any:
    """Return the rate of the level [m/s]."""
    return ((p.pump * inputs.voltage - p.orifice * np.sqrt(np.maximum(state.level, 1e-6))) / p.area,)


def slide(state: Any, inputs: Any, p: Any) -> Any:
    """Return the rate of the velocity [m/s^2]."""
    v = state.velocity
    dry = p.coulomb + (p.static - p.coulomb) * np.exp(-((v / 0.02) ** 2))
    return ((p.gain * inputs.voltage - dry * np.tanh(v / 1e-3) - p.viscous * v) / p.mass,)


def cases(samples: int) -> list[Case]:
    """Return the three cases."""
    k, rng = np.arange(samples), np.random.default_rng(3)

    def unknown(**starts: float) -> dict[str, hs.Parameter]:
        return {name: hs.Parameter(start, (0.01 * start, 100.0 * start)) for name, start in starts.items()}

    def table(sample_time: float, **columns: Array) -> pd.DataFrame:
        return pd.DataFrame(columns, index=sample_time * k)

    swinging = hs.GreyBox(
        pendulum,
        states=["angle", "speed"],
        inputs=["torque"],
        outputs=["angle"],
        parameters=unknown(inertia=0.1, weight=1.0, damping=0.1),
    )
    draining = hs.GreyBox(
        tank,
        states=["level"],
        inputs=["voltage"],
        outputs=["level"],
        parameters={**unknown(pump=1e-3, orifice=1e-3), "area": 0.05},
    )
    rubbing = hs.GreyBox(
        slide,
        states=["velocity"],
        inputs=["voltage"],
        outputs=["velocity"],
        parameters={**unknown(coulomb=20.0, static=30.0, viscous=40.0), "mass": 8.0, "gain": 10.0},
    )
    torque = 0.4 * np.sign(np.sin(0.02 * k)) * np.cos(0.007 * k)
    force = 4.0 * np.sin(0.006 * k) + 1.5 * np.sin(0.022 * k)
    steps = np.repeat(rng.uniform(1.0, 5.0, samples // 50 + 1), 50)[:samples]
    return [
        Case(
            "pendulum",
            swinging,
            {"inertia": 0.2, "weight": 2.0, "damping": 0.05},
            0.005,
            {"angle": 0.3},
            table(0.01, torque=torque),
            "RK45",
        ),
        Case(
            "tank", draining, {"pump": 2e-3, "orifice": 8e-3}, 1e-3, {"level": 0.2}, table(1.0, voltage=steps), "RK45"
        ),
        Case(
            "Stribeck friction",
            rubbing,
            {"coulomb": 15.0, "static": 25.0, "viscous": 80.0},
            1e-3,
            {"velocity": 0.0},
            table(0.002, voltage=force),
            "LSODA",
        ),
    ]


def noisy_log(case: Case, seed: int) -> pd.DataFrame:
    """Return the log of a case with fresh noise."""
    truth = case.model.simulate(case.log, case.truth, initial=case.first)
    (output,) = truth.columns
    noise = case.noise * np.random.default_rng(seed).standard_normal(len(truth))
    return case.log.assign(**{output: truth[output].to_numpy() + noise})


def residual_of(case: Case, log: pd.DataFrame) -> Callable[[Array], Array]:
    """Return the peer's residual over the noise, from parameters over their starts, then initial states."""
    model = case.model.equations
    time, (source,), (output,) = log.index.to_numpy(), model.inputs, model.outputs
    driven, measured = log[source].to_numpy(), log[output].to_numpy()
    sizes = _parameter_starts(case)

    def residual(x: Array) -> Array:
        values = dict(zip(model.parameters, x[: len(sizes)] * sizes, strict=True))
        p = SimpleNamespace(**values, **model.known)

        def rates(t: float, state: Array) -> Any:
            now = SimpleNamespace(**dict(zip(model.states, state, strict=True)))
            return model.derivative(now, SimpleNamespace(**{source: np.interp(t, time, driven)}), p)

        run = solve_ivp(
            rates,
            (time[0], time[-1]),
            x[len(sizes) :],
            case.method,
            t_eval=time,
            rtol=1e-10,
            atol=1e-12,
            max_step=time[1] - time[0],
        )
        return (run.y[0] - measured) / case.noise

    return residual


def _parameter_starts(case: Case) -> Array:
    return np.array([one.start for one in case.model.equations.parameters.values()])


def peer_solution(case: Case, log: pd.DataFrame) -> Array:
    """Return the solution of least_squares around solve_ivp: parameters over their starts, then initial states."""
    model, count = case.model.equations, len(case.model.equations.parameters)
    (output,) = model.outputs
    first = [log[output].iloc[0] if name == output else 0.0 for name in model.states]
    start = np.concatenate([np.ones(count), first])
    least = np.concatenate([np.full(count, 0.01), np.full(len(first), -np.inf)])
    most = np.concatenate([np.full(count, 100.0), np.full(len(first), np.inf)])
    return least_squares(residual_of(case, log), start, bounds=(least, most), x_scale="jac", **SETTINGS).x


def _compare_with_peer(case: Case, log: pd.DataFrame) -> None:
    """Compare time and answers on one log."""
    compile_equations.cache_clear()
    cold, _ = processor_time(lambda: case.model.fit(log))
    ours, found = processor_time(lambda: case.model.fit(log))
    theirs, values = processor_time(lambda: peer_solution(case, log))
    sizes, count = _parameter_starts(case), len(case.truth)
    first = [found.quantities[f"initial {name}"].value for name in case.model.equations.states]
    own = np.array([*(found.values[name] for name in case.truth), *first])
    own[:count] /= sizes
    stds = [found.quantities[name].std or np.inf for name in case.truth]
    away = float(np.max(np.abs(own - values)[:count] * sizes / stds))
    residual = residual_of(case, log)
    more = 0.5 * float(np.sum(residual(own) ** 2) - np.sum(residual(values) ** 2))
    print(f"{case.name}: ours {ours:.3f} s ({cold:.2f} s with compilation), least_squares and solve_ivp {theirs:.1f} s")
    print(f"{case.name}: the answers differ by {away:.2g} standard deviations at most")
    check_target(f"{case.name}: times faster", theirs / ours, WANTED_RATIO, most=False)
    check_target(f"{case.name}: times faster, compilation counted", theirs / cold, WANTED_RATIO, most=False)
    check_target(
        f"{case.name}: half the sum of squares by the peer's own residual, ours less the peer's",
        more,
        0.5 * EQUAL_DISTANCE**2,
    )


def _check_coverage(case: Case, seeds: int) -> None:
    """Count intervals that cover, and gates that pass, on logs with fresh noise."""
    find: Callable[[int], Any] = lambda seed: case.model.fit(noisy_log(case, seed))  # noqa: E731 -- short, and used once
    fits = [find(100 + seed) for seed in range(seeds)]
    hits = [one.quantities[name].covers(value) for one in fits for name, value in case.truth.items()]
    share = 100.0 * float(np.mean(hits))
    print(f"{case.name}: {sum(one.believed for one in fits)} of {seeds} gates pass")
    reach = 100.0 * 2.6 * (0.95 * 0.05 / len(hits)) ** 0.5
    check_target(f"{case.name}: intervals that cover [%], {len(hits)}", share, 95.0 - reach, most=False)


def main(arguments: list[str] | None = None) -> int:
    """Run the comparison; return how many targets are missed."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--samples", type=int, default=600)
    options.add_argument("--seeds", type=int, default=100)
    chosen = options.parse_args(arguments)
    misses.clear()
    with TemporaryDirectory() as empty:  # an empty cache, so that compilation is counted
        os.environ["HYDROSTATE_CACHE"] = empty
        for case in cases(chosen.samples):
            _compare_with_peer(case, noisy_log(case, 1))
            _check_coverage(case, chosen.seeds)
    return len(misses)
