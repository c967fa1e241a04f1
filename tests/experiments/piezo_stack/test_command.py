"""`hydrostate simulate --plant piezo-stack` and `hydrostate piezo-stack`."""

import json
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from experiments.cli import app
from experiments.piezo_stack.figures import STACK_FIGURES

RUN = CliRunner()


def test_a_run_is_written_as_its_bench_would_log_it(tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    done = RUN.invoke(
        app,
        ["simulate", "--plant", "piezo-stack", "--load", "20", "--fault", "air_doubled", "--out", str(out), "--json"],
    )
    assert done.exit_code == 0, done.output
    (said,) = json.loads(done.stdout)
    assert said["fault"] == "air_doubled"
    assert 0.0 < said["flow_l_min"] < 0.95
    log = pd.read_csv(out)
    assert list(log)[1:3] == ["drive_voltage_v", "stack_displacement_m"]
    assert len(log) == 3201


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--load", "5"], "--load needs --plant piezo-stack"),
        (["--plant", "piezo-stack", "--voltage", "151"], "the stack takes 0 to 150 V"),
        (["--plant", "piezo-stack", "--frequency", "500"], "at most 450 Hz"),
        (["--plant", "piezo-stack", "--fault", "rust"], "must be one of"),
        (["--plant", "piezo-stack", "--leakage-severity", "1"], "does not go with"),
        (["--plant", "piezo-stack", "--fault", "bias_lost", "--condition", "normal"], "got both"),
    ],
)
def test_options_that_do_not_apply_to_the_plant_are_refused(words: list[str], said: str, tmp_path: Path) -> None:
    done = RUN.invoke(app, ["simulate", *words, "--out", str(tmp_path / "run.csv")])
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())


@pytest.mark.slow
def test_the_study_writes_its_report_with_every_figure(tmp_path: Path) -> None:
    done = RUN.invoke(app, ["piezo-stack", "--quick", "--out", str(tmp_path / "stack")])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "stack" / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure") == len(STACK_FIGURES)
    quoted = pd.read_csv(tmp_path / "stack" / "tables" / "quoted_numbers.csv")
    missed = quoted[~quoted["verdict"].isin(["calibrated", "predicted"])]
    assert missed["claim"].tolist() == [
        "frequency of the maximum at 1.0 MPa",
        "frequency of the maximum at 0.6 MPa",
    ]
    assert (missed["verdict"] == "not reproduced").all()
    left_out = pd.read_csv(tmp_path / "stack" / "tables" / "figure_12_left_out.csv")
    assert (left_out["ratio"] < 1.0).all()


def _logged(folder: Path, fault: str) -> Path:
    out = folder / f"{fault}.csv"
    words = ["simulate", "--plant", "piezo-stack", "--load", "10", "--duration", "0.03", "--fault", fault]
    assert RUN.invoke(app, [*words, "--out", str(out)]).exit_code == 0
    return out


def test_a_log_is_diagnosed_and_estimated(tmp_path: Path) -> None:
    log = _logged(tmp_path, "major_leakage")
    words = ["--plant", "piezo-stack", "--load", "10", "--json", str(log)]
    (said,) = json.loads(RUN.invoke(app, ["diagnose", *words]).stdout)
    assert (said["outcome"], said["condition"], said["findings"]) == ("ok", "major_leakage", [])
    (said,) = json.loads(RUN.invoke(app, ["estimate", *words]).stdout)
    leakage = said["quantities"]["crossport_leakage"]
    assert abs(leakage["value"] - 2e-11) < 4.0 * leakage["std"] < 4e-13
    assert leakage["ci95"][0] < leakage["value"] < leakage["ci95"][1]


def test_a_log_of_another_load_is_a_mismatch_without_numbers(tmp_path: Path) -> None:
    log = _logged(tmp_path, "normal")
    (said,) = json.loads(RUN.invoke(app, ["estimate", "--plant", "piezo-stack", "--json", str(log)]).stdout)
    assert said["outcome"] == "mismatch"
    assert {entry["value"] for entry in said["quantities"].values()} == {None}


def test_a_log_without_the_channels_of_the_plant_is_refused(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time_s,position_m\n" + "".join(f"{k * 1e-3},0\n" for k in range(20)), encoding="utf-8")
    done = RUN.invoke(app, ["diagnose", "--plant", "piezo-stack", str(log)])
    assert done.exit_code == 2
    assert "drive_voltage_v" in done.stderr
    assert "--load needs --plant" in RUN.invoke(app, ["estimate", "--load", "3", str(log)]).stderr
