"""`hydrostate simulate --plant diaphragm-motor` and `hydrostate diaphragm-motor`."""

import json
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from experiments.cli import app
from plant.record_files import read_record

RUN = CliRunner()


def test_a_run_is_written_as_its_sensors_would_log_it_and_read_again(tmp_path: Path) -> None:
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
    ("words", "said"),
    [
        (["--voltage", "301"], "the diaphragms take 150 V of either sign"),
        (["--frequency", "2000"], "at most 1000 Hz"),
        (["--bias-pressure", "1e5"], "does not apply to --plant diaphragm-motor"),
        (["--sensors", "paper"], "must be one of"),
    ],
)
def test_what_does_not_apply_is_refused(words: list[str], said: str, tmp_path: Path) -> None:
    done = RUN.invoke(app, ["simulate", "--plant", "diaphragm-motor", *words, "--out", str(tmp_path / "run.csv")])
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())
