"""An entry of a rig file in another unit is refused with how to convert it, whatever actuator it is of."""

from pathlib import Path

import pytest

from plant.eha.model import EhaParameters
from plant.eha.rig import read_rig, rig_template
from plant.eha.rig_units import LENGTHS, LIMITS, require_si
from plant.errors import RigError


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("pump_displacement = 8", "must be from 1e-11 to 0.01 m^3/rad, got 8: cm^3 per revolution times 1.5915e-7"),
        ("pump_displacement = 1.27", "m^3/rad"),
        ("piston_area = 1520", "must be from 1e-06 to 10 m^2, got 1520: mm^2 times 1e-6"),
        ("piston_area = 15.2", "cm^2 times 1e-4"),
        ("piston_area = [31.2, 21.0]", "got 26.1"),
        ("chamber_volume = 1.08", "which is 711 m of 0.00152 m^2: L times 1e-3"),
        ("chamber_volume = 1080", "cm^3 times 1e-6"),
        ("bulk_modulus = 207", "MPa times 1e6"),
        ("bulk_modulus = 2.07", "GPa times 1e9"),
        ("leakage_coefficient = 0.0287", "L/min at a bar times 1.667e-10"),
        ("flow_bias = 0.14", "L/min times 1.667e-5"),
        ("relief_pressure = 160", "bar times 1e5, MPa times 1e6 and psi times 6895 are Pa"),
        ("accumulator_pressure = 3", "are Pa, absolute"),
        ("stroke = 200", "mm times 1e-3 is m"),
    ],
)
def test_a_number_in_another_unit_is_refused_with_its_conversion(tmp_path: Path, entry: str, words: str) -> None:
    (tmp_path / "rig.toml").write_text(f"[parameters]\n{entry}\n")
    with pytest.raises(RigError) as said:
        read_rig(tmp_path / "rig.toml")
    assert words in str(said.value)
    assert f"parameters.{entry.split(' ')[0]} must be" in str(said.value)


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_actuators_from_fingers_to_presses_are_read(tmp_path: Path, scale: float) -> None:
    p = EhaParameters()
    sizes = {"piston_area": p.piston_area * scale**2, "chamber_volume": p.chamber_volume * scale**3}
    sizes |= {"pump_displacement": p.pump_displacement * scale**3, "relief_pressure": 35e6, "stroke": 0.2 * scale}
    (tmp_path / "rig.toml").write_text("[parameters]\n" + "\n".join(f"{k} = {v!r}" for k, v in sizes.items()))
    assert read_rig(tmp_path / "rig.toml").parameters.piston_area == sizes["piston_area"]


def test_the_template_is_far_from_every_limit(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text(rig_template())
    p = read_rig(tmp_path / "rig.toml").parameters
    for name, one in LIMITS.items():
        value = getattr(p, name)
        assert value is None or (10.0 * one.least <= value <= 0.1 * one.most)
    assert 100.0 * LENGTHS[0] < p.chamber_volume / p.piston_area < 0.01 * LENGTHS[1]
    require_si(p)
