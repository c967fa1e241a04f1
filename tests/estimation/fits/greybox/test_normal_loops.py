"""Loops that compute the terms of normal equations: compiled and as Python."""

import numpy as np
import pytest

from estimation.fits.greybox.normal_loops import fill_differences, fill_quadratic
from estimation.fits.greybox.problem import OUTLIER, STRAIGHT, quadratic

RNG = np.random.default_rng(3)
ERRORS = RNG.normal(0.0, 2.5, (2, 40))
SLOPES = RNG.normal(size=(2, 40, 3))


@pytest.mark.parametrize("fill", [fill_differences, fill_differences.__wrapped__])
def test_differences_are_taken_from_the_first_lane_and_spare_lanes_are_ignored(fill: object) -> None:
    found = np.concatenate([ERRORS[..., None], ERRORS[..., None] + 1e-3 * SLOPES, np.full((2, 40, 4), 7.0)], axis=-1)
    here, slopes = np.empty((2, 40)), np.empty((2, 40, 3))
    fill(found, 1e-3, here, slopes)  # type: ignore[operator]  # a compiled loop, or its Python function
    np.testing.assert_array_equal(here, ERRORS)
    np.testing.assert_allclose(slopes, SLOPES, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("fill", [fill_quadratic, fill_quadratic.__wrapped__])
def test_a_residual_beyond_the_limit_counts_linearly(fill: object) -> None:
    errors = np.array([1.0, -2.0 * OUTLIER])
    squares, pulling, bent = np.empty(2), np.empty(2), np.empty((2, 1))
    fill(errors, np.full((2, 1), 5.0), OUTLIER, STRAIGHT, squares, pulling, bent)  # type: ignore[operator]  # as above
    assert squares.tolist() == [0.5, 1.5 * OUTLIER**2]  # Huber: limit times size, minus half the limit squared
    assert pulling.tolist() == [1.0, -OUTLIER]
    assert bent[:, 0].tolist() == [5.0, 5.0 * STRAIGHT]


def test_cost_and_gradient_are_those_of_their_formula() -> None:
    cost, gradient, gram = quadratic(ERRORS, SLOPES)
    sizes, columns = np.abs(ERRORS), SLOPES.reshape(-1, 3)
    huber = np.where(sizes < OUTLIER, 0.5 * ERRORS**2, OUTLIER * (sizes - 0.5 * OUTLIER))
    assert cost == pytest.approx(float(np.sum(huber)), rel=1e-12)
    np.testing.assert_allclose(gradient, np.clip(ERRORS, -OUTLIER, OUTLIER).ravel() @ columns, rtol=1e-12)
    bends = np.where(sizes.ravel() > OUTLIER, STRAIGHT, 1.0)
    np.testing.assert_allclose(gram, np.tril((columns * bends[:, None]).T @ columns), rtol=1e-12)
