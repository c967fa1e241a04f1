"""Results from loops and runs of the piezo stack, kept in `numbers.json`."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.piezo_stack import bouc_wen, estimate
from estimation.piezo_stack.bouc_wen import LOOP, fit_stack_loop, loop_bounds
from estimation.piezo_stack.bouc_wen_printed import printed_fit
from estimation.piezo_stack.estimate import StackEstimate, covariance, estimate_stack, stack_bounds
from estimation.piezo_stack.finding import stack_quantities, undescribed_channels
from estimation.piezo_stack.runs import STACK_CHANNELS, prepared_runs
from estimation.piezo_stack.unknowns import DEFAULT_UNKNOWNS, STARTS, UNKNOWNS, changed_actuator, reported_value
from plant.log.record import Record
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, simulate_stack, sine_drive
from tests.edges import edge
from tests.numbers import Numbers, Roughly, or_refused

NUMBERS = Numbers(__file__)
HEALTHY = PiezoStackParameters(load_mass=10.0)
WORN = replace(HEALTHY, chamber_leakage=4e-12, coulomb_friction=60.0)
T = 1e-4
DRIVE = sine_drive(275.0, 140.0, 0.012, T)


@cache
def log() -> Record:
    return simulate_stack(WORN, DRIVE, T, sensors=BENCH_SENSORS, rng=np.random.default_rng(3))


@NUMBERS.case()
def unknowns_and_starts() -> dict[str, Any]:
    moved = {name: changed_actuator(HEALTHY, {name: 0.4}) for name in UNKNOWNS}
    return {
        "changed": {
            name: {one: getattr(moved[name], one) for one in unknown.names} for name, unknown in UNKNOWNS.items()
        },
        "scales": {name: one.scale for name, one in UNKNOWNS.items()},
        "told": {
            name: list(reported_value(moved[name], HEALTHY, name, 0.1))
            if not UNKNOWNS[name].scale
            else {
                "value": reported_value(moved[name], HEALTHY, name, 0.1)[0],
                "deviation": reported_value(moved[name], HEALTHY, name, 0.1)[1],
            }
            for name in UNKNOWNS
        },
        "far": [changed_actuator(HEALTHY, {"air_fraction": one}).air_fraction for one in (-9.0, 9.0)],
        "unless asked": list(DEFAULT_UNKNOWNS),
        "starts": [dict(one) for one in STARTS],
    }


@NUMBERS.case(relative=1e-4)
def runs_beside_a_log() -> dict[str, Any]:
    runs = prepared_runs(log(), HEALTHY, ("chamber_leakage", "coulomb_friction"), STACK_CHANNELS)
    measured = runs.measured
    theta = np.array([0.3, 0.2])
    base, slopes = runs.linearised_at(theta)
    coarse, steep = runs.linearised_at(theta, 5e-6, 2e-2)
    guesses, beside = runs.first(STARTS)
    order = [guesses[place] for place in np.argsort(np.sum((beside - measured) ** 2, axis=1), kind="stable")]
    lost = runs.scaled([np.array([0.0, np.nan])])

    def refused(**of: Any) -> Any:
        return or_refused(
            lambda: prepared_runs(log().replace(**of), HEALTHY, ("chamber_leakage",), STACK_CHANNELS).measured
        )

    return {
        "channels": list(runs.noise),
        "noise": dict(runs.noise),
        "measured": [part[[0, 60, 119]] for part in np.split(measured, len(runs.noise))],
        "runs": [part[[0, 60, 119]] for part in np.split(base, len(runs.noise))],
        "slopes": [part[[30, 60, 119]] for part in np.split(slopes, len(runs.noise))],
        "coarse": [part[119] for part in np.split(coarse, len(runs.noise))],
        "coarse slopes": [part[119] for part in np.split(steep, len(runs.noise))],
        "order of starts": [one.tolist() for one in order],
        "count": runs.count,
        "where no actuator is": [float(lost.max()), float(lost.min())],
        "refused": [
            refused(drive_voltage_v=None),
            refused(**dict.fromkeys(STACK_CHANNELS)),
            refused(position_m=np.where(np.arange(120) == 4, np.nan, 0.0)),
        ],
        "an unknown unknown": or_refused(lambda: prepared_runs(log(), HEALTHY, ("x",), STACK_CHANNELS)),
        "no start": or_refused(lambda: runs.first(({"air_fraction": 0.1},))),
    }


@NUMBERS.case(relative=1e-3)
def what_a_run_says() -> dict[str, Any]:
    found = estimate_stack(
        log(), HEALTHY, unknowns=("chamber_leakage", "coulomb_friction"), starts=({}, {"chamber_leakage": 0.5})
    )
    blind = estimate_stack(
        log(),
        HEALTHY,
        unknowns=("air_fraction",),
        starts=({}, {"air_fraction": 0.7}, {"air_fraction": -0.7}),
        channels=("position_m", "stack_displacement_m"),
    )
    slopes = np.random.default_rng(1).standard_normal((30, 3)) * [1.0, 1e-3, 0.0]
    return {
        "values": dict(found.values),
        "deviations": dict(found.deviations),
        "correlation": found.correlations[0, 1],
        "misfit": dict(found.misfit),
        "evaluations": Roughly(found.evaluations, 0.3),
        "interval": list(found.interval("coulomb_friction")),
        "parameters": {
            name: getattr(found.parameters, name) for name in ("chamber_leakage", "coulomb_friction", "air_fraction")
        },
        "of a model that is not it": [dict(blind.values), dict(blind.deviations), dict(blind.misfit)],
        "bounds": dict(stack_bounds(WORN, DRIVE, T)),
        "bounds by position": dict(
            stack_bounds(WORN, DRIVE, T, channels=("position_m",), unknowns=("air_fraction", "crossport_leakage"))
        ),
        "covariance": [covariance(slopes[:, :2])[0], covariance(slopes)[2, 2]],
        "share of a change": estimate._largest_relative_change(np.array([0.1, -0.6]), np.diag([0.01, 0.04])),  # pyright: ignore[reportPrivateUsage]
        "spread": estimate._Optimum(np.zeros(2), np.arange(9.0), np.zeros((9, 2))).spread,  # pyright: ignore[reportPrivateUsage]
        "quantities": {
            name: {"value": one.value, "std": one.std, "unit": one.unit}
            for name, one in stack_quantities(found, HEALTHY).items()
        },
    }


@NUMBERS.case()
def misfits_and_quantities() -> dict[str, Any]:
    made = StackEstimate(
        {"coulomb_friction": 40.0},
        {"coulomb_friction": 1.0},
        np.eye(1),
        {"position_m": 1.0, "stack_force_n": 1.0},
        5,
        HEALTHY,
        1_000_000,
        delay=0.0,
    )

    def misses(one: float) -> list[str]:
        return list(undescribed_channels(replace(made, misfit={"position_m": one, "stack_force_n": 1.0})))

    def given(value: float, std: float, name: str = "coulomb_friction") -> bool:
        return (
            stack_quantities(replace(made, values={name: value}, deviations={name: std}), HEALTHY)[name].value is None
        )

    return {
        "missed from": edge(misses, 1.0, 9.0),
        "uncertain from": [edge(lambda one, value=value: given(value, one), 1e-3, 1e4) for value in (0.0, 20.0, 500.0)],
        "leakage uncertain from": edge(lambda one: given(0.0, one, "chamber_leakage"), 1e-15, 1e-9),
        "air uncertain from": edge(lambda one: given(0.03, one, "air_fraction"), 1e-6, 1.0),
    }


@NUMBERS.case(relative=1e-3)
def loops_of_a_stack() -> dict[str, Any]:
    voltage = 60.0 * (1.0 - np.cos(2.0 * np.pi * np.arange(601) / 200))
    p = PiezoStackParameters()
    theta = np.array([*(float(getattr(p, name)) for name in LOOP), 1e-6, 1e-8])
    rest, slopes = bouc_wen._loop_model(voltage, True)(theta)  # pyright: ignore[reportPrivateUsage]
    gone, closed = bouc_wen._loop_model(voltage[:201], False)(theta)  # pyright: ignore[reportPrivateUsage]
    noise = 1e-8 * np.random.default_rng(1).standard_normal(601)
    found = fit_stack_loop(voltage, rest + noise)
    again = fit_stack_loop(voltage[:201], gone + noise[:201], from_rest=False)
    long = np.arange(20001.0)

    def refused(u: Any, x: Any) -> Any:
        return isinstance(or_refused(lambda: fit_stack_loop(u, x)), str)

    opened = voltage[:201] * 1.0
    return {
        "displacement [m]": rest[[0, 50, 140, 300, 600]],
        "slopes": {str(k): slopes[[50, 140, 600], k] for k in range(8)},
        "closed [m]": gone[[0, 50, 140, 200]],
        "closed slopes": {str(k): closed[[50, 140], k] for k in range(8)},
        "from rest": {
            "values": dict(found.values),
            "deviations": dict(found.deviations),
            "error": found.error,
            "condition": found.condition,
            "interval": list(found.interval("hysteresis")),
        },
        "gone round before": {"values": dict(again.values), "error": again.error, "condition": again.condition},
        "bounds": dict(loop_bounds(p, voltage, 2e-8)),
        "bounds of one cycle from rest": dict(loop_bounds(p, voltage[:201], 2e-8)),
        "averaged": [len(bouc_wen._averaged_loop(long[:count])) for count in (201, 4999, 5001, 9999, 10001, 20001)],  # pyright: ignore[reportPrivateUsage]
        "means": bouc_wen._averaged_loop(long)[[0, 1, -2, -1]],  # pyright: ignore[reportPrivateUsage]
        "short": [refused(voltage[:count], rest[:count]) for count in (49,)],
        "gap to": edge(
            lambda one: isinstance(
                or_refused(lambda: bouc_wen._checked_loop(np.append(opened[:-1], one), opened)), str
            ),
            0.0,
            30.0,
        ),  # pyright: ignore[reportPrivateUsage]
        "lengths": [
            isinstance(or_refused(lambda count=count: bouc_wen._checked_loop(np.zeros(count), np.zeros(count))), str)
            for count in (49, 50)
        ],  # pyright: ignore[reportPrivateUsage]
        "not finite": [
            refused(np.where(np.arange(601) == 3, np.nan, voltage), rest),
            refused(voltage, np.where(np.arange(601) == 3, np.inf, rest)),
        ],
    }


@NUMBERS.case()
def printed_procedure() -> dict[str, Any]:
    angle = 2.0 * np.pi * np.arange(301) / 300
    small, large = np.sin(angle), 100.0 * np.sin(angle)
    sine = (small, 9e-8 * small + 1e-9 * np.cos(angle))
    found = printed_fit((2.0, 1.6e-7), sine, (large, 8e-8 * large - 1e-6 * np.sin(angle - 0.4)))
    alone = printed_fit((2.0, 1.6e-7), sine, (large, 8e-8 * large + 0.0 * angle))
    return {
        "values": dict(found.values),
        "samples": list(found.samples),
        "without hysteresis": dict(alone.values),
        "samples without": list(alone.samples),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
