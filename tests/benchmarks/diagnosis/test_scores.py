import numpy as np
import pytest

from benchmarks.diagnosis.scores import alarm_rate, median_delay
from plant.errors import HydrostateError


def test_the_alarm_rates_interval_without_alarms_runs_from_zero_to_3_7_over_the_time() -> None:
    rate, (low, high) = alarm_rate(0, 10.0)
    assert (rate, low) == (0.0, 0.0)
    assert high == pytest.approx(-np.log(0.025) / 10.0)


def test_the_rates_interval_covers_the_true_rate() -> None:
    counts = np.random.default_rng(0).poisson(30.0, 2000)
    covered = [low <= 1.0 <= high for _, (low, high) in (alarm_rate(int(count), 30.0) for count in counts)]
    assert 0.94 <= np.mean(covered) <= 0.985


def test_the_medians_interval_covers_the_true_median() -> None:
    draws = np.random.default_rng(1).exponential(1.0, (2000, 40))
    covered = [low <= np.log(2.0) <= high for _, (low, high) in (median_delay(list(row)) for row in draws)]
    assert 0.94 <= np.mean(covered) <= 0.985


def test_a_fault_that_was_not_found_counts_as_an_infinite_delay() -> None:
    assert median_delay([0.1, 0.2, float("inf"), float("inf"), float("inf")])[0] == float("inf")


@pytest.mark.parametrize("given", [(-1, 1.0), (1, 0.0)])
def test_impossible_counts_are_refused(given: tuple[int, float]) -> None:
    with pytest.raises(HydrostateError, match="alarm rate"):
        alarm_rate(*given)


def test_an_empty_list_of_delays_is_refused() -> None:
    with pytest.raises(HydrostateError, match="got none"):
        median_delay([])
