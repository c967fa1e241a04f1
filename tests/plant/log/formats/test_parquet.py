"""Columns of Arrow tables are read by type: numbers, times, durations, and text that represents a time."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.feather as feather
import pyarrow.parquet as pq
import pytest

from plant.errors import LogError
from plant.log.columns import Column
from plant.log.files import read_record
from plant.log.formats import parquet
from plant.log.formats.parquet import open_feather, open_parquet

NOON = np.datetime64("2026-03-01T12:00:00", "us")
STAMPS = NOON + np.arange(4) * np.timedelta64(10, "ms")


def written(path: Path, kind: str, **columns: object) -> Path:
    table = pa.table(columns)
    pq.write_table(table, path) if kind == "parquet" else feather.write_feather(table, str(path))
    return path


@pytest.mark.parametrize("kind", ["parquet", "feather"])
def test_times_are_read_as_times_and_durations_as_seconds(tmp_path: Path, kind: str) -> None:
    when = pa.array([*STAMPS[:3], None], pa.timestamp("us"))
    path = written(
        tmp_path / f"log.{kind}",
        kind,
        when=when,
        since=pa.array((STAMPS - NOON).astype("timedelta64[ms]")),
        said=[str(one) for one in STAMPS],
        whole=pa.array([1, 2, None, 4], pa.int16()),
    )
    table = (open_parquet if kind == "parquet" else open_feather)(path)
    assert [one.stamped for one in table.headings] == [True, False, False, False]
    assert table.headings[1].said == "s"
    values = table.numbers()
    np.testing.assert_array_equal(values[0][:3], STAMPS[:3].astype("datetime64[ns]"))
    assert np.isnat(values[0][3])
    np.testing.assert_allclose(values[1], [0.0, 0.01, 0.02, 0.03])
    np.testing.assert_array_equal(values[2], STAMPS.astype("datetime64[ns]"))
    np.testing.assert_array_equal(values[3], [1.0, 2.0, np.nan, 4.0])


def test_other_text_in_a_column_of_times_is_refused_with_its_row(tmp_path: Path) -> None:
    said = [str(STAMPS[0]), "later", str(STAMPS[2])]
    table = open_parquet(written(tmp_path / "log.parquet", "parquet", said=said))
    with pytest.raises(LogError, match=r"log\.parquet: column 'said' must hold times, got 'later' in row 2"):
        table.read([Column(0, "said", "time_s")])


def test_a_text_column_is_not_among_the_columns_of_numbers(tmp_path: Path) -> None:
    table = open_parquet(written(tmp_path / "log.parquet", "parquet", who=["a", "b"], way=[1.0, 2.0]))
    assert list(table.numbers()) == [1]


@pytest.mark.parametrize("kind", ["parquet", "feather"])
def test_a_file_that_unpacks_beyond_the_limit_is_refused(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path / f"log.{kind}", kind, way=np.arange(100.0))
    opened = open_parquet if kind == "parquet" else open_feather
    assert len(opened(path).numbers()[0]) == 100
    monkeypatch.setattr(parquet, "most_unpacked", lambda _: 799)
    with pytest.raises(LogError, match="it unpacks to more than"):
        opened(path)


def test_a_column_of_nulls_is_missing_and_booleans_become_numbers(tmp_path: Path) -> None:
    table = open_parquet(written(tmp_path / "log.parquet", "parquet", none=pa.nulls(3), on=[True, None, False]))
    values = table.numbers()
    assert np.isnan(values[0]).all()
    np.testing.assert_array_equal(values[1], [1.0, np.nan, 0.0])


def test_a_wide_table_read_in_batches_of_columns_keeps_their_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parquet, "COLUMNS_AT_A_TIME", 3)
    wide = {f"c{place}": np.arange(4.0) + 10.0 * place for place in range(8)}
    pq.write_table(pa.table(wide), tmp_path / "wide.parquet")
    found = open_parquet(tmp_path / "wide.parquet").numbers()
    assert {place: values.tolist() for place, values in found.items()} == {
        place: values.tolist() for place, values in enumerate(wide.values())
    }


@pytest.mark.parametrize("kind", ["parquet", "feather"])
def test_a_duration_column_gives_the_same_time_whatever_unit_its_name_has(tmp_path: Path, kind: str) -> None:
    since = pa.array(np.arange(20) * 10, pa.duration("ms"))
    names = ["time_ms", "Time [us]", "elapsed_time"]
    course = 0.01 * np.arange(20.0)
    made = {name: {name: since, "motor_speed_rad_s": 90.0 * course, "position_m": course} for name in names}
    for name, columns in made.items():
        log = read_record(written(tmp_path / f"{name[:4]}.{kind}", kind, **columns))
        assert log.sample_time == pytest.approx(0.01), name


def test_a_column_name_with_a_dot_is_not_taken_for_a_struct_field(tmp_path: Path) -> None:
    inner = pa.array([{"b": 5.0}] * 4)
    path = tmp_path / "log.parquet"
    table = pa.table([inner, np.arange(4.0), np.arange(4.0) + 9.0, np.arange(4.0)], names=["a", "a.b", "c", "c"])
    pq.write_table(table, path)
    for many in (parquet.COLUMNS_AT_A_TIME, 2):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(parquet, "COLUMNS_AT_A_TIME", many)
            values = open_parquet(path).read([Column(place, "", f"true_{place}") for place in range(4)])
        assert [one[1] for one in values.values()] == [1.0, 10.0, 1.0]


@pytest.mark.parametrize("kind", [pa.time32("ms"), pa.time64("us")])
def test_times_of_day_continue_past_midnight(tmp_path: Path, kind: pa.DataType) -> None:
    of_day = pa.array([86_399_990, 0, None, 20], pa.int32()).cast(pa.time32("ms")).cast(kind)
    table = open_parquet(written(tmp_path / "log.parquet", "parquet", Time=of_day))
    assert table.headings[0].stamped
    (read,) = table.read([Column(0, "Time", "time_s")]).values()
    assert np.diff(read[[0, 1, 3]]).astype("timedelta64[ms]").astype(int).tolist() == [10, 20]
    assert np.isnat(read[2])
