import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from estimation.identification.model.linear_model import LinearModel
from estimation.identification.notes import IdentificationCode
from experiments.cli import app
from experiments.verbs.identify import whole_or_auto
from plant.eha.drives import prbs
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError
from plant.log.files import write_record
from plant.log.record import Record
from plant.sensors.sensors import BENCH


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return two logs of a linear plant of order 2 with a delay of three samples."""
    folder = tmp_path_factory.mktemp("identify")
    truth = LinearModel([0.0, 0.0, 0.0, 2e-5, 1e-5], [1.0, -1.5, 0.6], 1e-3, "u", "y", delay=3)
    paths: list[Path] = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        u = 100.0 * np.repeat(rng.choice([-1.0, 1.0], 300), 10)
        y = truth.simulate(u)
        channels = {"motor_speed_rad_s": u, "velocity_m_s": y + 0.02 * y.std() * rng.standard_normal(u.size)}
        paths.append(folder / f"run{seed}.parquet")
        write_record(Record(1e-3, channels), paths[-1])
    return paths


def test_automatic_order_delay_and_structure_are_right_and_the_models_are_written(
    logs: list[Path], tmp_path: Path
) -> None:
    out = tmp_path / "library.json"
    arguments = ["--structure", "auto", "--order", "auto", "--delay", "auto", "--out", str(out)]
    ran = CliRunner().invoke(app, ["identify", *map(str, logs), *arguments])
    assert ran.exit_code == 0, ran.output
    library = json.loads(out.read_text())
    assert [entry["format_version"] for entry in library] == [1, 1]
    for entry in library:
        assert (len(entry["denominator"]), entry["delay"]["samples"]) == (3, 3)
        model = LinearModel.from_dict(entry)
        assert model.dc_gain == pytest.approx(3e-4, abs=4.0 * model.dc_gain_std)
        assert entry["structure"] in {"output-error", "Box-Jenkins", "ARMAX"}
        assert entry["poles"][0]["imag_std"] > 0.0


def test_the_residual_of_each_model_is_tested_and_drawn(logs: list[Path], tmp_path: Path) -> None:
    arguments = ["--delay", "3", "--numerator", "2", "--figure", str(tmp_path / "fit.png"), "--json"]
    ran = CliRunner().invoke(app, ["identify", *map(str, logs), *arguments])
    for entry in json.loads(ran.stdout):
        low, high = entry["dc_gain"]["ci95"]
        assert low < 3e-4 < high
        assert min(entry["validation"].values()) > 1e-3  # the model has the structure of the true plant
    for log in logs:
        assert (tmp_path / f"fit-{log.stem}.png").read_bytes()[:4] == b"\x89PNG"


def test_an_automatic_order_warns_of_a_sticking_piston_and_not_with_a_linear_plant(
    logs: list[Path], tmp_path: Path
) -> None:
    rng, p = np.random.default_rng(4), EhaParameters()
    record = simulate(LUMPED, prbs(10.0, 1e-4, p.rated_speed, 0.2, rng), 1e-4, p, sensors=BENCH, rng=rng)
    write_record(record, tmp_path / "sticks.parquet")
    for log, sticks in ((tmp_path / "sticks.parquet", True), (logs[0], False)):
        (entry,) = json.loads(CliRunner().invoke(app, ["identify", str(log), "--order", "auto", "--json"]).stdout)
        assert (IdentificationCode.PISTON_RESTS in [one["code"] for one in entry["notes"]]) == sticks


@pytest.mark.parametrize("structure", ["arx", "armax", "box-jenkins"])
def test_the_structure_of_the_model_can_be_chosen(structure: str, logs: list[Path]) -> None:
    arguments = ["--structure", structure, "--delay", "3", "--json"]
    ran = CliRunner().invoke(app, ["identify", str(logs[0]), *arguments])
    (entry,) = json.loads(ran.stdout)
    assert entry["structure"].lower() == structure
    assert len(entry["noise_denominator"]) == 3


@pytest.mark.parametrize(
    ("option", "value"),
    [("--order", "0"), ("--order", "two"), ("--order", "100"), ("--delay", "-1"), ("--structure", "oe")],
)
def test_invalid_orders_delays_and_structures_are_refused(option: str, value: str, logs: list[Path]) -> None:
    ran = CliRunner().invoke(app, ["identify", str(logs[0]), option, value])
    assert ran.exit_code == 2
    assert option in ran.output


def test_an_order_or_delay_may_be_auto_and_not_a_fraction() -> None:
    assert whole_or_auto("--delay", "auto", 0) is None
    with pytest.raises(HydrostateError, match="from 1 on, or auto, got '1"):
        whole_or_auto("--order", "1.5", 1)


def test_the_missing_figure_of_an_unstable_model_is_reported(tmp_path: Path) -> None:
    u = np.random.default_rng(3).choice([-1.0, 1.0], 400)
    y = LinearModel([0.0, 1.0], [1.0, -1.01], 1e-3, "u", "y").simulate(u)
    write_record(Record(1e-3, {"motor_speed_rad_s": u, "velocity_m_s": y}), tmp_path / "run.csv")
    asked = ["--structure", "arx", "--order", "1", "--figure", str(tmp_path / "fit.png")]
    ran = CliRunner().invoke(app, ["identify", str(tmp_path / "run.csv"), *asked])
    assert ran.exit_code == 0, ran.output
    assert "no figure: the model of run.csv is unstable" in ran.stderr
    assert not (tmp_path / "fit.png").exists()
