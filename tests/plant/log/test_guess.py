from pathlib import Path

import pytest

from plant.errors import LogError, MissingColumnError
from plant.log.files import read_record
from plant.log.guess import guess_by_name
from plant.log.headings import Heading

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
        ("p_A [bar]", "pressure_a_pa"),
        ("Chamber B pressure [psi]", "pressure_b_pa"),
    ],
)
def test_names_of_benches_are_known(name: str, channel: str) -> None:
    best = guess_by_name([Heading(name)])[0]
    assert (best.channel, best.place) == (channel, 0)
    assert best.sure > 0.5


def test_a_set_point_is_not_taken_for_what_was_measured() -> None:
    found = guess_by_name([Heading("Position_Soll [mm]"), Heading("Position_Ist [mm]")], ["position_m"])
    assert [one.name for one in found] == ["Position_Ist [mm]"]


def test_a_unit_of_something_else_excludes_a_column() -> None:
    assert guess_by_name([Heading("Position [bar]")], ["position_m"]) == ()


def test_a_missing_column_is_refused_with_headers_guess_and_the_command(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("Zeit [s],n_Mot [rpm],Weg [mm]\n" + ROWS)
    with pytest.raises(LogError) as caught:
        read_record(path)
    said = str(caught.value)
    assert "column motor_speed_rad_s and position_m or velocity_m_s is missing, the log has 'Zeit [s]'" in said
    assert "perhaps --columns 'position_m=Weg [mm]:mm,motor_speed_rad_s=n_Mot [rpm]:rpm'" in said
    assert "`hydrostate inspect FILE`" in said


def test_a_column_that_was_asked_for_and_is_not_there_is_refused_likewise(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,motor_speed_rpm,Weg [mm]\n" + ROWS)
    with pytest.raises(MissingColumnError, match=r"perhaps --columns 'position_m=Weg \[mm\]:mm'.*inspect FILE"):
        read_record(path, columns={"position_m": "POS:mm"})
