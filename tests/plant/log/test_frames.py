"""Tables in memory are read like the same log from a file."""

import warnings
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from plant.errors import LogError, LogWarning
from plant.log.any_columns import read_any
from plant.log.files import read_record
from plant.log.frames import by_name, frame_table, is_frame
from plant.units import unit_registry

TIME = 0.01 * np.arange(400)
CHANNELS = {"motor_speed_rad_s": 90.0 + np.sin(TIME), "position_m": 0.01 * np.cos(TIME)}


def table(index: Any = None) -> pd.DataFrame:
    return pd.DataFrame(CHANNELS, index)


@pytest.mark.parametrize(
    "given",
    [
        pd.DataFrame({"time_s": TIME, **CHANNELS}),
        {"time_s": TIME, **CHANNELS},
        table(index=TIME),
        table(index=pd.Index(TIME, name="time_s")),
        table(index=pd.Index((1e3 * TIME).round().astype(int), name="time_ms")),
        pd.DataFrame({"time_s": pd.to_timedelta(TIME, unit="s"), **CHANNELS}),
        table(index=pd.to_timedelta(TIME, unit="s")),
        by_name(pa.Table.from_pandas(pd.DataFrame({"time_s": TIME, **CHANNELS}))),
        by_name(pd.DataFrame({"time_s": TIME, **CHANNELS}).to_records(index=False)),
        {name: values[:, None] for name, values in {"time_s": TIME, **CHANNELS}.items()} | {"__header__": b"MATLAB"},
        {name.encode(): values for name, values in {"time_s": TIME, **CHANNELS}.items()},
        pd.DataFrame({"time_s": TIME, **CHANNELS}, index=TIME + 7.0),
        pd.DataFrame({"time_s": TIME, **CHANNELS}, index=[f"row {k}" for k in range(400)]),
    ],
    ids=[
        "columns",
        "mapping",
        "index",
        "named index",
        "milliseconds",
        "durations",
        "index of durations",
        "Arrow",
        "records",
        "matrices of one column",
        "names of bytes",
        "column before index",
        "index of text",
    ],
)
def test_every_kind_of_table_in_memory_is_read(given: pd.DataFrame) -> None:
    record = read_record(frame_table(given))
    assert record.sample_time == pytest.approx(0.01, rel=1e-12)
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    for name, values in CHANNELS.items():
        np.testing.assert_array_equal(record[name], values)


@pytest.mark.parametrize("zone", [None, "Europe/Paris"])
@pytest.mark.parametrize("in_a_column", [False, True])
def test_a_column_or_index_of_dates_gives_time_and_the_start_date(zone: str | None, in_a_column: bool) -> None:
    stamps = pd.Timestamp("2026-11-25T10:00", tz=zone) + pd.to_timedelta(TIME, unit="s")
    given = table(index=stamps)
    if in_a_column:
        given = given.rename_axis("time_s").reset_index()
    record = read_record(frame_table(given))
    assert record.metadata["began"] == f"2026-11-25T{10 if zone is None else 9:02d}:00:00.000000Z"
    np.testing.assert_allclose(record.time - record.time[0], TIME, atol=1e-9)


def test_an_index_of_row_numbers_is_not_taken_for_time() -> None:
    chosen = pd.concat([table(), table()], ignore_index=True).iloc[::2]
    with pytest.raises(LogError, match=r"^the table: column time_s is missing.*without time, give --sample-time"):
        read_record(frame_table(chosen))
    with pytest.warns(LogWarning, match="no time column"):
        assert read_any(frame_table(chosen)).sample_time == 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read_any(frame_table(chosen), sample_time=0.01).sample_time == 0.01


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (pd.DataFrame(), "at least one row are needed, got an empty table"),
        (table().iloc[:0], "at least one row are needed, got an empty table"),
        ({}, "at least one row are needed, got an empty table"),
        ({"a": [1.0, 2.0], "b": [1.0]}, "columns of one length are needed, got a 2, b 1 samples"),
        (pd.concat([table(), table()], axis=1), "columns of different names are needed, got 'motor_speed_rad_s',"),
        (table().rename(columns={"motor_speed_rad_s": "position_m"}), "are needed, got 'position_m' more than once"),
    ],
)
def test_an_invalid_table_is_refused(given: pd.DataFrame, said: str) -> None:
    with pytest.raises(LogError, match=f"^the table: .*{said}"):
        frame_table(given)


def test_text_in_a_column_is_named() -> None:
    given = pd.DataFrame({"time_s": TIME, **CHANNELS}).astype({"position_m": object})
    given.loc[3:7, "position_m"] = "n/a?"
    with pytest.raises(LogError, match=r"^the table: column 'position_m' must hold numbers, got 'n/a\?' in row 4"):
        read_record(frame_table(given))


def test_one_text_in_a_hundred_rows_is_a_missing_sample() -> None:
    ramp = np.arange(100.0)
    given = pd.DataFrame({"time_s": 0.01 * ramp, "motor_speed_rad_s": ramp % 7, "position_m": 0.001 * ramp})
    given = given.astype({"position_m": object})
    given.loc[3, "position_m"] = "ERR"
    with pytest.warns(LogWarning) as caught:
        record = read_record(frame_table(given))
    assert "'ERR' in row 4" in str(caught[0].message)
    assert np.flatnonzero(np.isnan(record["position_m"])).tolist() == [3]


@pytest.mark.parametrize("how", ["datetime64", "text", "datetime", "zone"])
def test_a_column_of_dates_is_read_as_time_from_every_data_type(how: str) -> None:
    ramp = np.arange(100.0)
    dates = pd.Series(pd.Timestamp("2026-03-01 12:00:00") + pd.to_timedelta(0.25 * ramp, unit="s"))
    kept = {
        "datetime64": dates,
        "text": dates.astype(str),
        "datetime": pd.Series([one.to_pydatetime() for one in dates], dtype=object),
        "zone": pd.Series([one.tz_localize("Europe/Berlin") for one in dates], dtype=object),
    }[how]
    record = read_record(
        frame_table(pd.DataFrame({"Time": kept, "motor_speed_rad_s": ramp % 7, "position_m": 1e-3 * ramp}))
    )
    assert (record.sample_time, len(record)) == (pytest.approx(0.25), 100)


def test_only_pandas_objects_are_recognised_as_data_frames() -> None:
    assert is_frame(table())
    assert not any(is_frame(one) for one in (CHANNELS, np.zeros((3, 2)), "run.csv", None))


def test_a_lazy_query_and_an_unnamed_array_are_not_read_as_tables() -> None:
    class Query:
        columns: ClassVar = ["time_s"]

        def collect(self) -> None: ...

        def __getitem__(self, name: str) -> None: ...

    assert by_name(Query()) is None
    assert by_name(np.zeros((20, 3))) is None
    assert by_name({"time_s": TIME}) == {"time_s": TIME}


def test_masked_values_become_missing_samples() -> None:
    position = np.ma.masked_array(CHANNELS["position_m"].copy(), mask=np.arange(400) % 50 == 7)
    position.data[7::50] = 1e9
    with pytest.warns(LogWarning, match=r"position_m is missing in 8 of 400 samples"):
        record = read_record(frame_table({"time_s": TIME, **CHANNELS, "position_m": position}))
    np.testing.assert_array_equal(np.isnan(record["position_m"]), position.mask)


def test_quantities_are_converted() -> None:
    one = unit_registry().Quantity
    table = {
        "time_ms": one(TIME, "s"),
        "motor_speed_rad_s": one(CHANNELS["motor_speed_rad_s"], "rad/s").to("rpm"),
        "Weg": one(1e3 * CHANNELS["position_m"], "mm"),
    }
    record = read_record(frame_table(table), columns={"position_m": "Weg"})
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    for name, values in CHANNELS.items():
        np.testing.assert_allclose(record[name], values, rtol=1e-12)
    with pytest.raises(LogError, match="column 'position_m': Cannot convert"):
        frame_table({**table, "position_m": one(TIME, "s")})


def test_an_index_of_periods_is_time() -> None:
    record = read_record(frame_table(table(index=pd.period_range("2026-03-01", periods=400, freq="10ms"))))
    assert (record.sample_time, len(record)) == (pytest.approx(0.01), 400)


def test_a_list_of_lists_of_several_lengths_is_refused() -> None:
    with pytest.raises(LogError, match=r"column 'position_m' must be one-dimensional, got rows of several lengths"):
        frame_table({"time_s": [0.0, 1.0], "position_m": [[1.0, 2.0], [3.0]]})


def test_series_share_their_index_which_is_the_time_and_rows_that_do_not_belong_together_are_refused() -> None:
    whole = table(index=pd.Index(TIME, name="time_s"))
    series: dict[str, Any] = {name: whole[name] for name in whole}
    assert frame_table(series).headings[0].name == "time_s"
    counted = {"time_s": pd.Series(TIME), **series}
    np.testing.assert_array_equal(read_any(frame_table(counted))["position_m"], CHANNELS["position_m"])
    apart = {"motor_speed_rad_s": whole["motor_speed_rad_s"][:-5], "position_m": whole["position_m"][5:]}
    with pytest.raises(LogError, match="got other rows in position_m than in motor_speed_rad_s"):
        frame_table(apart)


def test_an_index_of_two_levels_is_no_time() -> None:
    levels = pd.MultiIndex.from_arrays([["a"] * 400, TIME])
    with pytest.raises(LogError, match=r"an index of one level is needed, got 2: use reset_index\(\)"):
        frame_table(table(index=levels))
    assert frame_table(table(index=levels).assign(time_s=TIME)).headings[-1].name == "time_s"
