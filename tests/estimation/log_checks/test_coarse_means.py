import numpy as np
import pytest

from estimation.log_checks.coarse_means import coarse_mean_variance

COUNT = 1e-4


def rounded(noise: float, speed: float) -> np.ndarray:
    """Return an encoder's reading, with noise before it is rounded [counts] and motion [counts a sample]."""
    rng = np.random.default_rng(1)
    return COUNT * np.round(np.arange(20_000) * speed + noise * rng.standard_normal(20_000))


def error_of_means(reading: np.ndarray, speed: float, rows: int) -> float:
    path = COUNT * speed * np.arange(len(reading))
    return float(np.std((reading - path).reshape(-1, rows).mean(axis=1)))


def test_a_mean_between_two_counts_is_as_wrong_as_one_sample() -> None:
    """Before, the noise of such means was taken for a tenth of it: the smallest step of a mean is that much smaller."""
    reading = rounded(0.0, 0.003)
    assert coarse_mean_variance(reading, 10) ** 0.5 == pytest.approx(error_of_means(reading, 0.003, 10), rel=0.1)


@pytest.mark.parametrize("speed", [0.0314, 0.0718, 0.171, 0.413, 0.711, 1.31])
def test_no_error_of_a_mean_is_larger(speed: float) -> None:
    reading = rounded(0.0, speed)
    assert coarse_mean_variance(reading, 10) ** 0.5 > error_of_means(reading, speed, 10)


def test_counts_that_pass_while_a_mean_is_taken_average() -> None:
    slow, fast = rounded(0.0, 0.05), rounded(0.0, 0.4)
    assert coarse_mean_variance(fast, 10) < 0.7 * coarse_mean_variance(slow, 10)
    assert coarse_mean_variance(fast, 10) ** 0.5 > error_of_means(fast, 0.4, 10)


def test_noise_of_a_count_averages_as_that_of_any_sensor() -> None:
    assert coarse_mean_variance(rounded(1.0, 0.01), 10) == 0.0


def test_a_log_whose_rows_are_not_averaged_has_none() -> None:
    assert coarse_mean_variance(rounded(0.0, 0.01), 1) == 0.0
    assert coarse_mean_variance(np.full(100, np.nan), 10) == 0.0
