"""Normal equations that are summed as they come are those of the slopes."""

import numpy as np
import pytest

from estimation.fits.greybox.finite_differences import differences, neighbours, summed
from estimation.fits.greybox.freed_problem import NUDGE
from estimation.fits.greybox.problem import weighed


@pytest.mark.parametrize(("unknowns", "lanes"), [(7, 8), (8, 16)])
@pytest.mark.parametrize("blocks", [1, 4, 501, 502, 503])  # four blocks at a time, and what is left of them
def test_sums_are_those_of_slopes_that_are_laid_out(unknowns: int, lanes: int, blocks: int) -> None:
    rng = np.random.default_rng(blocks)
    here = 2.0 * rng.normal(size=(2, blocks, 1))  # every seventh counts linearly
    found = here + NUDGE * rng.normal(size=(2, blocks, lanes))
    cost, gradient, gram = summed(found, unknowns, NUDGE)
    told = weighed(*differences(found, unknowns, NUDGE))
    assert cost == pytest.approx(told[0], rel=1e-12)
    np.testing.assert_allclose(gradient, told[1], rtol=1e-9, atol=1e-9 * np.abs(told[1]).max())
    np.testing.assert_allclose(gram, told[2], rtol=1e-9, atol=1e-9 * np.abs(told[2]).max())


def test_a_points_neighbours_are_one_a_coordinate() -> None:
    np.testing.assert_array_equal(neighbours(2), [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
