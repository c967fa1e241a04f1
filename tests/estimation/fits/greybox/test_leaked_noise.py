"""White noise of a driving channel that an output follows and loses again."""

import math

import numpy as np
import pytest

from estimation.fits.greybox.leaked_noise import kept_of_means


@pytest.mark.parametrize("samples", [1, 5])
@pytest.mark.parametrize("lost", [1e-3, 0.3, 1.0, 4.0])
def test_means_of_what_is_lost_again_have_the_variance_that_is_told(lost: float, samples: int) -> None:
    kept, read = math.exp(-lost), np.random.default_rng(0).standard_normal(100_000)
    output = np.zeros(len(read))
    for k, change in enumerate(np.diff(read)):
        output[k + 1] = kept * output[k] + (1.0 - kept) / lost * change  # on a straight line between samples
    means = output[1000:].reshape(-1, samples).mean(axis=1)
    assert np.std(means) * samples**0.5 == pytest.approx(kept_of_means(lost, samples)[0], rel=0.03)


@pytest.mark.parametrize("lost", [1e-6, 0.2, 3.0, 600.0, 1e6])
def test_its_slope_is_that_of_its_logarithm(lost: float) -> None:
    above, below = (math.log(kept_of_means(lost * factor, 5)[0]) for factor in (1.001, 1.0 / 1.001))
    assert kept_of_means(lost, 5)[1] == pytest.approx((above - below) / (2.0 * math.log(1.001)), abs=1e-4)


def test_nothing_is_lost_where_nothing_leaks() -> None:
    assert kept_of_means(0.0, 5) == (1.0, 0.0)
    assert kept_of_means(1e-9, 5)[0] == pytest.approx(1.0, rel=1e-6)
