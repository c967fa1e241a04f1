from typing import Any

import pytest

from plant.errors import HydrostateError, LogError, RigError
from plant.log.columns import know_channels, parse_columns, resolve_columns
from plant.log.headings import Heading


def channels(*names: str, **mapping: str) -> dict[str, str]:
    return {column.channel: column.name for column in resolve_columns(names, mapping, "a.csv")}


@pytest.mark.parametrize(
    ("name", "channel", "factor"),
    [
        ("motor_speed_rpm", "motor_speed_rad_s", 0.10471975511965977),
        ("motor_speed_rev_min", "motor_speed_rad_s", 0.10471975511965977),
        ("motor_speed_rev_per_s", "motor_speed_rad_s", 6.283185307179586),
        ("motor_speed_deg_s", "motor_speed_rad_s", 0.017453292519943295),
        ("position_mm", "position_m", 1e-3),
        ("position_um", "position_m", 1e-6),
        ("velocity_mm_s", "velocity_m_s", 1e-3),
        ("differential_pressure_bar", "differential_pressure_pa", 1e5),
        ("differential_pressure_psi", "differential_pressure_pa", 6894.757293168361),
        ("differential_pressure_MPa", "differential_pressure_pa", 1e6),
        ("differential_pressure_kpa", "differential_pressure_pa", 1e3),
        ("pressure_a_bar", "pressure_a_pa", 1e5),
        ("pressure_b_kgf_cm2", "pressure_b_pa", 98066.5),
        ("motor_voltage_mv", "motor_voltage_v", 1e-3),
        ("time_ms", "time_s", 1e-3),
        ("time_us", "time_s", 1e-6),
    ],
)
def test_a_unit_suffix_converts_to_the_channel(name: str, channel: str, factor: float) -> None:
    (column,) = resolve_columns([name], None, "a.csv")
    assert (column.channel, column.offset) == (channel, 0.0)
    assert column.factor == pytest.approx(factor, rel=1e-14)


def test_spaces_and_a_byte_order_mark_around_a_name_are_tolerated() -> None:
    assert channels("\ufefftime_s", " position_m ", "\tvelocity_mm_s") == {
        "time_s": "time_s",
        "position_m": "position_m",
        "velocity_m_s": "velocity_mm_s",
    }


def test_unknown_columns_are_ignored_and_simulated_truth_is_kept() -> None:
    assert list(channels("time_s", "note", "temperature_degc", "true_bulk_modulus_pa")) == [
        "time_s",
        "true_bulk_modulus_pa",
    ]


def test_a_field_name_or_matrix_index_after_a_channel_is_not_read_as_a_unit() -> None:
    assert channels("position_m.Data", "velocity_m_s 1", "time_s.Time") == {}


def test_a_name_that_ends_where_its_unit_should_stand_is_not_taken_to_be_in_si() -> None:
    assert resolve_columns(["position_", "motor_speed_", "time_"], None, "a.csv") == ()


def test_an_unknown_unit_is_refused_with_file_column_channel_and_unit() -> None:
    with pytest.raises(LogError, match=r"a\.csv: column 'position_xyz' cannot become position_m: unit 'xyz'"):
        channels("time_s", "position_xyz")


def test_a_unit_of_something_else_is_refused() -> None:
    with pytest.raises(LogError, match=r"'position_bar'.*does not convert to 'm'"):
        channels("position_bar")


def test_a_setpoint_column_is_not_read_as_the_measured_channel() -> None:
    assert channels("position_setpoint_mm", "position_m")["position_m"] == "position_m"


def test_two_columns_for_one_channel_are_refused_and_a_mapping_settles_it() -> None:
    with pytest.raises(LogError, match="'position_m' and 'position_mm' both give position_m"):
        channels("position_m", "position_mm")
    with pytest.raises(LogError, match="both give position_m, wanted one; rename one of them"):
        channels("position_m", "position_m")  # no option could tell them apart
    assert channels("position_m", "position_mm", position_m="position_mm:mm") == {"position_m": "position_mm"}


def test_a_mapped_column_has_the_unit_of_the_mapping_or_si() -> None:
    columns = resolve_columns(["POS_MM", "V"], {"position_m": "POS_MM:mm", "velocity_m_s": "V"}, "a.csv")
    assert [(c.channel, c.position) for c in columns] == [("position_m", 0), ("velocity_m_s", 1)]
    assert [c.factor for c in columns] == [pytest.approx(1e-3), 1.0]


def test_a_foreign_name_may_hold_a_colon() -> None:
    assert channels("axis:position", position_m="axis:position") == {"position_m": "axis:position"}
    assert channels("axis:position", position_m="axis:position:mm") == {"position_m": "axis:position"}


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ({"position_m": "POS:mm"}, "column 'POS' is needed for position_m; the log has 'X', 'X', 'Y'"),
        ({"position_m": "X:mm"}, "needed once for position_m, the log has it 2 times; rename the others"),
        ({"position_m": "Y:bar"}, "column 'Y' cannot become position_m: unit 'bar'"),
        ({"positon_m": "Y"}, "channel 'positon_m' is unknown, did you mean 'position_m'"),
        ({"position_m": 3}, "columns must be names by channel, such as 'POS_MM:mm', got 3"),
        ({3: "Y"}, "columns must be names by channel, such as 'POS_MM:mm', got 3"),
    ],
)
def test_a_mapping_that_does_not_fit_the_log_is_refused(mapping: dict[str, Any], message: str) -> None:
    with pytest.raises(LogError, match=message):
        resolve_columns(["X", "X", "Y"], mapping, "a.csv")


def test_command_line_columns_are_parsed() -> None:
    assert parse_columns(["position_m=POS_MM:mm", " velocity_m_s = V ", "time_s=T=1:ms"]) == {
        "position_m": "POS_MM:mm",
        "velocity_m_s": "V",
        "time_s": "T=1:ms",
    }


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["POS_MM:mm"], "CHANNEL=NAME:UNIT"),
        (["position_m="], "CHANNEL=NAME:UNIT"),
        (["=POS"], "CHANNEL=NAME:UNIT"),
        (["position_m=:mm"], "wants a column"),
        (["position_m=A", "position_m=B"], "needed once"),
        (["position=A"], "did you mean 'position_m'"),
        (["position_m=A:bar"], "does not convert to 'm'"),
        (["position_m=A:"], "unit ''"),
        (["motor_speed_rad_s=N:Hz"], "leaves the angle out"),
    ],
)
def test_a_malformed_command_line_column_is_refused(texts: list[str], message: str) -> None:
    with pytest.raises(RigError, match=message):
        parse_columns(texts)


@pytest.mark.parametrize("units", [{"travel_mm": "m"}, {"position_m": "mm"}, {"travel": "m"}])
def test_a_channel_whose_name_does_not_end_in_its_unit_is_refused(units: dict[str, str]) -> None:
    with pytest.raises(HydrostateError, match=r"must end in .* and be known in no other unit"):
        know_channels(units)


@pytest.mark.parametrize("mapping", [None, {"position_m": "Position [mm]"}])
def test_a_column_with_two_different_units_is_refused_unless_a_mapping_gives_one(
    mapping: dict[str, str] | None,
) -> None:
    headings = [Heading("time_s"), Heading("Position [mm]", "um")]
    with pytest.raises(LogError, match="says mm by its name and um beside it, wanted one"):
        resolve_columns(headings, mapping, "a.csv")
    found = resolve_columns(headings, {"position_m": "Position [mm]:um"}, "a.csv")
    assert {one.channel: one.factor for one in found}["position_m"] == pytest.approx(1e-6)
    assert resolve_columns([Heading("Position [mm]", "mm")], None, "a.csv")[0].factor == pytest.approx(1e-3)


def test_a_unit_suffix_that_contradicts_the_heading_unit_is_refused() -> None:
    with pytest.raises(LogError, match="says mm by its name and um beside it, wanted one"):
        resolve_columns([Heading("time_s"), Heading("position_mm", "um")], None, "a.csv")
    for said in ("mm", "counts", None):
        assert resolve_columns([Heading("position_mm", said)], None, "a.csv")[0].factor == pytest.approx(1e-3)
