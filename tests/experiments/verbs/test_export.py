import json
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

from estimation.identification.model.recursion import filtered
from experiments.cli import app
from tests.c_compiler import compiled


def export(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["export", *(str(argument) for argument in arguments)])


def read(folder: Path) -> dict[str, str]:
    return {file.name: file.read_text() for file in folder.iterdir() if file.suffix in (".c", ".h")}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "bench.csv"
    done = CliRunner().invoke(
        app, ["simulate", "--sample-time", "0.001", "--duration", "2", "--sensors", "bench", "--out", str(path)]
    )
    assert done.exit_code == 0, done.output
    return path


def test_an_exported_filter_has_the_rate_and_channels_of_the_log_and_compiles(log: Path, tmp_path: Path) -> None:
    done = export("c", log, "--out", tmp_path, "--name", "mine", "--no-pressure", "--json")
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)
    assert found["files"] == ["mine.h", "mine.c", "example.c", "Makefile"]
    assert found["channels"] == ["position_m", "velocity_m_s"]
    assert found["sample_time_s"] == pytest.approx(1e-3)
    assert "MINE_SUBSTEPS 10" in (tmp_path / "mine.h").read_text()
    compiled(tmp_path, read(tmp_path))


def test_states_may_have_spaces_and_the_short_names_of_estimate(log: Path, tmp_path: Path) -> None:
    """Before, `estimate --states leakage` and `filter --states leakage` worked, and `export c` refused it."""
    asked = ("leakage_coefficient,flow_bias", "leakage_coefficient, flow_bias", "leakage")
    sources: list[dict[str, str]] = []
    for number, states in enumerate(asked):
        done = export("c", log, "--states", states, "--name", "mine", "--out", tmp_path / str(number))
        assert done.exit_code == 0, done.output
        sources.append(read(tmp_path / str(number)))
    assert sources[0] == sources[1] == sources[2]


def test_without_a_log_a_filter_or_a_plant_can_be_exported(tmp_path: Path) -> None:
    assert export("c", "--out", tmp_path / "filter", "--method", "imm", "--precision", "float").exit_code == 0
    assert "float" in (tmp_path / "filter" / "pressure_imm.h").read_text()
    assert export("c", "--plant", "circuit", "--sample-time", "2e-4", "--out", tmp_path / "plant").exit_code == 0
    assert "every 0.0002 s" in (tmp_path / "plant" / "circuit_plant.h").read_text()


@pytest.mark.parametrize(("form", "warned"), [("pressure", False), ("acceleration", True)])
def test_a_form_that_needs_double_precision_is_exported_in_float_with_a_warning(
    form: str, warned: bool, tmp_path: Path
) -> None:
    done = export("c", "--form", form, "--precision", "float", "--out", tmp_path)
    assert done.exit_code == 0
    assert ("needs double" in done.stderr) == warned


def test_an_fmu_of_a_plant_and_of_a_filter_is_written(tmp_path: Path) -> None:
    plant, kalman = tmp_path / "plant.fmu", tmp_path / "filter.fmu"
    done = export("fmu", "--plant", "reduced", "--fmi", "3.0", "--out", plant, "--json")
    assert json.loads(done.stdout) == [{"outcome": "ok", "file": str(plant), "fmi": "3.0"}]
    assert export("fmu", "--out", kalman).exit_code == 0
    assert zipfile.is_zipfile(plant)
    assert "sources/pressure_ekf.c" in zipfile.ZipFile(kalman).namelist()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--form", "motion"), "form must be one of"),
        (("--method", "particle"), "a method that can be exported must be one of"),
        (("--plant", "piezo"), "--plant must be one of reduced, lumped, circuit, got 'piezo'"),
        (("--name", "no name"), "a name in C must be"),
        (("--precision", "half"), "precision must be one of double, float"),
        (("--sample-time", "0"), "--sample-time must be"),
    ],
)
def test_invalid_export_options_are_refused(given: tuple[str, ...], said: str, tmp_path: Path) -> None:
    done = export("c", "--out", tmp_path, *given)
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())


def test_an_identified_model_is_written_for_c_and_for_matlab(log: Path, tmp_path: Path) -> None:
    saved = tmp_path / "model.json"
    relation = ("--input", "motor_speed_rad_s", "--output", "differential_pressure_pa", "--order", "2", "--delay", "1")
    done = CliRunner().invoke(app, ["identify", str(log), *relation, "--out", str(saved)])
    assert done.exit_code == 0, done.output
    done = export("model", saved, "--name", "pressure", "--out", tmp_path / "c", "--json")
    assert json.loads(done.stdout)[0]["files"] == ["pressure.h", "pressure.c", "example.c", "Makefile"]
    compiled(tmp_path / "c", read(tmp_path / "c"))
    assert export("model", saved, "--to", "mat", "--out", tmp_path / "mat").exit_code == 0
    assert (tmp_path / "mat" / "model.mat").read_bytes().startswith(b"MATLAB 5.0")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("nowhere.json",), "nowhere.json: the model cannot be read"),
        (("nowhere.json", "--to", "ada"), "--to must be one of c, mat"),
    ],
)
def test_a_missing_model_and_an_unknown_target_are_refused(given: tuple[str, ...], said: str) -> None:
    done = export("model", *given)
    assert done.exit_code == 2
    assert said in done.stderr


def test_one_model_is_exported_and_a_file_of_two_is_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    u = np.repeat(rng.normal(size=60), 5)
    y = [filtered([0.0, gain], [1.0, -0.5], u) + 0.01 * rng.normal(size=300) for gain in (0.5, 1.0)]
    table = pd.DataFrame({"t": 0.1 * np.arange(300), "u": u, "a": y[0], "b": y[1]})
    table.to_csv(tmp_path / "log.csv", index=False)
    for outputs, code in (("a", 0), ("a,b", 2)):
        model = tmp_path / f"{len(outputs)}.json"
        form = ["--input", "u", "--output", outputs, "--order", "1", "--delay", "1"]
        asked = ["identify", str(tmp_path / "log.csv"), *form, "--out", str(model)]
        assert CliRunner().invoke(app, asked).exit_code == 0
        done = export("model", model, "--out", tmp_path / f"out{len(outputs)}")
        assert done.exit_code == code, done.output
        assert ("one model is needed, got 2" in done.output) is (code == 2)


def test_warnings_of_reading_the_log_of_an_exported_filter_are_printed(log: Path, tmp_path: Path) -> None:
    lines = log.read_text().splitlines()
    cells = lines[500].split(",")
    lines[500] = ",".join([cells[0], "", *cells[2:]])
    holed = tmp_path / "holed.csv"
    holed.write_text("\n".join(lines) + "\n")
    done = export("c", holed, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert "is missing in 1 of" in " ".join(done.stderr.split())
