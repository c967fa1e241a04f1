"""The gain of a product is the decrease of the least-squares residual; and which products are candidates."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.polynomial_terms import MOST_CANDIDATES, _gains, candidate_terms
from estimation.identification.free_run.polynomial_variables import Variables

RNG = np.random.default_rng(2)


def left(columns: Array, target: Array) -> float:
    missed = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(missed @ missed)


def gains(own: Array, every: Array, residual: Array) -> Array:
    """Return how much each candidate explains, from the products of sensitivities that a fit sums."""
    with np.errstate(invalid="ignore"):
        square = np.einsum("ij,ij->j", every, every)
        return _gains(own.T @ own, own.T @ every, square, own.T @ residual, every.T @ residual)


def test_the_gain_of_a_product_equals_the_reduction_of_the_least_squares_error() -> None:
    own, every, residual = RNG.normal(size=(80, 3)), RNG.normal(size=(80, 5)), RNG.normal(size=80)
    own[:, 2] *= 1e-6  # columns of any size
    every[:, 3] *= 1e4
    exact = [left(own, residual) - left(np.column_stack([own, one]), residual) for one in every.T]
    assert gains(own, every, residual) == pytest.approx(exact, rel=1e-6)


def test_a_linear_combination_of_other_terms_a_zero_and_an_infinite_column_have_no_gain() -> None:
    own, residual = RNG.normal(size=(80, 3)), RNG.normal(size=80)
    nearly = own[:, 0] + 1e-4 * RNG.normal(size=80)
    barely = own[:, 0] + 1e-2 * RNG.normal(size=80)
    every = np.column_stack([own @ [1.0, 2.0, 3.0], nearly, np.zeros(80), np.full(80, np.inf), barely])
    assert (gains(own, every, residual) > 0.0).tolist() == [False, False, False, False, True]


@pytest.mark.parametrize(("lags", "inputs"), [(1, 1), (2, 2), (9, 0), (5, 5)])
def test_products_of_three_signals_are_limited_to_one_channel_if_there_are_too_many(lags: int, inputs: int) -> None:
    source = np.array([0] * lags + [1] * inputs)
    n = lags + inputs
    variables = Variables(source, np.ones(n, dtype=np.int64), np.zeros((n, 2)))
    found = candidate_terms(variables).tolist()
    pairs, cubes = n * (n + 1) // 2, n * (n + 1) * (n + 2) // 6
    assert len({tuple(one) for one in found}) == len(found)
    assert sum(one[2] == -1 for one in found) == pairs
    if pairs + cubes <= MOST_CANDIDATES:
        assert len(found) == pairs + cubes
    else:  # if there are many, only the cubes of one channel's signals
        assert all(len({int(source[v]) for v in one}) == 1 for one in found if one[2] >= 0)
        assert len(found) == pairs + sum(k * (k + 1) * (k + 2) // 6 for k in (lags, inputs))
