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
def test_position_samples_at_the_end_of_the_range_are_taken_out(ends: tuple[float, float]) -> None:
    clipped = log(np.clip(COURSE, *ends))
    mended, (note,) = without_position_beyond_range(clipped)
    beyond = (ends[0] >= COURSE) | (ends[1] <= COURSE)
    np.testing.assert_array_equal(np.isnan(mended["position_m"]), beyond)
    assert (note.code, note.data["channel"], note.data["unit"]) == (SensorCode.SENSOR_CLIPPED, "position_m", "mm")
    assert note.data["percent"] == pytest.approx(100.0 * np.mean(beyond))


def test_a_piston_that_rests_at_its_farthest_position_is_not_taken_for_clipped() -> None:
    resting = np.clip(COURSE, -0.03, 0.03)
    record = log(resting, resting)
    assert without_position_beyond_range(record) == (record, ())


def test_an_encoder_frozen_at_its_farthest_position_is_not_taken_for_clipped() -> None:
    frozen = COURSE.copy()
    frozen[3100:] = -0.06
    record = log(frozen)
    assert without_position_beyond_range(record) == (record, ())
    frozen = COURSE.copy()
    frozen[230:500] = 0.06
    record = log(frozen)
    assert without_position_beyond_range(record) == (record, ())


def test_a_jump_of_twice_the_largest_step_is_no_end_of_a_range() -> None:
    clipped = np.clip(COURSE, -1.0, 0.03)
    step = float(np.abs(np.diff(COURSE)).max())
    for jump, ends_there in ((0.2, True), (2.0, False)):
        stays = np.where(clipped == 0.03, 0.03 + jump * step, clipped)
        assert bool(without_position_beyond_range(log(stays))[1]) is ends_there


def test_clipping_in_one_slow_period_is_found_beside_rests_at_a_stop() -> None:
    # in a slow first period the piston moves on; in five quick ones it rests at a stop
    free = 0.05 * np.sin(2.0 * np.pi * np.interp(TIME, [0.0, 1.5, 4.0], [0.0, 1.0, 6.0]))
    course = np.where(TIME < 1.5, free, np.minimum(free, 0.04))
    mended, notes = without_position_beyond_range(log(np.minimum(course, 0.04), course))
    assert len(notes) == 1
    assert np.isnan(mended["position_m"][free > 0.0401]).all()


@pytest.mark.parametrize("missing", ["position_m", "velocity_m_s"])
def test_without_position_or_velocity_nothing_is_found(missing: str) -> None:
    record = log(np.clip(COURSE, -0.03, 0.03)).replace(**{missing: None})
    assert without_position_beyond_range(record) == (record, ())


def test_a_still_or_mostly_missing_position_is_not_taken_for_clipped() -> None:
    still = log(np.zeros(4000))
    assert without_position_beyond_range(still) == (still, ())
    few = log(np.where(np.arange(4000) < 60, np.clip(COURSE, -1.0, 0.01), np.nan))
    assert without_position_beyond_range(few) == (few, ())
