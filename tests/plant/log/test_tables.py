"""The tables of one log: which one gives each channel, and which clock the rows have."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from plant.errors import LogError, MissingColumnError
from plant.log.notes import LogCode
from plant.log.table import Table, table_of
from plant.log.tables import gather_channels, resolve_tables

TIME = 0.01 * np.arange(50)
NOON = np.datetime64("2026-03-01T12:00:00", "ns")


def table(label: str, more: Mapping[str, Any] | None = None, **columns: Any) -> Table:
    return table_of("log", columns, label=label, **(more or {}))


def of(*tables: Table, mapping: Mapping[str, str] | None = None, sample_time: float | None = None) -> Mapping[str, Any]:
    found = gather_channels(tables, mapping, (), "log", sample_time)
    return {**found.columns, "began": found.began}


def test_a_table_that_gives_no_channel_is_left_out() -> None:
    motor = table("motor", time_s=TIME, motor_speed_rad_s=TIME)
    chosen = resolve_tables([motor, table("room", time_s=TIME, humidity=TIME)], {}, "log")
    assert [one.label for one, _ in chosen] == ["motor"]


def test_a_mapping_to_an_absent_column_is_refused_with_the_existing_columns() -> None:
    tables = [table("motor", time_s=TIME, motor_speed_rad_s=TIME), table("rod", time_s=TIME, way=TIME)]
    with pytest.raises(MissingColumnError, match=r"'stroke'") as error:
        resolve_tables(tables, {"position_m": "stroke:mm"}, "log")
    assert "way" in str(error.value)


def test_a_channel_in_two_groups_is_refused_unless_a_mapping_names_the_group() -> None:
    tables = [table("left", time_s=TIME, position_m=TIME), table("right", time_s=TIME, position_m=2.0 * TIME)]
    with pytest.raises(LogError, match=r"'left' and 'right' both give position_m, wanted one"):
        of(*tables)
    np.testing.assert_allclose(of(*tables, mapping={"position_m": "right/position_m"})["position_m"], 2.0 * TIME)


def test_the_refusal_of_two_tests_in_one_file_names_all_ambiguous_channels() -> None:
    tests = [table(name, time_s=TIME, motor_speed_rad_s=TIME, position_m=TIME) for name in ("run 1", "run 2")]
    named = {name: f"run 1/{name}" for name in ("motor_speed_rad_s", "position_m")}
    option = ",".join(f"{name}={column}" for name, column in named.items())
    with pytest.raises(LogError, match=f"both give motor_speed_rad_s, position_m, .*--columns '{option}'"):
        of(*tests)
    assert len(of(*tests, mapping=named)["position_m"]) == len(TIME)


@pytest.mark.parametrize(("unit", "per_s"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("d", 1.0 / 86_400.0)])
def test_a_time_without_unit_is_read_in_the_unit_that_makes_its_values_dates(unit: str, per_s: float) -> None:
    first = 46_085.5 if unit == "d" else 1_772_625_600.0 * per_s
    found = gather_channels([table("rod", Time=first + per_s * TIME, position_m=TIME)], None, (), "log")
    np.testing.assert_allclose(np.diff(found.columns["time_s"]), 0.01, rtol=1e-3)
    assert found.notes == (LogCode.TIME_IS_DATES.note(column="Time", unit=unit, began="2026-03-04T12:00:00"),)


def test_a_time_without_unit_is_refused_with_a_unit_suggested_from_its_steps() -> None:
    with pytest.raises(LogError, match="perhaps --columns 'time_s=Time:ms'"):
        of(table("rod", Time=1e3 * TIME, position_m=TIME))
    with pytest.raises(LogError, match="perhaps --columns 'time_s=Time:d'"):
        of(table("rod", Time=0.5 + TIME / 86_400.0, position_m=TIME))


def test_a_group_with_only_time_gives_the_clock_of_groups_of_the_same_length() -> None:
    found = of(table("motor", motor_speed_rad_s=TIME), table("rod", position_m=TIME), table("clock", time_s=TIME))
    np.testing.assert_allclose(found["time_s"], TIME)
    named = of(table("rod", position_m=TIME), table("clock", When=1e3 * TIME), mapping={"time_s": "When:ms"})
    np.testing.assert_allclose(named["time_s"], TIME)


def test_dates_in_the_place_of_numbers_are_refused() -> None:
    dated = table("rod", time_s=TIME, position_m=NOON + (1e9 * TIME).astype("timedelta64[ns]"))
    with pytest.raises(LogError, match="column 'position_m' must hold numbers, got dates"):
        of(dated)


def test_a_table_without_time_takes_the_time_of_a_table_of_the_same_length() -> None:
    motor = table("motor", time_s=3.0 + TIME, motor_speed_rad_s=TIME)
    found = of(motor, table("rod", position_m=2.0 * TIME))
    np.testing.assert_allclose(found["position_m"], 2.0 * TIME)
    np.testing.assert_allclose(np.diff(found["time_s"]), 0.01)


def test_a_table_without_time_and_of_another_length_is_refused_without_a_sample_time() -> None:
    motor = table("motor", time_s=TIME, motor_speed_rad_s=TIME)
    with pytest.raises(LogError, match="time_s"):
        of(motor, table("rod", position_m=TIME[:30]))
    found = of(motor, table("rod", position_m=TIME[:30]), sample_time=0.01)
    np.testing.assert_allclose(found["position_m"][:30], TIME[:30], atol=1e-12)


def test_a_time_step_and_a_start_date_give_the_time() -> None:
    found = of(table("rod", {"step": 0.02, "began": NOON}, position_m=TIME))
    assert found["began"] == "2026-03-01T12:00:00.000000Z"
    np.testing.assert_allclose(found["time_s"], 0.02 * np.arange(50))


def test_a_log_without_time_takes_the_given_sample_time() -> None:
    found = of(table("rod", position_m=TIME), sample_time=0.5)
    np.testing.assert_allclose(found["time_s"], 0.5 * np.arange(50))
    with pytest.raises(LogError, match="time_s"):
        of(table("rod", position_m=TIME))


def test_time_counts_from_the_first_valid_date() -> None:
    stamps = NOON + np.rint(1e9 * TIME).astype("timedelta64[ns]")
    stamps[0] = stamps[7] = np.datetime64("NaT")
    found = of(table("rod", time_s=stamps, position_m=TIME))
    assert found["began"] == "2026-03-01T12:00:00.010000Z"
    assert np.flatnonzero(np.isnan(found["time_s"])).tolist() == [0, 7]
    np.testing.assert_allclose(found["time_s"][1:7], TIME[:6], atol=1e-9)


def test_a_column_without_any_valid_date_gives_no_start_date() -> None:
    found = of(table("rod", time_s=np.full(50, np.datetime64("NaT", "ns")), position_m=TIME))
    assert found["began"] is None
    assert np.isnan(found["time_s"]).all()


def test_a_mapping_to_an_absent_column_of_a_group_or_to_another_dimension_is_refused() -> None:
    tables = [table("left", time_s=TIME, position_m=TIME), table("right", time_s=TIME, way=2.0 * TIME)]
    with pytest.raises(MissingColumnError, match="'right/stroke'"):
        of(*tables, mapping={"position_m": "right/stroke"})
    with pytest.raises(LogError, match="bar"):
        of(*tables, mapping={"velocity_m_s": "right/way:bar"})


def test_the_refusal_of_a_log_without_a_required_channel_names_it() -> None:
    with pytest.raises(LogError, match="motor_speed_rad_s"):
        gather_channels([table("rod", time_s=TIME, position_m=TIME)], {}, ("motor_speed_rad_s",), "log")
