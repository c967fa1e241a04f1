"""Groups of a LabVIEW file become tables with their units, time steps and start times."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.files import read_record
from plant.log.formats.tdms import open_tdms

nptdms = pytest.importorskip("nptdms")
START = np.datetime64("2026-03-01T12:00:00", "us")


def written(path: Path, *channels: tuple[str, str, Any, dict[str, Any]]) -> Path:
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject(*one) for one in channels])
    return path


def test_channels_of_one_length_and_step_are_one_table(tmp_path: Path) -> None:
    values = np.arange(20.0)
    path = written(
        tmp_path / "log.tdms",
        ("Bench", "Speed", values, {"unit_string": "rpm", "wf_increment": 0.01, "wf_start_time": START}),
        ("Bench", "Position", 2.0 * values, {"wf_increment": 0.01, "unit": "mm"}),
        ("Bench", "Slow", values[:5], {"wf_increment": 0.04}),
    )
    fast, slow = open_tdms(path)
    assert [(one.name, one.said) for one in fast.headings] == [("Speed", "rpm"), ("Position", "mm")]
    assert (fast.label, fast.step, fast.began) == ("Bench", 0.01, START)
    np.testing.assert_array_equal(fast.numbers()[1], 2.0 * values)
    assert ([one.name for one in slow.headings], slow.step, slow.began) == (["Slow"], 0.04, None)


def test_channels_with_different_start_times_are_aligned_in_time(tmp_path: Path) -> None:
    values, step = np.arange(40.0), 0.01
    later = START + np.timedelta64(50, "ms")
    path = written(
        tmp_path / "log.tdms",
        ("Bench", "motor_speed_rad_s", values, {"wf_increment": step, "wf_start_time": START}),
        ("Bench", "velocity_m_s", 1e-3 * values, {"wf_increment": step, "wf_start_time": later}),
        ("Bench", "position_m", 1e-3 * values, {"wf_increment": step, "wf_start_time": START, "wf_start_offset": 0.1}),
    )
    with pytest.warns(LogWarning, match="merged"):
        log = read_record(path)
    np.testing.assert_array_equal(log.channels["motor_speed_rad_s"], values[10:])
    np.testing.assert_allclose(log.channels["velocity_m_s"], 1e-3 * values[5:35])
    np.testing.assert_allclose(log.channels["position_m"], 1e-3 * values[:30])


def test_a_start_offset_belongs_to_its_channel_and_a_start_date_to_the_whole_group(tmp_path: Path) -> None:
    values, step = np.arange(40.0), {"wf_increment": 0.01}
    path = written(
        tmp_path / "log.tdms",
        ("Bench", "position_m", 1e-3 * values, step | {"wf_start_time": START, "wf_start_offset": 0.1}),
        ("Bench", "motor_speed_rad_s", values, step),
        ("Bench", "velocity_m_s", 1e-3 * values, step | {"wf_start_offset": 0.05}),
    )
    with pytest.warns(LogWarning, match="merged"):
        log = read_record(path)
    np.testing.assert_allclose(log.channels["position_m"], 1e-3 * values[:30])
    np.testing.assert_array_equal(log.channels["motor_speed_rad_s"], values[10:])
    np.testing.assert_allclose(log.channels["velocity_m_s"], 1e-3 * values[5:35])


def test_a_start_offset_without_a_date_is_the_start_time(tmp_path: Path) -> None:
    offset = {"wf_increment": 0.01, "wf_start_offset": 0.25}
    values = np.arange(20.0)
    channels = [("Bench", "motor_speed_rad_s", values, offset), ("Bench", "velocity_m_s", 1e-3 * values, offset)]
    assert read_record(written(tmp_path / "log.tdms", *channels)).start_time == pytest.approx(0.25)


@pytest.mark.parametrize("step", [0.0, -1.0, 1e7, "fast"])
def test_an_invalid_time_step_is_ignored(tmp_path: Path, step: Any) -> None:
    (table,) = open_tdms(written(tmp_path / "log.tdms", ("Bench", "Speed", np.arange(5.0), {"wf_increment": step})))
    assert table.step is None


@pytest.mark.parametrize("start", [np.datetime64("1904-01-01T00:00:00", "us"), "noon"])
def test_an_unset_or_invalid_start_date_is_ignored(tmp_path: Path, start: Any) -> None:
    (table,) = open_tdms(written(tmp_path / "log.tdms", ("Bench", "Speed", np.arange(5.0), {"wf_start_time": start})))
    assert table.began is None


def test_a_file_without_a_channel_is_refused(tmp_path: Path) -> None:
    with nptdms.TdmsWriter(tmp_path / "none.tdms") as writer:
        writer.write_segment([nptdms.RootObject({"operator": "A. N. Other"})])
    with pytest.raises(LogError, match=r"none\.tdms: it holds no channel"):
        open_tdms(tmp_path / "none.tdms")


class _Longer:
    """A channel that claims to have a thousand million samples."""

    name = "Speed"

    def __len__(self) -> int:
        return 10**9


def test_a_file_that_declares_more_samples_than_it_holds_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path / "log.tdms", ("Bench", "Speed", np.arange(5.0), {}))
    monkeypatch.setattr(nptdms.TdmsGroup, "channels", lambda _: [_Longer()])
    with pytest.raises(LogError, match=r"it ends before the 1000000000 samples that 'Speed' has"):
        open_tdms(path)
