"""Designed inputs, dead times, and pistons at rest, kept in `numbers.json`."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.design.dead_time import estimate_delay
from estimation.identification.design.input_design import (
    Limits,
    multisine_for,
    prbs_for,
    predicted_covariance,
    rank_inputs,
    violations,
)
from estimation.identification.design.sticking import is_sticking, rest_shares
from estimation.identification.model.linear_model import LinearModel
from plant.arrays import Array
from tests.numbers import Numbers, refused, some

NUMBERS = Numbers(__file__)
MODEL = LinearModel([0.0, 0.3, -0.1], [1.0, -1.5, 0.7], 0.01, "u", "y", delay=1)
LIMITS = Limits(2.0, 0.5, 0.4, 2.5)


@NUMBERS.case()
def signals() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for bandwidth, slowest, duration in (
        (10.0, 0.1, 3.0),
        (4.0, 0.1, 5.0),
        (4.0, 3.0, 5.0),
        (40.0, 0.001, 0.5),
        (40.0, 2000.0, 0.5),
        (20.0, 0.132, 1.0),
        (20.0, 0.126, 1.0),
    ):
        u = prbs_for(bandwidth, 0.01, LIMITS, slowest=slowest, duration=duration)
        edges = np.flatnonzero(np.diff(u))
        told[f"binary, {bandwidth:g} Hz, {slowest:g} s"] = [u.size, u.max(), u.min(), u.mean(), len(edges), edges[:9]]
    for duration in (1.0, 1.01):
        u = multisine_for(np.array([1.0, 2.2, 3.1, 3.4, 9.0, 20.0]), 0.01, LIMITS, duration=duration)
        told[f"multisine of {duration:g} s"] = [u.size, np.abs(u).max(), some(u, 9)]
    told["all lines"] = some(multisine_for(np.arange(1.0, 50.0), 0.01, LIMITS, duration=1.0), 9)
    calls: dict[str, Callable[[], Any]] = {
        "a clock of one sample": partial(prbs_for, 40.0, 0.01, LIMITS, slowest=1.0, duration=1.0),
        "a shorter one": partial(prbs_for, 40.01, 0.01, LIMITS, slowest=1.0, duration=1.0),
        "below a period": partial(multisine_for, np.array([0.4]), 0.01, LIMITS, duration=1.0),
        "above half the rate": partial(multisine_for, np.array([50.0]), 0.01, LIMITS, duration=1.0),
        "just below it": partial(multisine_for, np.array([49.0]), 0.01, LIMITS, duration=1.0),
        "no frequency": partial(multisine_for, np.array([]), 0.01, LIMITS, duration=1.0),
        "a dead zone of all": partial(Limits, 1.0, 1.0),
        "a dead zone below nothing": partial(Limits, 1.0, -0.1),
        "no dead zone": partial(Limits, 1.0, 0.0),
        "no stroke": partial(Limits, 1.0, 0.0, 0.0),
        "no output": partial(Limits, 1.0, 0.0, 1.0, 0.0),
    }
    return told | {"refused": {name: refused(call) for name, call in calls.items()}}


@NUMBERS.case()
def promises_of_inputs() -> dict[str, Any]:
    binary = prbs_for(10.0, 0.01, LIMITS, slowest=0.1, duration=3.0)
    sines = multisine_for(np.array([1.0, 2.0, 5.0, 9.0]), 0.01, LIMITS, duration=3.0)
    told: dict[str, Any] = {
        "covariance": predicted_covariance(MODEL, binary, 0.1),
        "of silence": predicted_covariance(MODEL, np.zeros(50), 0.1),
    }
    late = LinearModel([0.0, 0.0, 0.4], [1.0, -0.9], 0.01, "u", "y", delay=2)
    told["late"] = predicted_covariance(late, sines, 0.2)
    for name, u in {
        "binary": binary,
        "at its limit": binary * (1.0 + 1e-13),
        "too much": 1.01 * binary,
        "half idle": np.where(np.arange(300) % 2 == 0, binary, 0.0),
        "mostly idle": np.where(np.arange(300) % 5 == 0, binary, 0.5),
        "one way": np.full(300, 1.5),
        "far": np.full(300, 2.0),
    }.items():
        told[f"broken by {name}"] = violations(MODEL, u, LIMITS)
        told[f"broken by {name}, free"] = violations(MODEL, u, Limits(2.0))
    table = rank_inputs(MODEL, {"sines": sines, "binary": binary}, 0.1, np.array([2.0, 25.0]), LIMITS)
    told["ranked"] = {str(name): row.to_dict() for name, row in table.iterrows()}
    return told | {"order": list(table.index)}


def answer(u: Array, delay: int, noise: float = 0.05) -> Array:
    y = np.zeros(u.size)
    for t in range(2, u.size):
        y[t] = 1.2 * y[t - 1] - 0.5 * y[t - 2] + 0.3 * u[max(t - delay, 0)]
    return y + noise * np.random.default_rng(37).standard_normal(u.size)


@NUMBERS.case()
def dead_times() -> dict[str, Any]:
    u = np.repeat(np.random.default_rng(38).choice([-1.0, 1.0], 100), 3)
    told: dict[str, Any] = {}
    for delay in (0, 1, 20):
        told[f"{delay} samples"] = estimate_delay(u, answer(u, delay), n_numerator=1)
    told["beyond what is tried"] = estimate_delay(u, answer(u, 7), n_numerator=1, most=6)
    told["none is tried"] = estimate_delay(u, answer(u, 3), most=0)
    told["of defaults"] = estimate_delay(u, np.where(np.arange(300) % 9 == 0, np.nan, answer(u, 5)), most=6)
    told["refused"] = [
        refused(lambda: estimate_delay(u, answer(u, 3), most=-1)),
        refused(lambda: estimate_delay(u[:69], answer(u[:69], 3), most=6)),
        refused(lambda: estimate_delay(u[:70], answer(u[:70], 3), most=6)),
    ]
    return told


@NUMBERS.case(relative=1e-5)
def pistons_that_rest() -> dict[str, Any]:
    t = 0.001 * np.arange(1500)
    u = 100.0 * np.sin(2.0 * np.pi * 2.0 * t) + 20.0 * np.sign(np.sin(50.0 * t))
    noise = np.random.default_rng(39).standard_normal(1500)
    told: dict[str, Any] = {}
    for name, held in (("free", 0.0), ("rests", 60.0), ("rests for long", 90.0)):
        y = np.where(np.abs(u) > held, 0.001 * (u - held * np.sign(u)), 0.0) + 1e-4 * noise
        lost = np.where(np.arange(1500) % 13 == 5, np.nan, y)
        for sample_time in (0.001, 0.004, 0.02):
            shares = rest_shares(u, lost, sample_time)
            told[f"{name}, at {sample_time:g} s"] = [*shares, is_sticking(*shares)]
    told["rests"] = [
        is_sticking(*pair) for pair in ((0.02, 0.01), (0.021, 0.01), (0.12, 0.1), (0.126, 0.1), (0.0099, 0.0))
    ]
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
