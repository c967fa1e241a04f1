"""`simulate --fmu` makes logs of another tool's plant, in the conditions that it supports, and refuses the others."""

import json
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from experiments.cli import app
from experiments.eha.simulated import start_values
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED
from plant.errors import HydrostateError
from plant.export.fmu import plant_fmu
from tests.c_compiler import compiler

T = 1e-3


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler("gcc")
    pytest.importorskip("fmpy", reason="FMPy is an extra")
    path = tmp_path_factory.mktemp("fmu") / "plant.fmu"
    path.write_bytes(plant_fmu(LUMPED, EhaParameters(), T, "2.0", name="plant"))
    return path


def test_a_condition_planted_in_an_fmu_is_found_in_its_log(fmu: Path, tmp_path: Path) -> None:
    log = tmp_path / "foreign.csv"
    made = invoke("simulate", "--fmu", fmu, "--condition", "major_leakage", "--sample-time", T, "--out", log, "--json")
    assert made.exit_code == 0
    (said,) = json.loads(made.stdout)
    assert (said["plant"], said["condition"]) == ("plant.fmu", "major_leakage")
    (found,) = json.loads(invoke("estimate", log, "--json").stdout)
    assert found["gate"]["passed"]
    assert found["bulk_modulus_pa"]["value"] == pytest.approx(2.07e8, rel=0.01)
    planted = parameters_for(CONDITIONS["major_leakage"]).leakage_coefficient
    assert found["leakage_coefficient_m3_s_pa"]["value"] == pytest.approx(planted, rel=0.05)


@pytest.mark.parametrize(
    ("further", "said"),
    [
        (("--plant", "lumped"), "--plant or --fmu is needed, got both"),
        (("--parameter", "leak=3"), "the FMU has no variable 'leak'"),
        (("--parameter", "leak"), "--parameter NAME=VALUE with a number is needed, got 'leak'"),
        (("--columns", "position_m=rod:mm"), "rod"),
    ],
)
def test_options_that_do_not_fit_an_fmu_are_refused(
    fmu: Path, tmp_path: Path, further: tuple[str, ...], said: str
) -> None:
    log = tmp_path / "none.csv"
    refused = invoke("simulate", "--fmu", fmu, "--sample-time", T, *further, "--out", log)
    assert refused.exit_code != 0
    assert said in " ".join(refused.stderr.split())
    assert not log.exists()


def test_a_condition_that_the_fmu_has_no_parameters_for_is_refused(fmu: Path, tmp_path: Path) -> None:
    bare, log = tmp_path / "bare.fmu", tmp_path / "none.csv"
    with zipfile.ZipFile(fmu) as whole, zipfile.ZipFile(bare, "w") as renamed:
        for name in whole.namelist():
            renamed.writestr(name, whole.read(name).replace(b'name="leakage_coefficient"', b'name="leak"'))
    refused = invoke("simulate", "--fmu", bare, "--condition", "major_leakage", "--sample-time", T, "--out", log)
    assert refused.exit_code != 0
    assert "the condition changes leakage_coefficient, and the FMU has no variables" in " ".join(refused.stderr.split())


def test_options_of_an_fmu_are_refused_without_an_fmu(tmp_path: Path) -> None:
    for option in (("--parameter", "x=1"), ("--columns", "position_m=x")):
        refused = invoke("simulate", *option, "--out", tmp_path / "none.csv")
        assert refused.exit_code != 0
        assert "needs --fmu FILE" in " ".join(refused.stderr.split())


@pytest.mark.parametrize("text", ["x", "=1", "x=one", ""])
def test_a_start_value_that_is_not_a_name_and_a_number_is_refused(text: str) -> None:
    with pytest.raises(HydrostateError, match="NAME=VALUE"):
        start_values([text])
