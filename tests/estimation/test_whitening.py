import numpy as np
import pytest

from estimation.whitening import block_weights, whitened


def walk_under_noise(n: int, variance: float, walk: float) -> np.ndarray:
    rng = np.random.default_rng(1)
    level = np.concatenate([[0.0], np.cumsum(np.sqrt(walk) * rng.standard_normal(n - 1))])
    return level + np.sqrt(variance) * rng.standard_normal(n)


def test_a_random_walk_under_white_noise_comes_out_white() -> None:
    n, variance, walk = 20_000, 4e-12, 1e-13
    values = walk_under_noise(n, variance, walk)
    out = whitened(values[:, None], block_weights(np.ones(n), variance, walk))[:, 0]
    assert np.mean(out**2) == pytest.approx(1.0, abs=0.05)
    assert abs(out[1:] @ out[:-1]) / (out @ out) < 0.03


def test_without_a_walk_residuals_are_only_scaled() -> None:
    values = np.arange(6.0).reshape(3, 2)
    np.testing.assert_allclose(whitened(values, block_weights(np.ones(3), 4.0, 0.0)), values / 2.0, rtol=1e-15)


def test_a_gap_counts_for_nothing_and_lets_the_walk_go_on() -> None:
    counts = np.array([1.0, 1.0, 0.0, 0.0, 1.0])
    weights = block_weights(counts, 1.0, 0.5)
    values = np.array([[0.0], [0.0], [1e9], [1e9], [3.0]])
    out = whitened(values, weights)[:, 0]
    assert out[2] == out[3] == 0.0
    assert weights.scale[4] < weights.scale[1]
    assert out[4] == pytest.approx(3.0 * weights.scale[4])
