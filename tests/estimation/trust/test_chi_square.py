"""Tail and quantiles of the chi-square distribution agree with SciPy's."""

import math

import numpy as np
import pytest
from scipy.special import chdtrc, gammaincinv

from estimation.trust.chi_square import chi_square_quantile, chi_square_tail


@pytest.mark.parametrize("freedom", [1, 2, 3, 10, 25, 50, 301, 1000])
def test_the_tail_equals_scipys(freedom: int) -> None:
    values = freedom * np.array([1e-3, 0.5, 1.0, 1.2, 2.0, 5.0])
    tails = [chi_square_tail(value, freedom) for value in values.tolist()]
    np.testing.assert_allclose(tails, chdtrc(freedom, values), rtol=1e-11)


def test_the_tail_is_one_at_zero_and_zero_at_infinity() -> None:
    assert chi_square_tail(0.0, 5) == 1.0
    assert chi_square_tail(math.inf, 5) == 0.0
    assert math.isnan(chi_square_tail(math.nan, 5))


@pytest.mark.parametrize("freedom", [1, 2, 3, 12])
def test_quantiles_equal_scipys(freedom: int) -> None:
    probabilities = [0.01, 0.5, 0.95, 0.9999]
    quantiles = [chi_square_quantile(probability, freedom) for probability in probabilities]
    np.testing.assert_allclose(quantiles, 2.0 * gammaincinv(0.5 * freedom, probabilities), rtol=1e-11)
