"""Jumps are detected at the right log, from the logs before and the next few after."""

import numpy as np
import pytest

from faults.trend.changes import FEWEST, JUMP, LATEST, jumps, stretches
from faults.trend.kalman import settings


@pytest.mark.parametrize("length", range(FEWEST, LATEST + 1))
def test_jumps_agree_with_a_plain_loop(length: int) -> None:
    rng = np.random.default_rng(length)
    values, stds = rng.standard_normal(40) + 12.0 * (np.arange(40) > 20), np.full(40, 0.3)
    expected = np.zeros(40, dtype=bool)
    for begin in range(FEWEST, 40 - length + 1):
        steps = np.abs(np.diff(values[:begin]))[-LATEST:]
        steps = np.concatenate([np.zeros(LATEST - len(steps)), steps])
        scatter = 1.4826 * np.median(steps) / np.sqrt(2.0)
        apart = abs(np.median(values[begin : begin + length]) - np.median(values[begin - FEWEST : begin]))
        expected[begin] = apart > JUMP * max(scatter, 0.3)
    assert jumps(values, stds, length).tolist() == expected.tolist()
    assert expected.any()


def test_a_series_of_few_logs_has_no_jump() -> None:
    assert not jumps(np.array([0.0, 9.0, 0.0]), np.ones(3), FEWEST).any()


def test_a_jump_is_detected_a_few_logs_later_and_not_before() -> None:
    values = np.where(np.arange(20) < 10, 0.0, 1.0) + 0.01 * np.random.default_rng(1).standard_normal(20)
    begins = [begin for begin, _ in stretches(np.arange(20.0), values, np.full(20, 0.02), (), settings())]
    assert begins[11] == 0
    assert set(begins[10 + LATEST :]) == {10}


def test_a_recorded_repair_starts_a_new_stretch_at_once() -> None:
    begins = [begin for begin, _ in stretches(np.arange(9.0), np.zeros(9), np.full(9, 0.02), (4,), settings())]
    assert begins == [0] * 4 + [4] * 5
