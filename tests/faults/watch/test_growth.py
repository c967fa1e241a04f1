import numpy as np
import pytest

from faults.watch.growth import growth_time

ENDS = 10.0 * np.arange(1, 201)


@pytest.mark.parametrize("seed", range(5))
def test_growth_is_dated_to_the_start_of_its_slope(seed: int) -> None:
    noise = 0.002 * np.random.default_rng(seed).standard_normal(len(ENDS))
    since, (low, high) = growth_time(0.07 + 1e-4 * np.maximum(ENDS - 1000.0, 0.0) + noise, ENDS)
    assert since == pytest.approx(1000.0, abs=60.0)
    assert low <= 1000.0 <= high
    assert high - low < 400.0


def test_a_jump_is_dated_to_its_span() -> None:
    noise = 0.002 * np.random.default_rng(9).standard_normal(len(ENDS))
    since, interval = growth_time(np.where(ENDS > 1950.0, 0.3, 0.07) + noise, ENDS)
    assert since == 1950.0
    assert interval == pytest.approx((1930.0 - 5.0, 1970.0 + 5.0))


def test_drifting_oil_widens_the_interval_of_the_growth_time() -> None:
    rise = 0.07 + 1e-4 * np.maximum(ENDS - 1000.0, 0.0)
    white = 0.002 * np.random.default_rng(3).standard_normal(len(ENDS))
    drift = 0.002 * np.sin(ENDS / 60.0) * np.sqrt(2.0)
    widths = [high - low for _, (low, high) in (growth_time(rise + one, ENDS) for one in (white, drift))]
    assert widths[1] > 1.2 * widths[0]


def test_slowly_drifting_oil_leaves_a_bounded_interval_of_the_growth_time() -> None:
    rise = 0.07 + 3e-4 * np.maximum(ENDS - 1000.0, 0.0)
    since, (low, high) = growth_time(rise + 0.01 * np.sin(ENDS / 200.0), ENDS)
    assert low < 1000.0 < high
    assert since - low < 200.0  # a fifth of the time before it
    assert high - since < 200.0


def test_the_growth_time_of_two_levels_has_the_interval_that_they_span() -> None:
    assert growth_time(np.array([0.1, 0.4]), np.array([10.0, 20.0])) == (10.0, (10.0, 20.0))
