"""`hydrostate simulate --plant diaphragm-motor` and `hydrostate diaphragm-motor`."""

import json
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

import hydrostate as hs
from experiments.cli import app
from experiments.diaphragm_motor.figures import MOTOR_FIGURES
from plant.errors import HydrostateError
from plant.log.files import read_record

RUN = CliRunner()


def test_a_simulated_run_is_written_with_the_channels_of_its_sensors_and_can_be_read(tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    words = ["simulate", "--plant", "diaphragm-motor", "--load", "10", "--duration", "0.1", "--out", str(out)]
    done = RUN.invoke(app, [*words, "--json"])
    assert done.exit_code == 0, done.output
    (said,) = json.loads(done.stdout)
    assert said["load_n"] == 10.0
    assert 2e-3 < said["velocity_m_s"] < 4e-3
    log = pd.read_csv(out)
    assert list(log) == ["time_s", "drive_voltage_v", *(f"electrode_{i}_v" for i in range(1, 8)), "position_m"]
    assert len(log) == 5001
    assert set(read_record(out, required=("drive_voltage_v", "position_m"))) == set(log) - {"time_s"}


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("valve_9_leak=0.1", "got 'valve_9_leak', did you mean 'valve_8_leak'"),
        ("valve_4_leak", "a name and a severity, such as valve_4_leak=0.1, got"),
        ("valve_4_leak=7", "severity of valve_4_leak must be 0 to 1, got 7"),
    ],
)
def test_a_fault_that_does_not_exist_is_told_from_one_without_severity(fault: str, said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        hs.simulate(fault, plant="diaphragm-motor", duration=0.02)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--voltage", "301"], "the diaphragms take 150 V of either sign"),
        (["--frequency", "2000"], "at most 1000 Hz"),
        (["--bias-pressure", "1e5"], "does not go with diaphragm-motor"),
        (["--sensors", "paper"], "must be one of"),
    ],
)
def test_options_that_do_not_apply_to_the_motor_are_refused(words: list[str], said: str, tmp_path: Path) -> None:
    done = RUN.invoke(app, ["simulate", "--plant", "diaphragm-motor", *words, "--out", str(tmp_path / "run.csv")])
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())


@pytest.mark.slow
def test_the_study_writes_its_report_with_every_figure_and_lists_claims_that_fail(tmp_path: Path) -> None:
    done = RUN.invoke(app, ["diaphragm-motor", "--out", str(tmp_path / "motor")])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "motor" / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure") == len(MOTOR_FIGURES)
    tables = tmp_path / "motor" / "tables"
    claims = pd.read_csv(tables / "reproduced.csv").set_index("claim")["holds"]
    assert [name for name, holds in claims.items() if not holds] == [
        "the same to 0.95 of blocking, where valves leak and friction smooths"
    ]
    denied = pd.read_csv(tables / "not_reproduced.csv").set_index("claim")["ours"]
    best = [float(f) for f in denied["best frequency at 0, 12.5, 25, 37.5 N [Hz]"].split(", ")]
    assert best == sorted(best, reverse=True)
    assert best[0] - best[-1] > 30.0
    for words in ("168.1", "141", "100 to 1000", "root of 5 or 7 is no law", "0.01378"):
        assert words in page
    sets = pd.read_csv(tables / "other_sets.csv")
    assert sets["frequency_hz"].to_numpy() == pytest.approx(480.0, abs=5.0)
    assert sets["flow_m3_s"].to_numpy() == pytest.approx(110.11e-6 / 60.0, rel=0.01)
    assert sets["blocking_n"].max() > 3.0 * sets["blocking_n"].min()
    sensitivity = pd.read_csv(tables / "sensitivity.csv").set_index("change")
    assert float(str(sensitivity["flow_percent"]["halved"])) == pytest.approx(0.0, abs=0.2)
    assert float(str(sensitivity["frequency_hz"]["0.1 to 2 %"])) < -30.0
