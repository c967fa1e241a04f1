import pickle
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from plant.eha.circuit import chamber_volumes
from plant.eha.circuit_parameters import circuit_of
from plant.eha.doubts import DEFAULT_UNCERTAINTIES, Spread
from plant.eha.model import EhaParameters, piston_areas
from plant.eha.rig import Rig, read_rig, rig_template, write_rig_template
from plant.errors import RigError
from plant.units import notes


def rig_of(tmp_path: Path, text: str) -> Rig:
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return read_rig(path)


def test_the_template_gives_the_papers_parameters_exactly(tmp_path: Path) -> None:
    rig = rig_of(tmp_path, rig_template())
    assert rig.parameters == EhaParameters()
    assert rig.name == "paper"
    assert dict(rig.uncertainties) == {}
    assert dict(rig.columns) == {}


def test_a_filled_in_template_that_kept_its_name_is_not_the_papers_actuator(tmp_path: Path) -> None:
    """A page used to call a file with parameters of its own "no rig file of your own"."""
    own = rig_template().replace("moving_mass = 7.376", "moving_mass = 9.0")
    assert rig_of(tmp_path, own).name == "rig"  # named after its file
    assert rig_of(tmp_path, own.replace('name = "paper"', 'name = "Press 4"')).name == "Press 4"


def test_every_parameter_of_the_template_has_its_unit_meaning_and_source() -> None:
    lines = rig_template().splitlines()
    for name, note in notes(EhaParameters).items():
        row = next(index for index, line in enumerate(lines) if line.removeprefix("# ").startswith(f"{name} = "))
        assert all(part in lines[row - 1] for part in (f"[{note.unit}]", note.meaning, note.source))


def test_the_commented_examples_of_the_template_are_valid(tmp_path: Path) -> None:
    start = rig_template().index("[uncertainty]")
    examples = [line for line in rig_template()[start:].splitlines() if "channel = " not in line]
    live = "\n".join(line.removeprefix("# ") if " = " in line else line for line in examples)
    rig = rig_of(tmp_path, live)
    assert rig.uncertainties["chamber_volume"] == 0.3
    assert rig.columns["position_m"] == "POS_MM:mm"
    assert len(rig.columns) == 8


def test_a_rig_file_overrides_only_the_parameters_that_it_gives(tmp_path: Path) -> None:
    rig = rig_of(
        tmp_path,
        'name = "bench 2"\n[parameters]\npiston_area = 3.04e-3\nflow_bias = 0\n'
        '[uncertainty]\nbulk_modulus = 0.3\n[columns]\nposition_m = "POS_MM:mm"\n',
    )
    assert rig.name == "bench 2"
    assert rig.parameters == EhaParameters(piston_area=3.04e-3, flow_bias=0.0)
    assert dict(rig.uncertainties) == {"bulk_modulus": 0.3}
    assert dict(rig.columns) == {"position_m": "POS_MM:mm"}


def test_the_template_states_the_uncertainty_of_each_entry_and_its_reason() -> None:
    text = rig_template()
    for name, doubt in DEFAULT_UNCERTAINTIES.items():
        assert f"# {name}: " in text
        assert doubt.reason in text
    assert "# moving_mass: 0.1 down, 0.4 up, 0.05 if measured;" in text


def test_uncertainties_are_the_usual_ones_unless_stated_or_measured(tmp_path: Path) -> None:
    assert (
        rig_of(tmp_path, "").spreads
        == Rig().spreads
        == {name: one.usual for name, one in DEFAULT_UNCERTAINTIES.items()}
    )
    rig = rig_of(tmp_path, 'measured = ["chamber_volume"]\n[uncertainty]\npressure_gain = 0.0\nrelief_pressure = 0.1\n')
    assert rig.measured == ("chamber_volume",)
    assert rig.spreads["chamber_volume"] == Spread(0.05, 0.05)
    assert rig.spreads["pressure_gain"] == Spread(0.0, 0.0)
    assert rig.spreads["relief_pressure"] == Spread(0.1, 0.1)
    assert rig.spreads["moving_mass"] == DEFAULT_UNCERTAINTIES["moving_mass"].usual


def test_measured_entries_are_less_uncertain_and_no_entry_is_more_uncertain_downward() -> None:
    for doubt in DEFAULT_UNCERTAINTIES.values():
        assert max(doubt.measured) < max(doubt.usual) <= 0.4
        assert doubt.usual.down <= doubt.usual.up
    assert DEFAULT_UNCERTAINTIES["moving_mass"].usual.up > DEFAULT_UNCERTAINTIES["moving_mass"].usual.down


@pytest.mark.parametrize("field", [field.name for field in fields(EhaParameters)])
def test_every_parameter_refuses_text(tmp_path: Path, field: str) -> None:
    with pytest.raises(RigError, match=rf"parameters\.{field} must be a number .*, got 'big'"):
        rig_of(tmp_path, f'[parameters]\n{field} = "big"\n')


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[parameters]\npiston_aera = 1.0",
            r"parameters\.piston_aera is unknown, did you mean 'piston_area'",
        ),
        ("piston_area = 1e-3", r"piston_area must stand below a line \[parameters\]"),
        ("[parameters]\npiston_area = 1,5e-3", r"; piston_area = 1,5e-3 has a decimal comma, write a point"),
        ('[uncertainty]\nchamber_volume = "15 %"', r"must be a valid number \(a fraction: 0\.15 is 15 %\), got '15 %'"),
        (
            "[parameters]\npiston_area = 2.0",
            r"parameters\.chamber_volume .* m of 2 m\^2; .* and piston_area as in \"31\.2 cm\^2\"",
        ),
        ("[parametres]\npiston_area = 1.0", r"parametres is unknown, did you mean 'parameters'\?"),
        (
            "[uncertainty]\nbulk_modulos = 0.3",
            r"did you mean 'bulk_modulus'",
        ),
        ("[uncertainty]\nbulk_modulus = -0.3", r"uncertainty\.bulk_modulus must be 0 or more"),
        ("[uncertainty]\nbulk_modulus = nan", r"uncertainty\.bulk_modulus must be 0 or more"),
        ('measured = ["chamber_volum"]', r"measured\.chamber_volum is unknown, did you mean 'chamber_volume'"),
        ('measured = ["stroke"]', r"measured\.stroke is unknown, wanted one of pump_displacement, piston_area"),
        ('measured = "chamber_volume"', r"measured must be a list in square brackets, got 'chamber_volume'"),
        (
            '[parameters]\npiston_area = 1e-3\nmeasured = ["piston_area"]',
            r"measured must stand above the first line in square brackets, got it below \[parameters\]",
        ),
        ('[columns]\nplant = "eha"', r"plant must stand above .* below \[columns\]"),
        ("[uncertainty]\npiston_area = 5", r"at most 2 \(a fraction: 0\.05 is 5 %\), got 5"),
        ("measured = [3]", r"measured\.0 must be a valid string, got 3"),
        (
            'measured = ["moving_mass"]\n[uncertainty]\nmoving_mass = 0.1',
            r"uncertainty\.moving_mass and measured both say how well it is known, give one",
        ),
        ('measured = ["accumulator_gas"]', r"accumulator_gas is said to be known, and has no value"),
        ("[uncertainty]\naccumulator_gas = 0.1", r"accumulator_gas is said to be known, and has no value"),
        ("[parameters]\npiston_area = -1.0", r"piston_area must be positive, got -1\.0"),
        ("[parameters]\npiston_area = inf", r"piston_area must be a finite number"),
        ("[parameters]\npiston_area = true", r"parameters\.piston_area must be a valid number, got True"),
        ("parameters = 3", r"parameters must be a valid dictionary, got 3"),
        ("name = 3", r"name must be a valid string, got 3"),
        ('[columns]\nposition = "P"', r"channel 'position' is unknown, did you mean 'position_m'"),
        ('[columns]\nposition_m = "P:bar"', r"unit 'bar' does not convert to 'm'"),
        ("[columns]\nposition_m = 3", r"columns\.position_m must be a valid string, got 3"),
        ("[parameters", r"a rig file \(TOML\) is needed"),
        ("a = 1\na = 2", r"a rig file \(TOML\) is needed"),
        (
            "[parameters]\nmoving_mass = 20.0\npiston_area = 0,00152",
            r"line 3.*; piston_area = 0,00152 has a decimal comma, write a point",
        ),
    ],
)
def test_an_invalid_rig_file_is_refused_with_file_and_field(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(RigError, match=message) as caught:
        rig_of(tmp_path, text)
    assert str(caught.value).startswith(str(tmp_path / "rig.toml"))
    assert "\n" not in str(caught.value)


def test_a_missing_or_binary_rig_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RigError, match="No such file or directory; `hydrostate rig init` writes one to fill in"):
        read_rig(tmp_path / "rig.toml")
    with pytest.raises(RigError, match="cannot be read as a rig file: it is a folder"):
        read_rig(tmp_path)
    (tmp_path / "rig.toml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(RigError, match="TOML"):
        read_rig(tmp_path / "rig.toml")


def test_the_template_is_written_once_and_never_over_a_file(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    write_rig_template(path)
    assert read_rig(path).parameters == EhaParameters()
    path.write_text("mine")
    with pytest.raises(RigError, match="not overwritten"):
        write_rig_template(path)
    assert path.read_text() == "mine"
    with pytest.raises(RigError, match="cannot be written: No such file"):
        write_rig_template(tmp_path / "nowhere" / "rig.toml")


def test_a_rig_survives_pickling() -> None:
    rig = Rig("bench 2", EhaParameters(stroke=0.1), {"bulk_modulus": 0.3}, {"position_m": "P:mm"}, ("moving_mass",))
    assert pickle.loads(pickle.dumps(rig)) == rig  # noqa: S301 (our own bytes)


def test_two_areas_and_volumes_are_a_mean_and_a_difference_with_piloted_valves(tmp_path: Path) -> None:
    text = "[parameters]\npiston_area = [15.2e-4, 10.64e-4]\nchamber_volume = [1.08e-3, 0.756e-3]\n"
    p = rig_of(tmp_path, text).parameters
    assert piston_areas(p) == pytest.approx((15.2e-4, 10.64e-4))
    assert chamber_volumes(0.0, circuit_of(p)) == pytest.approx((2.16e-3, 1.512e-3))
    assert p.pilot_share == 1.0
    assert rig_of(tmp_path, text + "pilot_share = 0.0\n").parameters.pilot_share == 0.0


def test_one_volume_beside_two_areas_is_a_mean_and_the_sides_differ_less_than_the_areas(tmp_path: Path) -> None:
    text = "[parameters]\npiston_area = [15.2e-4, 10.64e-4]\n"
    for more in ("", "chamber_volume = 9e-4\n"):
        p = rig_of(tmp_path, text + more).parameters
        assert p.volume_difference == 0.75 * p.area_difference > 0.0
    assert p.chamber_volume == 9e-4
    assert rig_of(tmp_path, text + "volume_difference = 0.0\n").parameters.volume_difference == 0.0
    assert rig_of(tmp_path, text + "chamber_volume = [9e-4, 8e-4]\n").parameters.volume_difference == pytest.approx(
        1.0 / 17.0
    )


def test_a_template_takes_two_areas_and_volumes_in_place_of_one(tmp_path: Path) -> None:
    text = rig_template().replace("\npiston_area = 0.00152", "\npiston_area = [15.2e-4, 10.64e-4]")
    text = text.replace("\nchamber_volume = 0.00108", "\nchamber_volume = [1.08e-3, 0.756e-3]")
    p = rig_of(tmp_path, text).parameters
    assert piston_areas(p) == pytest.approx((15.2e-4, 10.64e-4))
    assert p.volume_difference == pytest.approx(p.area_difference)
    assert p.pilot_share == 1.0


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("piston_area = [1e-3]", r"piston_area must be a positive number, or two for sides A and B, got \[0.001\]"),
        ("piston_area = [1e-3, -1e-3]", "piston_area must be a positive number, or two"),
        (
            "piston_area = [1e-3, 2e-3]\narea_difference = 0.1",
            "two numbers, which say area_difference too: remove the line",
        ),
        ("area_difference = 1.0", "area_difference must lie between -1 and 1, got 1.0"),
        ("moving_mass = [1.0, 2.0]", "moving_mass must be"),
    ],
)
def test_an_invalid_pair_of_sides_is_refused(tmp_path: Path, entry: str, said: str) -> None:
    with pytest.raises(RigError, match=said):
        rig_of(tmp_path, f"[parameters]\n{entry}\n")


def test_valves_missing_from_the_file_scale_with_the_pump_and_given_ones_stay(tmp_path: Path) -> None:
    text = "[parameters]\npump_displacement = 1.114e-6\nrelief_conductance = 3e-8\n"
    p = rig_of(tmp_path, text).parameters
    assert p.makeup_conductance == pytest.approx(2e-9)
    assert p.relief_conductance == 3e-8


@pytest.mark.parametrize("made", [lambda p: Rig(p), lambda p: Rig("bench", {"parameters": p})])
def test_a_rig_without_its_name_or_with_other_parameters_is_not_the_papers(made: Any) -> None:
    with pytest.raises(RigError, match=r"a rig is Rig\(name, parameters\), got "):
        made(EhaParameters(piston_area=3e-3))


def test_a_rig_file_needs_a_path() -> None:
    with pytest.raises(RigError, match="the path of a rig file is needed, got None"):
        read_rig(None)  # type: ignore[arg-type]
