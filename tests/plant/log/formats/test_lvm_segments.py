"""Tests of LabVIEW measurement files of several segments."""

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.files import read_record
from plant.log.notes import LogCode
from plant.log.record import Record
from plant.notes import Code

ABOVE = ("LabVIEW Measurement", "Separator\tTab", "X_Columns\tOne", "***End_of_Header***", "")
TIME = 1e-3 * np.arange(400.0)
SPEED, WAY = 9.0 * np.sin(30.0 * TIME), 50.0 - 50.0 * np.cos(30.0 * TIME)


def segment(begin: int, end: int, stamp: str, *, restart: bool, unit: str = "mm", name: str = "Position") -> list[str]:
    """Return the lines of a segment: its header, and rows from one to another."""
    zero = TIME[begin] if restart else 0.0
    rows = zip(TIME[begin:end] - zero, SPEED[begin:end], WAY[begin:end], strict=True)
    return [
        "Channels\t2\t\t",
        f"Samples\t{end - begin}\t{end - begin}\t",
        "Date\t2026/03/12\t2026/03/12\t",
        f"Time\t{stamp}\t{stamp}\t",
        f"Y_Unit_Label\trpm\t{unit}\t",
        "X0\t0.0\t0.0\t",
        "Delta_X\t0.001\t0.001\t",
        "***End_of_Header***\t\t\t",
        f"X_Value\tMotor speed\t{name}\tComment",
        *(f"{one:.6f}\t{two:.9f}\t{three:.9f}\t" for one, two, three in rows),
        "",
    ]


def read(folder: Path, *segments: Sequence[str]) -> tuple[Record, list[Code]]:
    path = folder / "log.lvm"
    path.write_text("\n".join([*ABOVE, *(line for one in segments for line in one)]))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        record = read_record(path)
    return record, [one.message.note.code for one in caught if isinstance(one.message, LogWarning)]


@pytest.mark.parametrize("restart", [False, True])
def test_segments_are_one_log_whether_their_time_goes_on_or_begins_again(tmp_path: Path, restart: bool) -> None:
    stamps = ("10:11:12.5", "10:11:12.6500", "10:11:12.8")
    ends = ((0, 150), (150, 300), (300, 400))
    parts = [segment(*two, one, restart=restart) for one, two in zip(stamps, ends, strict=True)]
    record, codes = read(tmp_path, *parts)
    np.testing.assert_allclose(record["position_m"], 1e-3 * WAY, atol=1e-12)
    assert record.sample_time == pytest.approx(1e-3)
    assert [one for one in codes if one != LogCode.TRAVEL_UNITS] == [
        LogCode.LINES_SKIPPED,
        *[LogCode.SEGMENTS_JOINED] * restart,
    ]


def test_a_pause_between_segments_is_a_gap(tmp_path: Path) -> None:
    later = segment(200, 400, "10:11:12.205", restart=True)
    record, _ = read(tmp_path, segment(0, 200, "10:11:12.000", restart=True), later)
    assert len(record) == 405
    assert np.isnan(record["position_m"][200:205]).all()
    np.testing.assert_allclose(record["position_m"][205:], 1e-3 * WAY[200:], atol=1e-12)


@pytest.mark.parametrize("stamp", ["10:11:12", "", "10:11:11.9"])
def test_a_segment_whose_stamp_does_not_place_it_behind_the_last_is_refused(tmp_path: Path, stamp: str) -> None:
    with pytest.raises(LogError, match="time_s must increase, got"):
        read(tmp_path, segment(0, 200, "10:11:12", restart=True), segment(200, 400, stamp, restart=True))


@pytest.mark.parametrize("other", [{"unit": "um"}, {"name": "Way"}])
def test_a_segment_of_other_names_or_units_is_refused(tmp_path: Path, other: dict[str, str]) -> None:
    with pytest.raises(LogError, match="another header"):
        read(tmp_path, segment(0, 200, "1:0:0", restart=False), segment(200, 400, "1:0:0", restart=False, **other))


def test_segments_without_a_time_are_refused(tmp_path: Path) -> None:
    whole = [segment(0, 200, "1:00:00", restart=True), segment(200, 400, "1:00:01", restart=True)]
    without = [[line.replace("\t", "\t", 1) for line in one] for one in whole]
    path = tmp_path / "log.lvm"
    lines = [*ABOVE, *(line for one in without for line in one)]
    path.write_text("\n".join(lines).replace("X_Columns\tOne", "X_Columns\tNo"))
    with pytest.raises(LogError, match="another header"):
        read_record(path)
