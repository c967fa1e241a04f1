from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.files import read_record
from plant.log.formats.thousands import groups_thousands

TIME = 1e-3 * np.arange(300)
SPEED = np.round(2000.0 * np.sin(40.0 * TIME))


def written(folder: Path, cells: list[str], name: str) -> Path:
    rows = (f"{t:.3f};{speed};{1e-3 * t:.7f}" for t, speed in zip(TIME, cells, strict=True))
    path = folder / name
    path.write_text("\n".join(["time_s;Motor speed [rpm];position_m", *rows]) + "\n")
    return path


def test_whole_numbers_with_ambiguous_thousands_separators_are_refused(tmp_path: Path) -> None:
    cells = [f"{one:,.0f}".replace(",", ".") for one in SPEED]
    with pytest.raises(LogError, match=r"'Motor speed \[rpm\]' has separators of thousands"):
        read_record(written(tmp_path, cells, "log.csv"))


def test_thousands_separators_are_refused_in_a_second_file_with_the_same_header(tmp_path: Path) -> None:
    header = "time_s,motor_speed_rad_s,position_m\n"
    plain, grouped = tmp_path / "plain.csv", tmp_path / "grouped.csv"
    rows = [f"{t:.3f},{one:.0f},{1e-3 * t:.7f}" for t, one in zip(TIME, SPEED, strict=True)]
    plain.write_text(header + "\n".join(rows) + "\n")
    parted = [
        f"{t:.3f},{one:,.0f}".replace(",", "|", 1).replace(",", ".").replace("|", ",")
        for t, one in zip(TIME, SPEED, strict=True)
    ]
    grouped.write_text(header + "\n".join(f"{one},0.001" for one in parted) + "\n")
    read_record(plain)
    with pytest.raises(LogError, match="separators of thousands"):
        read_record(grouped)


@pytest.mark.parametrize("digits", [1, 3, 4])
def test_decimals_are_not_taken_for_thousands_separators(tmp_path: Path, digits: int) -> None:
    path = written(tmp_path, [f"{one / 7.0:.{digits}f}" for one in SPEED], "log.csv")
    assert len(read_record(path)) == len(TIME)


def test_two_cells_are_too_few_to_recognise_thousands_separators() -> None:
    assert not groups_thousands(["998", "1.002"])


def late(folder: Path, cells: list[str]) -> Path:
    """Return a log whose numbers reach a thousand only below the lines from which its layout is taken."""
    rows = (f"{1e-3 * k:.3f};{speed};{1e-6 * k:.7f}" for k, speed in enumerate(cells))
    path = folder / "log.csv"
    path.write_text("\n".join(["time_s;Motor speed [rpm];position_m", *rows]) + "\n")
    return path


def test_thousands_separators_that_first_appear_late_in_a_log_are_refused(tmp_path: Path) -> None:
    path = late(tmp_path, [f"{max(k - 300, k % 7):,d}".replace(",", ".") for k in range(0, 3600, 2)])
    with pytest.raises(LogError, match=r"thousands, as in '1\.000'"):
        read_record(path)
    assert len(read_record(late(tmp_path, [f"{0.004 * k:g}" for k in range(1800)]))) == 1800


def test_a_point_as_thousands_separator_among_decimal_commas_is_refused(tmp_path: Path) -> None:
    cells = [f"{one:d},5" for one in range(600)]
    path = tmp_path / "log.csv"
    for last, said in (("1.002", r"thousands, as in '1\.002'"), ("0.98", "")):
        rows = (f"0,{k:04d};{speed};0,{k:03d}1" for k, speed in enumerate([*cells, last]))
        path.write_text("\n".join(["time_s;Motor speed [rpm];position_m", *rows]) + "\n")
        if said:
            with pytest.raises(LogError, match=said):
                read_record(path)
        else:
            assert read_record(path)["motor_speed_rad_s"][-1] == pytest.approx(0.98 * np.pi / 30.0)


@pytest.mark.parametrize("apart", ["'", "\u2019", " ", "\u00a0", "\u202f", "\u2009", ","])
def test_unambiguous_thousands_separators_are_read(tmp_path: Path, apart: str) -> None:
    cells = [f"{one / 3.0:,.4f}".replace(",", apart) for one in 2.0 * SPEED]
    read = read_record(written(tmp_path, cells, "log.csv"))["motor_speed_rad_s"]
    np.testing.assert_allclose(read, 2.0 * SPEED / 3.0 * np.pi / 30.0, atol=1e-4)


@pytest.mark.parametrize(("apart", "point"), [(" ", ","), (".", ","), (",", ".")])
def test_a_whole_number_beyond_a_million_identifies_the_thousands_separator(
    tmp_path: Path, apart: str, point: str
) -> None:
    pressure = np.round(2e6 * np.sin(40.0 * TIME))
    cells = [f"{one:,.0f}".replace(",", apart) for one in pressure]
    rows = [f"{t:.3f};{99.0 * t:.4f}".replace(".", point) + f";{cell}" for t, cell in zip(TIME, cells, strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time_s;motor_speed_rad_s;differential_pressure_pa", *rows]) + "\n")
    read = read_record(path, required=("differential_pressure_pa",))["differential_pressure_pa"]
    np.testing.assert_allclose(read, pressure)


def test_decimal_commas_with_a_comma_delimiter_are_refused_with_the_remedy(tmp_path: Path) -> None:
    """The two cells below each name used to be read as columns without names."""
    rows = [f"{0.001 * k:.3f},{k / 3.0:.4f},-{k / 7.0:.2f}".replace(".", ",") for k in range(40)]
    (tmp_path / "log.csv").write_text("\n".join(["time_s,motor_speed_rad_s,position_m", *rows]))
    with pytest.raises(LogError, match=r"must have 3 cells .* got 6: a comma is the decimal sign here.* semicolons"):
        read_record(tmp_path / "log.csv")


def test_a_column_with_another_decimal_sign_than_the_rest_of_the_log_is_read(tmp_path: Path) -> None:
    cells = [f"{one / 7.0:.4f}".replace(".", ",") for one in SPEED]
    read = read_record(written(tmp_path, cells, "log.csv"))["motor_speed_rad_s"]
    np.testing.assert_allclose(read, SPEED / 7.0 * np.pi / 30.0, atol=1e-4)
    # one cell with a comma among whole numbers is a glitch; cells that may have separators of thousands are refused
    whole = [f"{one:.0f}" for one in SPEED]
    with pytest.warns(LogWarning, match=r"'12,7' in line 2|is missing in 1 of 300"):
        glitch = read_record(written(tmp_path, ["12,7", *whole[1:]], "log.csv"))
    assert np.isnan(glitch["motor_speed_rad_s"][0])
    with pytest.raises(LogError, match=r"'Motor speed \[rpm\]' has separators of thousands, as in '1,"):
        read_record(written(tmp_path, [f"{abs(one):,.0f}" for one in SPEED], "log.csv"))
