"""A velocity that was filtered or derived with a delay is left out; position has the same information on time."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.late_velocity import without_late_velocity
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()
POSITION, VELOCITY = "position_m", "velocity_m_s"


def moving() -> Record:
    rng = np.random.default_rng(2)
    speed = make_drive("multisine", 4.0, 1e-3, HEALTHY, rng)
    return simulate(CIRCUIT, speed, 1e-3, HEALTHY, sensors=BENCH, rng=rng)


def with_play(position: Array, play: float) -> Array:
    out = np.empty_like(position)
    held = position[0]
    for i, value in enumerate(position):
        held = out[i] = min(max(held, value - 0.5 * play), value + 0.5 * play)
    return out


def lagged(values: Array, lag: float) -> Array:
    out = np.empty_like(values)
    out[0] = state = values[0]
    for i, value in enumerate(values[1:], 1):
        state += (value - state) * 1e-3 / lag
        out[i] = state
    return out


RECORD = moving()
LATE = {
    "lag": lagged(RECORD[VELOCITY], 8e-3),
    "delay": np.concatenate([np.full(8, RECORD[VELOCITY][0]), RECORD[VELOCITY][:-8]]),
}


@pytest.mark.parametrize("how", LATE)
def test_a_late_velocity_is_noted_and_not_used(how: str) -> None:
    log = clean_log(RECORD.replace(**{VELOCITY: LATE[how]}), HEALTHY)
    assert VELOCITY not in log.record
    (note,) = (one for one in log.left_out if one.code == SensorCode.VELOCITY_LATE)
    assert note.data["late_ms"] == pytest.approx(8.0, rel=0.15)


def test_a_late_velocity_with_filtered_noise_is_still_found() -> None:
    """Seven tenths of the difference from position are lateness; the rest is noise that the filter correlated."""
    wanders = lagged(3.5e-3 * np.random.default_rng(3).standard_normal(len(RECORD)), 8e-3)
    _, (note,) = without_late_velocity(RECORD.replace(**{VELOCITY: LATE["lag"] + wanders}))
    assert note.data["late_ms"] == pytest.approx(8.0, rel=0.25)


def test_a_late_velocity_is_found_under_fast_binary_noise() -> None:
    """Over 50 ms velocity changes slowly, and the effect of lateness is less than a sensor's allowed error."""
    turns = np.repeat(np.random.default_rng(6).choice([-0.02, 0.02], 200), 30)
    velocity = lagged(turns, 4e-3)
    position = 1e-3 * np.cumsum(velocity)
    late = Record(1e-3, {POSITION: position, VELOCITY: lagged(velocity, 1.5e-3)})
    assert [note.code for note in without_late_velocity(late)[1]] == [SensorCode.VELOCITY_LATE]


def test_a_velocity_on_time_stays() -> None:
    assert without_late_velocity(RECORD) == (RECORD, ())


def test_a_late_position_is_no_late_velocity() -> None:
    late = RECORD.replace(**{POSITION: lagged(RECORD[POSITION], 8e-3)})
    assert without_late_velocity(late) == (late, ())


def test_play_is_no_late_velocity() -> None:
    record = RECORD.replace(**{POSITION: with_play(RECORD[POSITION], 2e-4)})
    assert without_late_velocity(record) == (record, ())


def test_a_gain_that_is_wrong_is_no_lateness() -> None:
    record = RECORD.replace(**{VELOCITY: 0.8 * RECORD[VELOCITY]})
    assert without_late_velocity(record) == (record, ())


def test_without_position_no_late_velocity_is_found() -> None:
    alone = RECORD.replace(**{POSITION: None})
    assert without_late_velocity(alone) == (alone, ())


def test_a_late_velocity_with_a_missing_sample_is_found() -> None:
    record = moving()
    late = lagged(record[VELOCITY], 10e-3)
    late[10] = np.nan
    (note,) = without_late_velocity(record.replace(velocity_m_s=late))[1]
    assert note.code is SensorCode.VELOCITY_LATE
