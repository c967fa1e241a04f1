"""Groups of an MDF file become tables, each with its own clock."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant.errors import LogError
from plant.log.columns import Column
from plant.log.formats import mdf
from plant.log.formats.mdf import open_mdf

asammdf = pytest.importorskip("asammdf")
TIME = 0.01 * np.arange(30)


def written(path: Path, *groups: list[tuple[str, str, Any]]) -> Path:
    with asammdf.MDF() as file:
        for channels in groups:
            signals = [asammdf.Signal(values, TIME, unit=unit, name=name) for name, unit, values in channels]
            file.append(signals, acq_name="bench" if len(channels) > 1 else None)
        return Path(file.save(path, overwrite=True))


@pytest.fixture(scope="module")
def two_groups(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mdf")
    return written(folder / "log.mf4", [("speed", "rpm", TIME), ("way", "", 2.0 * TIME)], [("force", "N", 3.0 * TIME)])


def test_a_group_is_a_table_with_its_clock_and_units(two_groups: Path) -> None:
    bench, other = open_mdf(two_groups)
    assert [(one.name, one.said) for one in bench.headings] == [("time", "s"), ("speed", "rpm"), ("way", None)]
    assert [(one.name, one.said) for one in other.headings] == [("time", "s"), ("force", "N")]
    assert other.label == "group 1"
    values = bench.numbers()
    np.testing.assert_allclose(values[0], TIME)
    np.testing.assert_allclose(values[2], 2.0 * TIME)


def test_a_group_larger_than_the_unpacking_limit_is_refused(two_groups: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with asammdf.MDF(two_groups) as file:
        largest = max(one.channel_group.samples_byte_nr * one.channel_group.cycles_nr for one in file.groups)
    assert largest >= 8 * len(TIME)
    monkeypatch.setattr(mdf, "most_unpacked", lambda _: largest - 1)
    with pytest.raises(LogError, match="it unpacks to more than"):
        open_mdf(two_groups)
    monkeypatch.setattr(mdf, "most_unpacked", lambda _: largest)
    assert len(open_mdf(two_groups)) == 2


def test_invalidation_bytes_count_toward_the_unpacking_limit(tmp_path: Path) -> None:
    path = written(tmp_path / "log.mf4", [("speed", "rpm", TIME), ("way", "", TIME)])
    with asammdf.MDF(path) as file:
        file.groups[0].channel_group.invalidation_bytes_nr = 0xFF000000  # the library would allocate as much
        with pytest.raises(LogError, match="it unpacks to more than"):
            mdf._tables(_Opened(file), path)


def test_a_file_without_a_channel_is_refused(tmp_path: Path) -> None:
    with asammdf.MDF() as file:
        path = Path(file.save(tmp_path / "none.mf4"))
    with pytest.raises(LogError, match=r"none\.mf4: it holds no channel"):
        open_mdf(path)


def test_a_group_with_only_a_clock_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "log.mf4", [("speed", "rpm", TIME), ("way", "", TIME)])
    with asammdf.MDF(path) as file:
        del file.groups[0].channels[1:]
        with pytest.raises(LogError, match="it holds no channel"):
            mdf._tables(_Opened(file), path)


class _Opened:
    """A stand-in for the library, with its file already open."""

    def __init__(self, file: Any) -> None:
        self._file = file

    def MDF(self, _: object) -> Any:  # noqa: N802  the library's name
        return self._file


def test_a_damaged_mdf_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "log.mf4").write_bytes(b"MDF     4.10" + bytes(200))
    with pytest.raises(LogError, match="cannot be read as mdf"):
        open_mdf(tmp_path / "log.mf4")


def test_a_sample_marked_invalid_is_missing_and_all_others_stay_at_their_rows(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    time, marks = 1e-3 * np.arange(50), np.arange(50)
    signals = [
        Signal(marks.astype(float), time, name=name, invalidation_bits=marks % 10 == lost)
        for name, lost in (("speed", 3), ("position", 7))
    ]
    with MDF(version="4.10") as file:
        file.append(signals)
        file.save(tmp_path / "log.mf4", overwrite=True)
    (table,) = open_mdf(tmp_path / "log.mf4")
    found = table.numbers()
    for place, lost in ((1, 3), (2, 7)):
        assert table.headings[place].name in ("speed", "position")
        np.testing.assert_array_equal(found[place], np.where(marks % 10 == lost, np.nan, marks))


@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_a_conversion_formula_is_evaluated_as_arithmetic_or_refused(tmp_path: Path, version: str) -> None:
    raw = np.arange(1, 31, dtype=np.int16)
    formulas = {"speed": "(X - 1)/100", "way": "pow(X, 2)", "force": "9**9**9**9", "other": "open(X).read()"}
    with asammdf.MDF(version=version) as file:
        for name, formula in formulas.items():
            file.append([asammdf.Signal(raw, TIME, unit="mm", name=name, conversion={"formula": formula})])
        path = Path(file.save(tmp_path / "log.mdf", overwrite=True))
    speed, way, *others = open_mdf(path)
    assert [one.said for one in (speed.headings[1], way.headings[1])] == ["mm", "mm"]
    np.testing.assert_allclose(speed.numbers()[1], 0.01 * (raw - 1.0))
    np.testing.assert_allclose(way.numbers()[1], raw.astype(float) ** 2)
    assert np.isposinf(others[0].numbers()[1]).all()
    with pytest.raises(LogError, match=r"channel 'other' is converted by 'open\(X"):
        others[1].read([Column(1, "other", "other")])


def test_a_group_whose_master_channel_is_an_angle_has_no_time(tmp_path: Path) -> None:
    signal = asammdf.Signal(TIME, TIME, name="speed", unit="rpm", master_metadata=("crank angle", 2))
    with asammdf.MDF(version="4.10") as file:
        file.append([signal])
        (table,) = open_mdf(Path(file.save(tmp_path / "log.mf4", overwrite=True)))
    assert [(one.name, one.said) for one in table.headings] == [("crank angle", "deg"), ("speed", "rpm")]


def test_channels_of_the_same_name_keep_their_device_names(tmp_path: Path) -> None:
    path = written(tmp_path / "log.mf4", [("way\\CAN", "mm", TIME), ("way\\XCP", "mm", 2.0 * TIME)])
    (table,) = open_mdf(path)
    assert [one.name for one in table.headings] == ["time", "way\\CAN", "way\\XCP"]
