"""Levels, forecasts, alarms and segments of simulated actuators."""

from dataclasses import replace

import numpy as np
import pytest

from faults.trend.crossing import HORIZON, crossing
from faults.trend.kalman import exponential_growth, first_belief
from faults.trend.trend import Series, Trend, trends
from plant.arrays import Array
from tests.faults.trend.small_beliefs import one_setting


def last_trend(series: Series) -> Trend:
    """Return the trend of a series after its last log."""
    return [*trends(series)][-1]


def series_of(truth: Array, std: float = 0.04, seed: int = 0) -> Series:
    noise = std * np.random.default_rng(seed).standard_normal(len(truth))
    return Series(np.arange(len(truth), dtype=np.float64), truth + noise, np.full(len(truth), std), 0.0, 1.0)


@pytest.mark.parametrize("rate", [0.33, 0.5, 1.0])
def test_growth_to_the_limit_within_a_few_logs_is_followed_and_not_taken_for_a_jump(rate: float) -> None:
    truth = growth(8, rate)
    for seed in range(3):
        found = last_trend(series_of(truth, std=0.02, seed=seed))
        assert found.begin == 0
        assert found.level[0] == pytest.approx(truth[-1], rel=0.02)
        assert found.growth[0] == pytest.approx(rate, rel=0.05)


def growth(count: int = 40, rate: float = 0.02) -> Array:
    return rate * np.arange(count, dtype=np.float64)


def scaled_by(series: Series, size: float, healthy: float, stretch: float) -> Series:
    return Series(
        stretch * series.times, healthy + size * series.values, abs(size) * series.stds, healthy, healthy + size
    )


def test_level_and_growth_rate_of_a_steadily_growing_fault_are_estimated() -> None:
    found = last_trend(series_of(growth()))
    (level, level_std), (rate, rate_std) = found.level, found.growth
    assert abs(level - 0.78) < 3.0 * level_std < 0.15
    assert abs(rate - 0.02) < 3.0 * rate_std < 0.03


def test_the_forecast_contains_the_crossing_and_its_intervals_are_nested() -> None:
    found = last_trend(series_of(growth()))
    assert found.crossing is not None
    least, low, middle, high, most = found.crossing.quantiles
    assert least <= low <= middle <= high <= most
    assert least < 11.0 < most
    assert abs(middle - 11.0) < 5.0


@pytest.mark.parametrize(("size", "healthy", "stretch"), [(-4.1e7, 2.07e8, 7.0), (2.5, 1.1, 0.1)])
def test_the_forecast_does_not_depend_on_units_or_on_the_sign_of_a_severity(
    size: float, healthy: float, stretch: float
) -> None:
    plain = series_of(growth())
    one, other = last_trend(plain), last_trend(scaled_by(plain, size, healthy, stretch))
    assert one.crossing is not None
    assert other.crossing is not None
    assert other.crossing.quantiles == pytest.approx(one.crossing.quantiles)
    assert other.level[0] == pytest.approx(healthy + size * one.level[0])
    assert other.growth[1] == pytest.approx(abs(size) * one.growth[1])


def first_alarm(series: Series) -> int | None:
    return next((trend.place for trend in trends(series) if trend.alarm), None)


def test_a_growing_actuator_raises_an_alarm_well_before_its_limit() -> None:
    places = [first_alarm(series_of(growth(50), seed=seed)) for seed in range(5)]
    assert all(place is not None and place <= 40 for place in places)


def test_a_steady_actuator_raises_no_alarm_even_with_one_grossly_wrong_log() -> None:
    for seed in range(5):
        series = series_of(np.zeros(60), seed=seed)
        series.values[30] += 1.5
        assert first_alarm(series) is None


def test_an_actuator_beyond_its_limit_from_the_start_is_in_alarm_at_the_first_forecast() -> None:
    assert first_alarm(series_of(np.full(10, 1.5))) == 3


def test_a_jump_starts_a_new_stretch_and_is_not_taken_for_growth() -> None:
    truth = np.where(np.arange(40) < 25, 0.1, 0.6)
    found = last_trend(series_of(truth, std=0.02))
    assert 24 <= found.begin <= 26
    assert found.level[0] == pytest.approx(0.6, abs=0.05)
    assert not found.certain


def test_a_jump_before_the_third_log_is_not_taken_for_certain_growth() -> None:
    """Before, six logs of which the first was lower were "certain growth" with a date, in 10 of 30 such actuators."""
    for jumped in (1, 2):
        truth = np.where(np.arange(8) < jumped, 0.0, 0.6)
        found = [*trends(series_of(truth, std=0.03, seed=jumped))]
        assert not any(one.certain or one.alarm for one in found)
        assert found[3].crossing is not None
        assert np.isinf(found[3].crossing.quantiles[3])


def in_bursts(count: int = 60, apart: float = 50.0) -> Array:
    """Return times of logs that come six at a time, some minutes apart, with a pause of weeks between [day]."""
    place = np.arange(count)
    return apart * (place // 6) + 0.003 * (place % 6)


def test_growth_between_bursts_of_logs_raises_an_alarm() -> None:
    """Before, the unit of time was the minutes within a burst: the forecast overflowed, or no growth was ever seen."""
    times = in_bursts()
    for seed in range(3):
        plain = series_of(0.0022 * times, seed=seed)
        place = first_alarm(replace(plain, times=times))
        assert place is not None
        assert 0.0022 * times[place] < 0.95
        assert first_alarm(replace(series_of(np.zeros(60), seed=seed), times=times)) is None


def test_a_jump_between_two_bursts_of_logs_is_not_certain_growth() -> None:
    series = replace(series_of(np.where(np.arange(12) < 6, 0.0, 0.6), std=0.03), times=in_bursts(12))
    assert not any(one.certain for one in trends(series))


def test_steady_growth_is_one_stretch() -> None:
    assert [last_trend(series_of(growth(60), seed=seed)).begin for seed in range(5)] == [0] * 5


def test_a_repair_resets_the_trend_even_without_a_jump() -> None:
    truth = np.concatenate([growth(30, 0.01), np.full(15, 0.29)])
    series = series_of(truth)
    found = last_trend(replace(series, maintained=(29.5, 99.0)))
    assert found.begin == 30
    assert not found.alarm


def test_the_first_three_logs_have_no_forecast() -> None:
    found = [*trends(series_of(growth(6)))]
    assert [one.crossing is None for one in found] == [True] * 3 + [False] * 3


def test_the_trend_after_a_log_does_not_depend_on_later_logs() -> None:
    series = series_of(growth(30))
    early = Series(series.times[:20], series.values[:20], series.stds[:20], 0.0, 1.0)

    def numbers(found: Trend) -> tuple[float, float]:
        return found.level[0], found.growing

    assert numbers(last_trend(early)) == numbers([*trends(series)][19])


def test_the_trend_after_one_log_can_be_kept_without_those_after_the_others() -> None:
    *_, found = trends(series_of(growth(30)))
    alone = found.alone
    assert found.belief.mean.base is not None
    assert all(each.base is None for each in (alone.belief.mean, alone.belief.covariance, alone.belief.evidence))
    assert (alone.level, alone.growing, alone.alarm) == (found.level, found.growing, found.alarm)


def test_a_known_slope_without_noise_crosses_at_a_known_time() -> None:
    grid = one_setting(slope=1e-9)
    start = first_belief(grid)
    belief = replace(start, mean=np.array([[0.2, 0.05, 0.0]]), covariance=np.zeros((1, 3, 3)))
    found = crossing(belief, grid, np.random.default_rng(0))
    assert found.quantiles == pytest.approx([16.0] * 5)
    assert (found.within(15.9), found.within(16.1)) == (0.0, 1.0)
    resting = replace(belief, mean=np.array([[0.2, 0.0, 0.0]]))
    assert np.all(np.isinf(crossing(resting, grid, np.random.default_rng(0)).quantiles))
    late = replace(belief, mean=np.array([[0.2, 0.7 / HORIZON, 0.0]]))
    assert crossing(late, grid, np.random.default_rng(0)).within(HORIZON) == 0.0


def test_a_share_of_the_futures_rests() -> None:
    grid = one_setting(slope=1e-9)
    belief = replace(first_belief(grid), mean=np.array([[0.2, 0.05, 0.0]]), covariance=np.zeros((1, 3, 3)))
    found = crossing(belief, grid, np.random.default_rng(0), resting=0.3)
    assert found.within(HORIZON) == pytest.approx(0.7)


def test_constant_curvature_crosses_the_limit_with_its_parabola() -> None:
    grid = one_setting(slope=1e-9)
    belief = replace(first_belief(grid), mean=np.array([[0.0, 0.0, 0.02]]), covariance=np.zeros((1, 3, 3)))
    assert crossing(belief, grid, np.random.default_rng(0)).quantiles[2] == pytest.approx(10.0)


def test_exponential_growth_crosses_the_limit_with_its_exponential() -> None:
    grid = one_setting(pace=0.05, slope=1e-9)
    belief = replace(first_belief(grid), mean=np.array([[0.1, 0.01, 0.0]]), covariance=np.zeros((1, 3, 3)))
    expected = np.log1p(0.9 * 0.05 / 0.01) / 0.05  # solves 0.1 + 0.01 expm1(0.05 t) / 0.05 = 1
    assert crossing(belief, grid, np.random.default_rng(0)).quantiles == pytest.approx([expected] * 5, abs=0.02)


def test_forecasts_of_exponential_growth_scatter_according_to_its_process_noise() -> None:
    grid = one_setting(pace=0.1, slope=1e-9, bend=0.004)
    belief = replace(first_belief(grid), mean=np.array([[0.0, 0.02, 0.0]]), covariance=np.zeros((1, 3, 3)))
    rise, spread = exponential_growth(20.0, 0.1)
    limit = 0.02 * rise[0] + 0.004 * np.sqrt(spread[0, 0])  # one deviation above the mean after 20 logs
    found = crossing(belief, grid, np.random.default_rng(0), float(limit))
    assert found.within(20.0) == pytest.approx(0.16, abs=0.05)


@pytest.mark.parametrize(
    "changes",
    [{"times": np.array([1.0, 0.0])}, {"limit": 0.0}, {"values": np.empty(0)}],
    ids=["order", "limit", "empty"],
)
def test_an_unordered_or_empty_series_or_one_without_a_limit_is_refused(changes: dict[str, object]) -> None:
    good = Series(np.arange(2.0), np.zeros(2), np.ones(2), 0.0, 1.0)
    with pytest.raises(ValueError, match="a series needs logs in the order of time"):
        replace(good, **changes)  # pyright: ignore[reportArgumentType]


def total_of(series: Series, common: Array | None) -> tuple[Array, Array]:
    """Return the crossing time's quantiles without an error that all logs share, and with it."""
    found = last_trend(replace(series, common=common))
    assert found.crossing is not None
    assert found.total_crossing is not None
    return found.crossing.quantiles, found.total_crossing.quantiles


def test_an_error_that_all_logs_share_widens_the_interval_of_the_crossing_and_leaves_its_median() -> None:
    series = series_of(growth())
    own, same = total_of(series, None)
    assert same == pytest.approx(own)
    own, wide = total_of(series, np.full((40, 2), 0.1))
    assert wide[2] == pytest.approx(own[2], abs=1.0)
    assert wide[0] < own[0] - 2.0  # 1.645 x 0.1 of the distance to the limit is 8 logs at 0.02 a log
    assert wide[4] > own[4] + 2.0


@pytest.mark.parametrize("size", [1.0, -1.0])
def test_a_shared_error_towards_the_limit_brings_the_crossing_nearer_alone(size: float) -> None:
    """True values may be larger than the logs tell: early if the severity rises to its limit, late if it falls."""
    plain = series_of(growth())
    series = replace(plain, values=size * plain.values, limit=size)
    own, total = total_of(series, np.tile([0.0, 0.15], (40, 1)))
    moved = total - own
    assert (moved[0] < -2.0, moved[4] > 2.0) == ((True, False) if size > 0.0 else (False, True))


def test_intervals_with_the_shared_error_cover_where_those_without_it_do_not() -> None:
    rng = np.random.default_rng(11)
    covered = np.zeros(2)
    for seed in range(40):
        shift = 0.25 * rng.standard_normal()
        found = total_of(series_of(growth() - shift, 0.02, seed), np.full((40, 2), 0.25))
        covered += [ends[0] <= 50.0 - 39.0 <= ends[4] for ends in found]
    assert covered[0] < 0.75 * 40
    assert covered[1] >= 0.85 * 40


@pytest.mark.parametrize("size", [1.0, -1.0])
def test_the_level_is_as_unsure_as_its_logs_and_their_shared_error(size: float) -> None:
    plain = series_of(growth())
    series = replace(plain, values=size * plain.values, limit=size)
    own = last_trend(series)
    assert own.level_deviations == pytest.approx([own.level[1]] * 2)
    total = last_trend(replace(series, common=np.tile([0.3, 0.1], (40, 1))))
    assert total.level == own.level
    assert total.level_deviations == pytest.approx([np.hypot(own.level[1], 0.3), np.hypot(own.level[1], 0.1)])


@pytest.mark.parametrize(
    ("truth", "when"),
    [(0.8 * -np.expm1(-np.arange(9.0) / 3.0), np.inf), (0.03 * np.expm1(0.3 * np.arange(9.0)), 3.79)],
    ids=["run-in below the limit", "exponential"],
)
def test_wear_that_levels_off_or_doubles_within_a_few_logs_is_in_the_interval(truth: Array, when: float) -> None:
    """Before, in 0 of 10 each: run-in was promised to reach the limit in 2 logs, exponential growth in 13."""
    covered = 0
    for seed in range(10):
        found = last_trend(series_of(truth, 0.03, seed)).crossing
        assert found is not None
        covered += found.quantiles[0] <= when <= found.quantiles[4]
    assert covered >= 8
