"""The arithmetic of a bank's loops, run as Python, compared with mixtures written with whole matrices."""

import math

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.filters.imm_loops import blend, combine, innovate, log_density, log_sum, mix, unpack

WIDTH, BELIEF = 2, 5
SIZES = {"WIDTH": WIDTH, "BELIEF": BELIEF}


def packed(mean: Array, covariance: Array) -> Array:
    return np.concatenate([mean, covariance[np.triu_indices(WIDTH)]])


def beliefs(seed: int, modes: int = 3) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    roots = rng.standard_normal((modes, WIDTH, WIDTH))
    return rng.standard_normal((modes, WIDTH)), roots @ np.swapaxes(roots, 1, 2)


def mixture(means: Array, covariances: Array, weights: Array) -> Array:
    mean = weights @ means
    apart = means - mean
    spread = np.einsum("m,mab->ab", weights, covariances) + np.einsum("m,ma,mb->ab", weights, apart, apart)
    return packed(mean, spread)


def test_log_sum_returns_the_share_of_each_term_and_minus_infinity_for_no_probability() -> None:
    shares, terms = np.empty(3), np.array([-800.0, -801.0, -np.inf])
    assert log_sum(terms, shares) == pytest.approx(-800.0 + math.log1p(math.exp(-1.0)))
    assert shares == pytest.approx([1.0 / (1.0 + math.exp(-1.0)), 1.0 / (1.0 + math.e), 0.0])
    assert log_sum(np.full(3, -np.inf), shares) == -np.inf
    assert not shares.any()


@pytest.mark.parametrize("weights", [[0.2, 0.5, 0.3], [0.6, 0.0, 0.4], [0.0, 0.0, 1.0]])
def test_a_blended_belief_has_the_moments_of_the_mixture(weights: list[float]) -> None:
    means, covariances = beliefs(1)
    states = np.array([packed(*pair) for pair in zip(means, covariances, strict=True)])
    found = np.empty(BELIEF)
    blend(states, np.array(weights), np.empty(BELIEF), found, **SIZES)
    assert found == pytest.approx(mixture(means, covariances, np.array(weights)))


def test_a_mode_starts_from_the_mixture_of_its_predecessors_and_without_any_keeps_its_belief() -> None:
    means, covariances = beliefs(2)
    states = np.array([packed(*pair) for pair in zip(means, covariances, strict=True)])
    before, predicted = states.copy(), np.empty(3)
    transitions = np.array([[0.9, 0.1, 0.0], [0.2, 0.8, 0.0], [0.5, 0.5, 0.0]])
    probability = np.array([0.5, 0.3, 0.2])
    room = np.empty_like(states), np.empty(3), np.empty(3), np.empty(BELIEF)
    with np.errstate(divide="ignore"):
        mix(states, np.log(transitions), np.log(probability), predicted, room, **SIZES)
    joint = transitions * probability[:, None]
    assert np.exp(predicted) == pytest.approx(joint.sum(axis=0))
    for mode in (0, 1):
        assert states[mode] == pytest.approx(mixture(means, covariances, joint[:, mode] / joint[:, mode].sum()))
    np.testing.assert_array_equal(states[2], before[2])


def test_the_density_is_gaussian_over_present_channels_and_zero_for_a_diverged_mode() -> None:
    sample, seen = np.array([1.0, np.nan, 2.0]), np.array([[0.3, 5.0, -0.4], [0.5, 1.0, 2.0]])
    wanted = sum(-0.5 * (e * e / s + math.log(2.0 * math.pi * s)) for e, s in ((0.3, 0.5), (-0.4, 2.0)))
    assert log_density(sample, seen, np.zeros(BELIEF), BELIEF=BELIEF) == pytest.approx(wanted)
    lost = np.array([0.0, np.inf, 0.0, 0.0, 0.0])
    assert log_density(sample, seen, lost, BELIEF=BELIEF) == -np.inf
    seen[0, 0] = np.nan
    assert log_density(sample, seen, np.zeros(BELIEF), BELIEF=BELIEF) == -np.inf


def test_the_innovation_of_a_bank_has_the_moments_of_its_modes_with_probability() -> None:
    seen = np.zeros((3, 2, 2))
    seen[:, 0, 1], seen[:, 1, 1] = [1.0, -2.0, np.nan], [0.5, 0.2, np.nan]
    shares = np.array([0.3, 0.1, 0.0])
    weights, errors, variances = np.array([0.75, 0.25]), seen[:2, 0, 1], seen[:2, 1, 1]
    e, s = innovate(1, 0.0, seen, shares, 0.4)
    assert e == pytest.approx(weights @ errors)
    assert s == pytest.approx(weights @ (variances + (errors - weights @ errors) ** 2))
    for y, believed in ((np.nan, 0.4), (0.0, 0.0)):
        assert np.isnan(innovate(1, y, seen, shares, believed)).all()


def test_the_belief_of_a_bank_is_the_mixture_of_its_modes_or_nan_without_probability() -> None:
    means, covariances = beliefs(3)
    states = np.array([packed(*pair) for pair in zip(means, covariances, strict=True)])
    overall, weights = np.empty(BELIEF), np.array([0.2, 0.3, 0.5])
    combine(-3.0, states, weights, np.empty(BELIEF), overall, **SIZES)
    assert overall == pytest.approx(mixture(means, covariances, weights))
    mean, covariance = np.empty(WIDTH), np.empty((WIDTH, WIDTH))
    unpack(overall, mean, covariance, WIDTH=WIDTH)
    assert mean == pytest.approx(weights @ means)
    np.testing.assert_array_equal(covariance, covariance.T)
    assert packed(mean, covariance) == pytest.approx(overall)
    combine(-np.inf, states, weights, np.empty(BELIEF), overall, **SIZES)
    assert np.isnan(overall).all()
