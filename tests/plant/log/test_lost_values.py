"""Numbers that mark lost samples become missing samples, and no real value of a channel is mistaken for one."""

import numpy as np
import pytest

from plant.errors import LogWarning
from plant.log.any_columns import read_any
from plant.log.files import read_record
from plant.log.frames import frame_table
from plant.log.lost_values import without_lost
from plant.log.notes import LogCode

N = 400
COURSE = np.sin(0.1 * np.arange(N))


def with_marks(value: float, count: int = 5) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    course = COURSE.copy()
    course[100 : 100 + count] = value
    return course


@pytest.mark.parametrize("value", [-9999.0, -999.0, 32767.0, 1e30, float(np.float32(1e30)), 9.91e37])
def test_a_number_that_marks_lost_samples_becomes_missing_with_a_note(value: float) -> None:
    kept, said = without_lost(with_marks(value), "position_m")
    assert np.flatnonzero(np.isnan(kept)).tolist() == list(range(100, 105))
    assert said == [LogCode.LOST_VALUE.note(channel="position_m", value=value, count=5, total=N)]


def test_two_fifths_of_a_channel_may_be_lost() -> None:
    values = np.where(np.arange(N) % 5 < 2, -9999.0, COURSE)
    kept, said = without_lost(values, "position_m")
    assert int(np.isnan(kept).sum()) == len(said) * 160 == 160
    two_levels = np.where(np.arange(N) % 5 < 2, 999.0, 0.0)
    assert without_lost(two_levels, "position_m")[1] == []


@pytest.mark.parametrize(
    "values",
    [
        with_marks(-9998.0),
        with_marks(-9999.0, count=1),
        with_marks(-9999.0, count=210),
        np.where(np.arange(N) % 5 == 0, -9999.0, 1500.0 * COURSE),
        np.where(np.arange(N) % 80 == 0, -9999.0, 7000.0 * COURSE),
        np.clip(40000.0 * COURSE, -32768.0, 32767.0),
        np.full(N, -9999.0),
        np.full(N, np.nan),
    ],
    ids=["no such number", "once", "too often", "often and near", "in range", "clipped", "nothing else", "nothing"],
)
def test_values_that_may_be_measured_are_kept(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> None:
    kept, said = without_lost(values, "position_m")
    np.testing.assert_array_equal(kept, values)
    assert said == []


def test_markers_of_lost_samples_are_recognised_in_the_unit_of_the_log() -> None:
    table = {
        "time_s": 0.01 * np.arange(N),
        "Motor speed [rpm]": 900.0 * COURSE,
        "Position [mm]": with_marks(-9999.0),
        "Gain": with_marks(32767.0),
    }
    with pytest.warns(LogWarning) as said:
        record = read_record(frame_table(table))
    assert "position_m is -9999 in 5 of 400 samples, far from all others" in str(said[0].message)
    assert int(np.isnan(record["position_m"]).sum()) == 5
    with pytest.warns(LogWarning) as said:
        assert int(np.isnan(read_any(frame_table(table), ["Gain"])["Gain"]).sum()) == 5
    assert "Gain is 32767 in 5 of 400 samples" in str(said[0].message)
