"""Tests of units that follow each number in a text log."""

from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError
from plant.log.files import read_record
from plant.log.formats.cell_texts import without_that_unit

TIME = 1e-3 * np.arange(400)
NAMES = ("Time", "Motor speed", "Position")


def written(folder: Path, names: tuple[str, ...], units: tuple[str, ...], between: str, point: str) -> Path:
    table = np.stack([1e3 * TIME, 1200.0 * np.sin(40.0 * TIME), 50.0 - 20.0 * np.cos(40.0 * TIME)], axis=1)
    rows = (
        ";".join(f"{v:.4f}{between}{u}".replace(".", point) for v, u in zip(row, units, strict=True)) for row in table
    )
    path = folder / "log.csv"
    path.write_text("\n".join([";".join(names), *rows]) + "\n")
    return path


@pytest.mark.parametrize("between", [" ", "", "\u00a0"])
@pytest.mark.parametrize("point", [".", ","])
def test_a_unit_after_each_number_becomes_the_unit_of_the_column(tmp_path: Path, between: str, point: str) -> None:
    record = read_record(written(tmp_path, NAMES, ("ms", "rpm", "mm"), between, point))
    assert record.sample_time == pytest.approx(1e-3)
    np.testing.assert_allclose(record["position_m"], 0.05 - 0.02 * np.cos(40.0 * TIME), atol=1e-7)
    np.testing.assert_allclose(record["motor_speed_rad_s"], 40.0 * np.pi * np.sin(40.0 * TIME), atol=1e-4)


@pytest.mark.parametrize(("unit", "step", "pascal"), [("kgf/cm2", 0.1, 98066.5), ("N/m^2", 1e4, 1.0)])
def test_a_unit_may_end_in_a_power(tmp_path: Path, unit: str, step: float, pascal: float) -> None:
    path = written(tmp_path, NAMES, ("ms", "rpm", "mm"), " ", ".")
    header, *lines = path.read_text().splitlines()
    rows = (f"{line};{step * row} {unit}" for row, line in enumerate(lines))
    path.write_text("\n".join([f"{header};Differential pressure", *rows]) + "\n")
    found = read_record(path)["differential_pressure_pa"]
    np.testing.assert_allclose(found, step * pascal * np.arange(400))


def test_a_word_for_no_value_keeps_a_last_letter_that_equals_the_unit() -> None:
    words = ("NaN", "NA", "N/A", "#N/A")
    assert tuple(without_that_unit(word, word[-1]) for word in words) == words


def test_a_unit_after_the_numbers_that_contradicts_the_column_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"'Position \[m\]' says m by its name and mm beside it"):
        read_record(written(tmp_path, ("Time", "Motor speed", "Position [m]"), ("ms", "rpm", "mm"), " ", "."))


def test_a_column_whose_unit_changes_is_refused_by_the_row(tmp_path: Path) -> None:
    path = written(tmp_path, NAMES, ("ms", "rpm", "mm"), " ", ".")
    lines = path.read_text().split("\n")
    path.write_text("\n".join([*lines[:300], *(line.replace(" mm", " cm") for line in lines[300:])]))
    with pytest.raises(LogError, match=r"'Position' must hold numbers, got '[\d.]+ cm' in row 300; write 1234\.5"):
        read_record(path)
