"""A search that ended in one of several valleys along the scale of forces looks into the others."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from estimation.fits.descent import Point
from estimation.fits.force_scale import Way, rescaled
from estimation.fits.freed_problem import FreedProblem
from estimation.models.motion import LINEAR, MOTION_FORMS, UNKNOWNS

MODEL = replace(MOTION_FORMS[0], unknowns=UNKNOWNS, linear=tuple(LINEAR.items()))
HERE = MODEL.theta({name: 2e8 if name == "bulk_modulus" else 1.0 for name in UNKNOWNS})
FAR = np.full(len(UNKNOWNS), 40.0)


def searched(at: Callable[[np.ndarray], Point]) -> tuple[Point, list[Point]]:
    """Return the best and the other optima of a misfit, as they are found from the point `HERE`."""
    problem = cast("FreedProblem", SimpleNamespace(model=MODEL, at_each=lambda thetas: [at(theta) for theta in thetas]))
    return rescaled(problem, at(HERE), Way(problem, 12, 0.01, 25, (-FAR, FAR)))


def valleys(scale: float, lower: float) -> Callable[[np.ndarray], Point]:
    """Return a misfit with valleys at bulk modulus here and on another scale, which is lower by so much."""
    second = np.log(scale)

    def at(theta: np.ndarray) -> Point:
        off, tilt = theta[0] - HERE[0], np.sqrt(2.0 * lower) / abs(second)
        errors = np.array([200.0 * off * (off - second), tilt * (off - second)])
        slopes = np.zeros((2, len(theta)))
        slopes[:, 0] = 200.0 * (2.0 * off - second), tilt
        return Point(theta, 0.5 * float(errors @ errors), slopes.T @ errors, slopes.T @ slopes)

    return at


def flat(cost: Callable[[np.ndarray], float]) -> Callable[[np.ndarray], Point]:
    """Return a misfit whose slopes are zero, so that each search stays where it begins."""
    return lambda theta: Point(theta, cost(theta), np.zeros(len(theta)), np.zeros((len(theta), len(theta))))


@pytest.mark.parametrize("scale", [0.7, 1.4])
def test_a_lower_optimum_on_another_scale_takes_the_place_of_the_best(scale: float) -> None:
    best, others = searched(valleys(scale, lower=7.0))
    assert best.theta[0] - HERE[0] == pytest.approx(np.log(scale), abs=1e-3)
    assert len(others) == 4
    assert best not in others
    assert any(other.theta[0] - HERE[0] == pytest.approx(0.0, abs=1e-2) for other in others)


@pytest.mark.parametrize("scale", [0.7, 1.4])
def test_an_optimum_on_another_scale_that_is_as_good_is_told_of(scale: float) -> None:
    best, others = searched(valleys(scale, lower=1.0))
    assert best.theta[0] == HERE[0]
    assert any(other.theta[0] - HERE[0] == pytest.approx(np.log(scale), abs=1e-3) for other in others)


def test_all_forces_grow_together_and_what_yields_to_them_falls() -> None:
    _, ends = searched(flat(lambda _: 0.0))
    fixed = ("flow_bias", "speed_lead")
    for factor, end in zip((0.8, 1.25), ends, strict=True):
        before, after = MODEL.values(HERE), MODEL.values(end.theta)
        changed = {name: after[name] / before[name] for name in UNKNOWNS}
        falls = ("leakage_coefficient", "makeup_conductance", "case_leakage")
        expected = {name: 1.0 if name in fixed else 1.0 / factor if name in falls else factor for name in UNKNOWNS}
        assert changed == pytest.approx(expected)


def test_a_valley_that_goes_on_for_ever_is_left_after_three_rounds() -> None:
    best, _ = searched(flat(lambda theta: 100.0 * theta[0]))
    assert best.theta[0] - HERE[0] == pytest.approx(3.0 * np.log(0.8))
