"""A slope along a ridge, converted back, is the slope by one parameter."""

import numpy as np
import pytest

from estimation.fits.greybox.ridge import STEEPEST, PlacedRidge, Ridge

RIDGE = Ridge("delivery", "bias", 100.0)


def test_a_ridge_needs_both_of_its_parameters_to_be_free() -> None:
    assert RIDGE.placed(("modulus", "bias", "delivery")) == PlacedRidge(2, 1, 100.0)
    assert RIDGE.placed(("modulus", "delivery")) is None
    assert RIDGE.placed(("modulus", "bias")) is None


def test_a_step_along_the_ridge_changes_the_second_parameter_by_the_ratio_times_the_first() -> None:
    placed, theta, nudge = PlacedRidge(0, 1, 100.0), np.log([2e-6, 4e-5]), 1e-3
    points = theta + nudge * np.eye(3, 2, -1)
    placed.turn(points, theta, nudge)
    bias = np.exp(points[:, 1])
    assert bias[1] - bias[0] == pytest.approx(100.0 * nudge * 2e-6)
    assert bias[2] == pytest.approx(4e-5 * np.exp(nudge))


def test_a_slope_turned_back_is_that_of_the_first_parameter_alone() -> None:
    """If a residual is the difference of two flows, its slope along the ridge is zero."""
    placed, theta, nudge = PlacedRidge(0, 1, 100.0), np.log([2e-6, 4e-5]), 1e-6

    def residual(at: np.ndarray) -> float:
        return float(100.0 * np.exp(at[0]) - np.exp(at[1]))

    points = theta + nudge * np.eye(3, 2, -1)
    placed.turn(points, theta, nudge)
    slopes = np.array([[(residual(point) - residual(theta)) / nudge for point in points[1:]]])
    assert abs(slopes[0, 0]) < 1e-9
    placed.turn_back(slopes, theta)
    assert slopes[0] == pytest.approx([2e-4, -4e-5], rel=1e-5)


def test_the_steepness_of_a_ridge_is_limited_if_a_parameter_vanishes() -> None:
    assert PlacedRidge(0, 1, 100.0).steepness(np.log([2e-6, 1e-30])) == STEEPEST
