"""A point's neighbours, and the slopes that residuals there give."""

import numpy as np

from estimation.fits.greybox.finite_differences import differences, neighbours


def test_slopes_are_those_of_residuals_that_grow_evenly() -> None:
    rng, nudge = np.random.default_rng(0), 1e-4
    here, slopes = rng.normal(size=(2, 5)), rng.normal(size=(2, 5, 3))
    lanes = np.concatenate([here[..., None], here[..., None] + nudge * slopes, np.full((2, 5, 4), np.nan)], axis=-1)
    found = differences(lanes, 3, nudge)
    np.testing.assert_array_equal(found[0], here)
    np.testing.assert_allclose(found[1], slopes, rtol=1e-9, atol=1e-10)


def test_a_points_neighbours_are_one_a_coordinate() -> None:
    np.testing.assert_array_equal(neighbours(2), [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
