"""Samples with jittering stamps go on a uniform clock: shifted along their slope, and kept on a sensor's quanta."""

import numpy as np
import pytest

from plant.log.clock.jitter import SLOPE_SAMPLES, grid_of, resampled, rounded_clock

TICKS = np.arange(40.0)
OFF = 0.05 * np.random.default_rng(1).uniform(-1.0, 1.0, 40)


def test_a_channel_with_a_single_value_has_no_value_after_resampling() -> None:
    grid = grid_of(TICKS + OFF)
    values = np.full(40, np.nan)
    values[3] = 1.0
    assert np.isnan(resampled(grid, TICKS + OFF, values)).all()
    assert len(resampled(grid, TICKS + OFF, values)) == len(grid.times)


@pytest.mark.parametrize("count", [SLOPE_SAMPLES - 1, SLOPE_SAMPLES])
def test_resampling_a_straight_line_with_few_samples_is_exact(count: int) -> None:
    time = (TICKS + OFF)[:count]
    grid = grid_of(time)
    np.testing.assert_allclose(resampled(grid, time, 2.0 * time + np.pi), 2.0 * grid.times + np.pi, atol=1e-12)


def test_resampling_a_constant_channel_is_exact() -> None:
    grid = grid_of(TICKS + OFF)
    np.testing.assert_array_equal(resampled(grid, TICKS + OFF, np.full(40, 0.1)), np.full(len(grid.times), 0.1))


def test_only_quantised_values_are_rounded_to_the_quantum_after_resampling() -> None:
    time = TICKS + OFF
    grid = grid_of(time)
    smooth, counts = np.sin(0.3 * time), np.round(8.0 * np.sin(0.3 * time)) / 4.0
    kept = resampled(grid, time, counts)
    np.testing.assert_array_equal(4.0 * kept, np.rint(4.0 * kept))
    assert np.abs(resampled(grid, time, smooth) - np.sin(0.3 * grid.times)).max() < 1e-3


@pytest.mark.parametrize(
    "time",
    [0.5 * TICKS, np.round(0.3 * TICKS)[::-1], TICKS + OFF],
    ids=["one step", "backward", "jitter"],
)
def test_time_stamps_that_rounding_does_not_explain_give_no_rounded_clock(time: np.ndarray) -> None:
    assert rounded_clock(time, TICKS) is None


@pytest.mark.parametrize("count", [600, 1050])
def test_the_sample_time_is_found_from_the_rows_at_which_coarse_stamps_change(count: int) -> None:
    ticks = np.arange(float(count))
    found = rounded_clock(0.1 * np.floor(ticks / 100.0), ticks)
    assert found is not None
    assert found[1] == pytest.approx(1e-3, rel=1e-9)


def test_stamps_so_small_that_their_squares_vanish_are_no_rounded_clock() -> None:
    time = np.repeat(1e-300 * np.arange(50.0), 2)
    assert rounded_clock(time, np.concatenate(([0.0], np.cumsum(np.diff(time))))) is None
