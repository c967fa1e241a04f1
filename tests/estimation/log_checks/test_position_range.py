"""Position at the end of its sensor's range is left out; a piston at rest and a frozen encoder are not taken for it."""

import numpy as np
import pytest

from estimation.log_checks.position_range import without_position_beyond_range
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.sensors.sensors import differentiated

TIME: Array = 1e-3 * np.arange(4000.0)
COURSE: Array = 0.05 * np.sin(2.0 * np.pi * TIME)


def log(position: Array, course: Array = COURSE) -> Record:
    velocity = differentiated(course, 1e-3, 2e-3) + np.random.default_rng(5).normal(0.0, 1e-3, len(course))
    return Record(1e-3, {"position_m": np.round(position, 6), "velocity_m_s": velocity})


@pytest.mark.parametrize("ends", [(-0.03, 1.0), (-1.0, 0.03), (-0.03, 0.04)])
def test_the_samples_at_the_end_of_the_range_are_missing(ends: tuple[float, float]) -> None:
    clipped = log(np.clip(COURSE, *ends))
    mended, (note,) = without_position_beyond_range(clipped)
    beyond = (ends[0] >= COURSE) | (ends[1] <= COURSE)
    np.testing.assert_array_equal(np.isnan(mended["position_m"]), beyond)
    assert (note.code, note.data["channel"], note.data["unit"]) == (SensorCode.SENSOR_CLIPPED, "position_m", "m")


def test_a_piston_that_rests_at_its_farthest_is_believed() -> None:
    resting = np.clip(COURSE, -0.03, 0.03)
    record = log(resting, resting)
    assert without_position_beyond_range(record) == (record, ())


def test_an_encoder_that_freezes_at_its_farthest_is_left_to_the_check_of_frozen_ones() -> None:
    frozen = COURSE.copy()
    frozen[3100:] = -0.06
    record = log(frozen)
    assert without_position_beyond_range(record) == (record, ())
    frozen = COURSE.copy()
    frozen[230:500] = 0.06
    record = log(frozen)
    assert without_position_beyond_range(record) == (record, ())


def test_without_a_velocity_nothing_is_found() -> None:
    record = log(np.clip(COURSE, -0.03, 0.03)).replace(velocity_m_s=None)
    assert without_position_beyond_range(record) == (record, ())
