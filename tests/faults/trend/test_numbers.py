"""Trends of short series on both sides of the thresholds, kept in `numbers.json`."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest

from faults.trend.changes import jumps, stretches
from faults.trend.crossing import HORIZON, QUANTILES, Crossing, _drawn_states, crossing  # pyright: ignore[reportPrivateUsage]
from faults.trend.kalman import (
    Belief,
    Settings,
    beliefs,
    evidence_of,
    first_belief,
    moments,
    settings,
)
from faults.trend.rest import growth_evidence, rest_evidence
from faults.trend.trend import Series, Trend, first_logs_after, trends
from plant.arrays import Array
from tests.faults.trend.small_beliefs import next_belief, one_setting
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
SOME = [0, 5, 16, 40, 77, 120, 166, 203, 221]
"""Places in the grid of settings."""


def series(kind: str) -> Array:
    """Return 24 levels, scaled so that healthy is 0 and the limit is 1."""
    noise = np.random.default_rng(21).standard_normal(24)
    k = np.arange(24)
    return {
        "still": 0.2 + 0.01 * noise,
        "growing": 0.1 + 0.02 * k + 0.01 * noise,
        "bending": 0.1 + 0.0012 * k**2 + 0.01 * noise,
        "scattered": 0.3 + 0.1 * noise,
        "stepped": np.where(k < 14, 0.1, 0.5) + 0.01 * noise,
        "mended": np.where(k < 14, 0.05 * k, 0.05) + 0.01 * noise,
        "wandering": 0.2 + np.cumsum(0.03 * noise),
        "beyond": 1.2 + 0.02 * noise,
        "one gross": 0.2 + 0.01 * noise + np.where(k == 11, 0.6, 0.0),
        "falling": 0.9 - 0.02 * k + 0.01 * noise,
        "steep": 0.1 + 0.033 * k + 0.01 * noise,
    }[kind]


KINDS = (
    "still",
    "growing",
    "bending",
    "scattered",
    "stepped",
    "mended",
    "wandering",
    "beyond",
    "one gross",
    "falling",
    "steep",
)
TIMES = np.cumsum(np.where(np.arange(24) % 5 == 0, 1.6, 0.85))
STDS: Array = np.asarray(0.008 + 0.004 * (np.arange(24) % 3), dtype=np.float64)


@NUMBERS.case()
def hypotheses_of_the_balance() -> dict[str, Any]:
    grid = settings()
    first = first_belief(grid)
    return {
        "count": len(grid.slope),
        **{
            f"{name}, a step": sorted(set(getattr(grid, name).tolist()))
            for name in ("slope", "curvature", "jerk", "bend", "wander", "scatter")
        },
        "of some": {
            name: getattr(grid, name)[SOME] for name in ("slope", "curvature", "jerk", "bend", "wander", "scatter")
        },
        "logarithm of the prior": grid.log_prior[SOME],
        "first variance of level, slope, curvature": [np.diag(one) for one in first.covariance[SOME]],
    }


@NUMBERS.case()
def beliefs_along_a_series() -> dict[str, Any]:
    grid, told = settings(), dict[str, Any]()
    for kind in ("growing", "bending", "one gross"):
        *_, last = beliefs(TIMES, series(kind), STDS, grid)
        rest = float(rest_evidence(TIMES, series(kind), STDS, grid)[-1])
        told[kind] = {
            "mean": last.mean[SOME],
            "variances": [np.diag(one) for one in last.covariance[SOME]],
            "covariances": [[one[0, 1], one[0, 2], one[1, 2]] for one in last.covariance[SOME]],
            "evidence": last.evidence[SOME],
            "weights": last.weights(grid)[SOME],
            "all evidence": evidence_of(last, grid),
            "of growth": growth_evidence(last, grid, rest),
            **{f"state {state}": list(moments(last, grid, state)) for state in range(3)},
        }
    jumped = next_belief(first_belief(grid), 2.5, 0.3, 0.02, grid)
    told["after one step"] = {
        "mean": jumped.mean[SOME],
        "covariance": jumped.covariance[SOME],
        "evidence": jumped.evidence[SOME],
    }
    return told


@cache
def followed(kind: str, maintained: tuple[float, ...] = (), limit: float = 9.0) -> list[Trend]:
    values = 5.0 + (limit - 5.0) * series(kind)
    return list(trends(Series(3.0 * TIMES, values, abs(limit - 5.0) * STDS, 5.0, limit, maintained)))


def _told(found: list[Trend]) -> dict[str, Any]:
    last = found[-1]
    return {
        "stretch begins at": [one.begin for one in found],
        "level and deviation": [list(one.level) for one in found[3::5]],
        "growth a step and deviation": [list(one.growth) for one in found[3::5]],
        "evidence of growth": [one.growing for one in found[3::5]],
        "certain": [one.certain for one in found],
        "forecast is given": [one.crossing is not None for one in found],
        "mean step of time": last.series.step,
    }


@NUMBERS.case()
def levels_growth_and_changes() -> dict[str, Any]:
    told = {kind: _told(followed(kind)) for kind in KINDS}
    told["stepped, maintained before it"] = _told(followed("stepped", (3.0 * float(TIMES[10]),)))
    told["growing, downwards"] = _told(followed("growing", (), 2.0))
    return told


@NUMBERS.case()
def alarms() -> dict[str, Any]:
    return {kind: [one.alarm for one in followed(kind)] for kind in KINDS}


@NUMBERS.case()
def jumps_of_a_series() -> dict[str, Any]:
    told: dict[str, Any] = {
        f"{kind}, {length} logs later": jumps(series(kind), STDS, length).tolist()
        for kind in ("stepped", "mended", "scattered", "one gross")
        for length in (3, 6)
    }
    small = np.where(np.arange(12) < 6, 0.0, 1.0) + 0.01 * np.sin(9.0 * np.arange(12))
    told["by how well a log is known"] = [
        int(np.count_nonzero(jumps(small, np.full(12, std), 4))) for std in (0.1, 0.22, 0.24, 0.26, 0.3)
    ]
    told["by how far levels scatter"] = [
        int(np.count_nonzero(jumps(small * size + 0.1 * (np.arange(12) % 2), np.full(12, 1e-3), 4)))
        for size in (0.15, 0.2, 0.25, 0.3, 0.4, 0.6)
    ]
    known = list(stretches(TIMES, series("still"), STDS, {0, 7}, settings()))
    told["stretches about known events"] = [begin for begin, _ in known]
    told["first logs after events"] = sorted(first_logs_after(TIMES, [0.0, 4.0, 1e9, float(TIMES[3])]))
    return told


def held(mean: tuple[float, float, float], **chosen: float) -> tuple[Belief, Settings]:
    """Return a belief with zero covariance in one setting."""
    grid = one_setting(**chosen)
    return Belief(np.array([mean]), np.zeros((1, 3, 3)), np.zeros(1)), grid


FUTURES: Mapping[str, tuple[tuple[float, float, float], dict[str, float]]] = {
    "straight": ((0.5, 0.02, 0.0), {}),
    "far": ((0.1, 0.004, 0.0), {}),
    "curved": ((0.5, 0.0, 0.001), {}),
    "never": ((0.5, -0.01, 0.0), {}),
    "already": ((1.1, 0.0, 0.0), {}),
    "exponential": ((0.5, 0.02, 0.0), {"pace": 0.05}),
    "bending exponential": ((0.5, 0.01, 0.0), {"pace": 0.1, "bend": 0.003}),
    "bending": ((0.5, 0.02, 0.0), {"bend": 0.01}),
    "wandering": ((0.5, 0.02, 0.0), {"wander": 0.05}),
    "jerking": ((0.5, 0.02, 0.0), {"jerk": 0.0008}),
    "all": ((0.5, 0.01, 0.0003), {"jerk": 0.0004, "bend": 0.003, "wander": 0.02}),
}


@NUMBERS.case()
def forecasts() -> dict[str, Any]:
    told: dict[str, Any] = {"horizon [steps]": HORIZON, "quantiles": list(QUANTILES)}
    for name, (mean, chosen) in FUTURES.items():
        found = crossing(*held(mean, **chosen), np.random.default_rng(7))
        told[name] = {
            "steps until the limit": found.quantiles,
            "within 20": found.within(20.0),
            "within 300": found.within(300.0),
        }
    told["of a higher limit"] = crossing(*held((0.5, 0.02, 0.0)), np.random.default_rng(7), 1.5).quantiles
    told["of a few"] = Crossing(np.array([1.0, 2.0, 4.0, 8.0, 9.0])).quantiles
    return told


@NUMBERS.case()
def futures_that_are_drawn() -> dict[str, Any]:
    return {"count": len(crossing(*held((0.9, 0.02, 0.0)), np.random.default_rng(7)).steps)}


@NUMBERS.case(relative=0.15)
def cloud_of_a_belief() -> dict[str, Any]:
    covariance = np.array([[0.04, 0.01, 0.002], [0.01, 0.02, 0.004], [0.002, 0.004, 0.01]])
    belief = Belief(np.array([[0.5, 0.3, 0.2]]), covariance[None], np.zeros(1))
    drawn = _drawn_states(belief, np.zeros(20000, dtype=np.int64), np.random.default_rng(2))
    return {"mean": drawn.mean(axis=1), "variances": drawn.var(axis=1), "covariance": [float(np.cov(drawn)[0, 1])]}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
