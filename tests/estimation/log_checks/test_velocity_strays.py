"""A filtered velocity runs on after a piston stops, and wanders while it rests: the encoder is not frozen."""

import numpy as np
import pytest

from estimation.log_checks.sensor_check import shows_motion
from estimation.log_checks.velocity_strays import strays_unusually
from plant.arrays import Array
from plant.log.record import Record

DT = 1e-3
ROWS = np.arange(8000)
MOVING: Array = 0.05 * np.sin(np.pi * np.minimum(ROWS % 500, 380) / 380.0) * (-1.0) ** (ROWS // 500)
RESTS, INNER, SLIDES = slice(380, 500), slice(410, 470), slice(3050, 3300)


def filtered(values: Array, lag: float, order: int) -> Array:
    """Return values after ``order`` first-order lags [s] in series."""
    for _ in range(order):
        out, state = np.empty_like(values), values[0]
        for i, value in enumerate(values):
            state += (value - state) * DT / lag
            out[i] = state
        values = out
    return values


def log(lag: float, order: int) -> Record:
    rng = np.random.default_rng(4)
    velocity = filtered(MOVING + 1e-3 * rng.standard_normal(len(MOVING)), lag, order)
    return Record(DT, {"position_m": 1e-6 * np.round(1e6 * DT * np.cumsum(MOVING)), "velocity_m_s": velocity})


@pytest.mark.parametrize(("lag", "order"), [(8e-3, 1), (3e-3, 1), (4e-3, 2), (3e-3, 4)])
def test_a_filtered_velocity_shows_no_motion_of_a_piston_at_rest(lag: float, order: int) -> None:
    record = log(lag, order)
    assert not strays_unusually(record, INNER, 5e-6)
    assert not shows_motion(record, RESTS)[0]


@pytest.mark.parametrize(("lag", "order"), [(8e-3, 1), (3e-3, 4)])
@pytest.mark.parametrize("stop", [3300, 8000])
def test_a_filtered_velocity_shows_motion_that_a_frozen_encoder_misses(lag: float, order: int, stop: int) -> None:
    record, hold = log(lag, order), slice(SLIDES.start, stop)
    position = record["position_m"].copy()
    position[hold] = position[hold.start]
    assert shows_motion(record.replace(position_m=position), hold) == (True, False)


def test_velocity_is_believed_if_position_never_moves() -> None:
    record = log(3e-3, 1)
    assert strays_unusually(record.replace(position_m=np.zeros(len(record))), SLIDES, 5e-6)


@pytest.mark.parametrize("sample_time", [0.4, 1.0, 2.0])
def test_a_log_sampled_more_slowly_than_the_window_shows_no_unusual_strays(sample_time: float) -> None:
    place = np.repeat(np.cumsum(MOVING[::40]) * sample_time, 2)
    record = Record(sample_time, {"position_m": place, "velocity_m_s": np.gradient(place, sample_time)})
    assert not strays_unusually(record, slice(40, 44), 5e-6)
