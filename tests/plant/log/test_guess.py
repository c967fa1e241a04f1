import warnings
from pathlib import Path

import pytest

from plant.errors import LogError, LogWarning, MissingColumnError, NoChannelError
from plant.log.files import read_record
from plant.log.guess import guess_by_name, hint_of
from plant.log.headings import Heading
from plant.log.notes import LogCode
from plant.notes import Note

ROWS = "\n".join(f"{0.001 * k:.3f},{k % 7},{k % 5}" for k in range(20))


@pytest.mark.parametrize(
    ("name", "channel"),
    [
        ("Zeit [ms]", "time_s"),
        ("n_Mot [U/min]", "motor_speed_rad_s"),
        ("Drehzahl Pumpe", "motor_speed_rad_s"),
        ("POS_MM", "position_m"),
        ("Kolbenweg (mm)", "position_m"),
        ("PistonVelocity", "velocity_m_s"),
        ("Delta p / bar", "differential_pressure_pa"),
        ("Δp bar", "differential_pressure_pa"),
        ("∆p [bar]", "differential_pressure_pa"),
        ("Druck", "differential_pressure_pa"),
        ("pressure_pa", "differential_pressure_pa"),
        ("p_A [bar]", "pressure_a_pa"),
        ("Chamber B pressure [psi]", "pressure_b_pa"),
    ],
)
def test_common_column_names_of_test_benches_are_guessed(name: str, channel: str) -> None:
    best = guess_by_name([Heading(name)])[0]
    assert (best.channel, best.place) == (channel, 0)
    assert best.sure > 0.5


def test_a_set_point_is_not_taken_for_what_was_measured() -> None:
    found = guess_by_name([Heading("Position_Soll [mm]"), Heading("Position_Ist [mm]")], ["position_m"])
    assert [one.name for one in found] == ["Position_Ist [mm]"]


def test_a_column_with_a_unit_of_another_dimension_is_not_guessed() -> None:
    assert guess_by_name([Heading("Position [bar]")], ["position_m"]) == ()


def test_a_missing_column_is_refused_with_headers_guess_and_the_command(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("Zeit [s],n_Mot [rpm],Weg [mm]\n" + ROWS)
    with pytest.raises(LogError) as caught:
        read_record(path)
    said = str(caught.value)
    assert "columns motor_speed_rad_s, and position_m or velocity_m_s are missing; the log has 'Zeit [s]'" in said
    assert "perhaps --columns 'motor_speed_rad_s=n_Mot [rpm]:rpm,position_m=Weg [mm]:mm'" in said
    assert "`hydrostate inspect FILE --write rig.toml`" in said


def test_a_mapping_to_an_absent_column_is_refused_with_a_guess_and_the_inspect_command(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,motor_speed_rpm,Weg [mm]\n" + ROWS)
    with pytest.raises(MissingColumnError, match=r"perhaps --columns 'position_m=Weg \[mm\]:mm'.*inspect FILE"):
        read_record(path, columns={"position_m": "POS:mm"})


def notes_of(tmp_path: Path, header: str) -> list[Note]:
    path = tmp_path / "run.csv"
    path.write_text(header + "\n" + "\n".join(f"{0.001 * k:.3f},{k % 7},{0.01 * (k % 5)},{k % 3}" for k in range(99)))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_record(path)
    return [one.message.note for one in caught if isinstance(one.message, LogWarning)]


@pytest.mark.parametrize(
    ("name", "option"),
    [
        ("dp", "differential_pressure_pa=dp:UNIT"),
        ("Druck [bar]", "differential_pressure_pa=Druck [bar]:bar"),
        ("p_A [bar]", "pressure_a_pa=p_A [bar]:bar"),
        ("differential_presure_pa", "differential_pressure_pa=differential_presure_pa:Pa"),
        ("diferential pressure [bar]", "differential_pressure_pa=diferential pressure [bar]:bar"),
        ("velocty", "velocity_m_s=velocty:UNIT"),
        ("piston velocity [mm/s]", "velocity_m_s=piston velocity [mm/s]:mm/s"),
    ],
)
def test_a_note_names_an_unread_column_that_may_be_a_channel(tmp_path: Path, name: str, option: str) -> None:
    (told,) = notes_of(tmp_path, f"time_s,motor_speed_rad_s,position_m,{name}")
    channel = option.partition("=")[0]
    assert told == LogCode.COLUMN_OVERLOOKED.note(column=name, channel=channel, option=option)


@pytest.mark.parametrize("name", ["differential_pressure_pa", "dp_set", "temperature [degC]", "y", "gauge 4 [bar]"])
def test_columns_that_cannot_be_a_missing_channel_are_ignored_without_a_note(tmp_path: Path, name: str) -> None:
    assert LogCode.COLUMN_OVERLOOKED not in [
        one.code for one in notes_of(tmp_path, f"time_s,motor_speed_rad_s,position_m,{name}")
    ]


def test_the_suggested_columns_option_includes_pressure_and_a_placeholder_for_unknown_units(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = "\n".join(f"{0.001 * k:.3f},{k % 7},{k % 5},{k % 3}" for k in range(20))
    path.write_text(f"Zeit,Drehzahl,Weg,Druck\n{rows}")
    with pytest.raises(LogError) as caught:
        read_record(path)
    said = str(caught.value)
    option = "time_s=Zeit:s,motor_speed_rad_s=Drehzahl:UNIT,position_m=Weg:UNIT,differential_pressure_pa=Druck:UNIT"
    assert f"perhaps --columns '{option}', with the unit of each for UNIT;" in said
    assert "--sample-time" not in said  # the log has a time column


def test_a_log_without_required_channels_suggests_merging_a_second_loggers_file(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,motor_speed_rpm,pressure_bar\n" + ROWS)
    with pytest.raises(LogError, match="if a second logger's file has it, add --with FILE"):
        read_record(path)


def test_a_refused_log_of_a_valve_actuator_suggests_identification(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,spool_command,position_m\n" + ROWS)
    with pytest.raises(LogError, match=r"an actuator that a valve controls cannot be diagnosed, but .*identify FILE"):
        read_record(path)


def test_a_letter_is_no_log(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("Dear Bob,\n\nplease find the log attached.\n")
    with pytest.raises(LogError, match="needs rows of numbers below its header line, this file has none"):
        read_record(path)


def test_the_hint_for_a_column_in_volts_asks_for_the_sensor_scale() -> None:
    volts, bars = (
        hint_of(["position_m"], [Heading("Time", "s"), Heading("CH1", unit), Heading("CH2", "V")])
        for unit in ("V", "bar")
    )
    assert "a column in V needs its sensor's scale: --columns 'position_m=NAME:20 mm/V'" in volts
    assert "in V needs" not in bars


def test_a_column_recognised_as_pressure_only_by_its_unit_is_not_suggested(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("Zeit [s],Drehzahl [rpm],Weg [mm],Äp bar\n1,2,3,4\n")
    with pytest.raises(NoChannelError) as told:
        read_record(path)
    assert "position_m=Weg [mm]:mm" in str(told.value)
    assert "pressure" not in str(told.value)


@pytest.mark.parametrize(
    "name", ["Position (0.1 mm)", "Position (1/100 mm)", "Position 0.01 mm", "Position\uff080.1 mm\uff09"]
)
def test_a_scale_is_not_read_as_the_unit_behind_it(name: str) -> None:
    (guess,) = guess_by_name([Heading(name)], ["position_m"])
    assert guess.unit is None
    assert f"position_m={name}:UNIT" in hint_of(["position_m"], [Heading(name)])


def test_of_several_times_none_is_replaced_by_evenly_spaced_rows() -> None:
    headings = [Heading(one) for one in ("Time n [s]", "n [rpm]", "Time x [s]", "x [mm]")]
    hint = hint_of(["time_s"], headings)
    assert "--columns 'time_s=Time n [s]:s'" in hint
    assert "--with FILE" in hint
    assert "--sample-time" not in hint
    assert "--sample-time" in hint_of(["time_s"], headings[1::2])
