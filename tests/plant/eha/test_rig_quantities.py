"""A rig file accepts values from a nameplate, with their units."""

from pathlib import Path

import pytest

from plant.eha.rig import read_rig
from plant.errors import RigError


def read(tmp_path: Path, entries: str) -> object:
    (tmp_path / "rig.toml").write_text(f"[parameters]\n{entries}\n")
    return read_rig(tmp_path / "rig.toml").parameters


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ('pump_displacement = "8 cm^3/rev"', 1.27324e-6),
        ('pump_displacement = "8cc/rev"', 1.27324e-6),
        ('piston_area = "15.2 cm²"', 1.52e-3),
        ('chamber_volume = "1.08 L"', 1.08e-3),
        ('leakage_coefficient = "0.03 L/min/bar"', 5e-12),
        ('friction_coulomb = "0.5 kN"', 500.0),
        ('relief_pressure = "500 psi"', 3.447379e6),
        ('motor_speed_per_volt = "300 rpm/V"', 31.41593),
        ('stroke = "2e2 mm"', 0.2),
        ('load_force = "-1 kN"', -1000.0),
        ('load_force = "\u22121 kN"', -1000.0),
    ],
)
def test_a_quantity_is_converted(tmp_path: Path, entry: str, value: float) -> None:
    assert getattr(read(tmp_path, entry), entry.split(" ")[0]) == pytest.approx(value, rel=1e-5, abs=0.0)


def test_two_sides_may_differ_in_their_units(tmp_path: Path) -> None:
    p = read(tmp_path, 'piston_area = ["31 cm^2", 0.0021]')
    assert (getattr(p, "piston_area"), getattr(p, "area_difference")) == pytest.approx((2.6e-3, 1.0 / 5.2))  # noqa: B009


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ('pump_displacement = "8 cm^3"', "got '8 cm^3': unit 'cm^3' leaves the angle out"),
        ('relief_pressure = "160 furlong"', "got '160 furlong': unit 'furlong' does not convert"),
        ('relief_pressure = "160 9**9**9"', "a number and its unit in quotes, got"),
        ('accumulator_pressure = "2 barg"', "got '2 barg', a pressure above the atmosphere: add 1.013 bar"),
        ('accumulator_pressure = "2 BAR G"', "got '2 BAR G', a pressure above the atmosphere: add 1.013 bar"),
        ('relief_pressure = "500 psia"', "got '500 psia', an absolute pressure: take off 1.013 bar unless"),
        ('relief_pressure = "bar"', "must be a number in Pa, or a number and its unit in quotes, got 'bar'"),
        ('moving_mass = "30"', "must be a number in kg, or a number and its unit in quotes, got '30'"),
        ('bulk_modulus = "1.4e9"', "must be a number in Pa, or a number and its unit in quotes, got '1.4e9'"),
        ('pilot_share = "0,5"', "a number without quotes, got '0,5': write a decimal point, and nothing between"),
        ('chamber_volume = "1,08 L"', "got '1,08 L': write a decimal point, and nothing between thousands"),
        ('piston_area = "1 520 mm^2"', "got '1 520 mm^2': write a decimal point"),
        ('piston_area = "1e999 cm^2"', "must be a finite number"),
        ('pump_displacement = "8 mm^3/rad/bar"', "does not convert"),
    ],
)
def test_an_invalid_quantity_is_refused_with_the_reason(tmp_path: Path, entry: str, words: str) -> None:
    with pytest.raises(RigError) as said:
        read(tmp_path, entry)
    assert words in str(said.value)
    assert "rig.toml: " in str(said.value)
