"""What a sensor does not resolve raises no alarm, and hides no leak."""

import numpy as np
import pytest

from faults.watch.events import Alarm, Ready
from faults.watch.resolution import (
    BEFORE,
    COARSEST,
    LEAST_STEP,
    PLACE,
    PRESSURE,
    SPEED,
    TIGHTEST,
    WHITE,
    find_step,
    least_deviation,
    unresolved,
)
from faults.watch.watch import Watch
from plant.eha.model import EhaParameters

P, T = EhaParameters(), 1e-3
COUNT = 1e-6
"""A count of the encoder [m]."""


def steps_of(values: list[float], rating: float = 1.0) -> np.ndarray:
    steps = np.array([[np.nan] * 3, [np.inf] * 3])
    for value in values:
        find_step(value, rating, PLACE, steps)
    return steps


def test_the_smallest_step_is_that_of_an_encoder_and_missing_samples_make_none() -> None:
    steps = steps_of([0.0, 0.003, np.nan, 0.0035, 0.0035, 0.001, 0.002, 0.002 + 1e-9])
    assert steps[LEAST_STEP, PLACE] == pytest.approx(0.001)
    assert steps[BEFORE, PLACE] == pytest.approx(0.002)
    assert steps_of([0.0, 3.0, 1.0], rating=100.0)[LEAST_STEP, PLACE] == pytest.approx(0.02)


def test_rounding_is_that_of_the_channels_in_a_balance_and_a_set_point_is_no_rounding() -> None:
    steps = steps_of([0.0, 0.01])
    steps[LEAST_STEP, SPEED], steps[LEAST_STEP, PRESSURE] = 0.02, 0.04
    assert unresolved(0, 1, steps) == unresolved(0, 2, steps) == pytest.approx(1e-4 + 1e-4)
    assert unresolved(1, 2, steps) == pytest.approx(4e-4)
    steps[LEAST_STEP] = 1.01 * COARSEST
    assert unresolved(0, 1, steps) == unresolved(1, 2, steps) == 0.0
    assert unresolved(0, 1, steps_of([])) == 0.0


def test_a_class_of_nothing_but_rounding_scatters_like_white_noise_and_a_clear_one_as_it_does() -> None:
    assert least_deviation(1e-4, float(np.log(1e-4))) == pytest.approx(WHITE)
    assert least_deviation(1e-4, float(np.log(1e-6))) == pytest.approx(WHITE)
    assert least_deviation(1e-4, float(np.log(2e-4))) == pytest.approx(0.5 * WHITE)
    assert least_deviation(1e-4, float(np.log(1e-2))) == least_deviation(0.0, -800.0) == TIGHTEST


def creeping(leak_from: float, seconds: float) -> np.ndarray:
    """Return an actuator that moves by 20 counts at 5 Hz, creeps by a count in 50 s, and may lose a third of its speed.

    Nothing but the encoder rounds, and nothing else is noise.
    """
    time = T * np.arange(round(seconds / T))
    speed = 70.0 * np.sin(2.0 * np.pi * 5.0 * time)
    # friction holds the piston through most of a stroke
    velocity = 20.0 * COUNT * 2.0 * np.pi * 5.0 * np.clip(speed / 50.0, -1.0, 1.0) ** 3
    velocity = np.where(time < leak_from, velocity, 0.6 * velocity)
    position = np.round((np.cumsum(velocity) * T + COUNT * time / 50.0) / COUNT) * COUNT
    return np.column_stack([speed, position, np.zeros(len(time))])


def test_counts_that_change_as_the_piston_creeps_raise_no_alarm_and_a_leak_does() -> None:
    events = Watch(P, T, pressure=False, learning=60.0).take(creeping(250.0, 260.0))
    alarms = [event for event in events if isinstance(event, Alarm)]
    assert isinstance(events[0], Ready)
    assert [round(alarm.since) for alarm in alarms] == [250]
