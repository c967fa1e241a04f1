"""An entry of a rig file in another unit is refused with how to write it, for actuators of any size."""

from pathlib import Path

import pytest

from plant.eha.model import EhaParameters
from plant.eha.rig import read_rig, rig_template
from plant.eha.rig_units import LENGTHS, LIMITS, require_si
from plant.errors import RigError


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (
            "pump_displacement = 8",
            'from 1e-11 to 0.01 m^3/rad, got 8; write another unit in quotes, as in "8 cm^3/rev"',
        ),
        ("pump_displacement = 1.27", "m^3/rad"),
        (
            "piston_area = 1520",
            'must be from 1e-06 to 10 m^2, got 1520; write another unit in quotes, as in "31.2 cm^2"',
        ),
        ("piston_area = 15.2", '"31.2 cm^2"'),
        ("piston_area = [31.2, 21.0]", "got 26.1"),
        ("chamber_volume = 1.08", 'which is 711 m of 0.00152 m^2; write another unit in quotes, as in "0.6 L"'),
        ("chamber_volume = 1080", '"0.6 L"'),
        ("bulk_modulus = 207", '"1.4 GPa"'),
        ("bulk_modulus = 2.07", '"1.4 GPa"'),
        ("leakage_coefficient = 0.0287", '"0.03 L/min/bar"'),
        ("flow_bias = 0.14", '"0.1 L/min"'),
        ("relief_pressure = 160", '"160 bar"'),
        ("accumulator_pressure = 3", '"3 bar"'),
        ("accumulator_gas = 0.3", "at most 100 times chamber_volume (0.00108 m^3), got 0.3 m^3; write another unit"),
        ("stroke = 200", '"200 mm"'),
    ],
)
def test_a_number_in_another_unit_is_refused_with_how_to_write_it(tmp_path: Path, entry: str, words: str) -> None:
    (tmp_path / "rig.toml").write_text(f"[parameters]\n{entry}\n")
    with pytest.raises(RigError) as said:
        read_rig(tmp_path / "rig.toml")
    assert words in str(said.value)
    assert f"parameters.{entry.split(' ')[0]} must be" in str(said.value)


@pytest.mark.parametrize("name", list(LIMITS))
def test_the_example_given_in_a_refusal_is_accepted(tmp_path: Path, name: str) -> None:
    (tmp_path / "rig.toml").write_text(f'[parameters]\n{name} = "{LIMITS[name].example}"\n')
    value = getattr(read_rig(tmp_path / "rig.toml").parameters, name)
    assert LIMITS[name].least < value < LIMITS[name].most


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_actuators_from_a_tenth_to_ten_times_the_papers_size_are_accepted(tmp_path: Path, scale: float) -> None:
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
