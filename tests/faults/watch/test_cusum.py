"""The CUSUM against Page's own expression, and thresholds from censored peaks."""

import math

import numpy as np
import pytest

from faults.watch.cusum import PEAK, SUM, accumulate, threshold, white_threshold


def test_the_cusum_is_the_largest_sum_over_all_starting_points() -> None:
    rises = np.random.default_rng(1).standard_normal(300)
    score, peaks, width = np.zeros(4), np.zeros(400), 0.02
    sums: list[float] = []
    for u in rises:
        accumulate(score, peaks, u, 0.5, width)
        sums.append(score[SUM])
    total = np.concatenate([[0.0], np.cumsum(rises - 0.5)])
    assert sums == pytest.approx(total[1:] - np.minimum.accumulate(total)[1:], abs=1e-12)
    at_rest = np.flatnonzero(np.array(sums) == 0.0)
    heights = [max(part) for part in np.split(np.array(sums), at_rest) if part.any()]
    open_at_the_end = heights.pop() if sums[-1] > 0.0 else 0.0
    assert score[PEAK] == open_at_the_end
    assert np.flatnonzero(peaks).tolist() == sorted({int(height / width) for height in heights})
    assert peaks.sum() == len(heights)


def test_a_peak_above_all_levels_counts_in_the_highest_level() -> None:
    score, peaks = np.zeros(4), np.zeros(10)
    for u in (9.0, -20.0):
        accumulate(score, peaks, u, 0.5, 0.02)
    assert peaks.tolist() == [0.0] * 9 + [1.0]


WIDTH, SCALE = 0.02, 0.7


def counted(heights: np.ndarray) -> np.ndarray:
    return np.bincount((heights / WIDTH).astype(int), minlength=1000).astype(np.float64)


def test_alarms_count_as_peaks_of_at_least_the_threshold() -> None:
    count, alarms = 20_000, 40
    heights = -SCALE * np.log((np.arange(count) + 0.5) / count)
    seen = counted(heights[alarms:])  # the highest peaks ended in alarms, and only that is known of them
    level = threshold(seen, float(alarms), WIDTH, float(alarms))
    assert level == pytest.approx(SCALE * math.log(count / alarms), abs=0.02)
    blind = threshold(seen, 0.0, WIDTH, float(alarms))
    assert blind < level - 0.05


def test_white_noise_exceeds_its_threshold_at_the_requested_rate() -> None:
    rng, expected = np.random.default_rng(3), 1e-3
    nis = np.log(rng.chisquare(10, 400_000) / 10.0)
    score, peaks, level = np.zeros(4), np.zeros(401), white_threshold(expected)
    for u in (nis - nis.mean()) / nis.std():
        accumulate(score, peaks, float(u), 1.0, 0.02)
    assert peaks[round(level / 0.02) :].sum() == pytest.approx(400, rel=0.2)
    assert white_threshold(0.5) == 1.0


def test_a_stream_without_peaks_has_no_threshold() -> None:
    assert threshold(np.zeros(50), 3.0, WIDTH, 0.1) == math.inf
    assert threshold(np.zeros(50), 0.0, WIDTH, 0.1) == math.inf


def test_the_threshold_is_the_lowest_peak_if_more_alarms_are_allowed_than_there_are_peaks() -> None:
    peaks = np.zeros(50)
    peaks[[10, 30]] = 15.0
    assert threshold(peaks, 0.0, WIDTH, 100.0) == pytest.approx(10 * WIDTH)
