"""`hydrostate estimate` and `diagnose` with `--plant diaphragm-motor`."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from experiments.cli import app
from faults.diaphragm_motor.faults import motor_with_fault
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import BENCH_SENSORS, SAMPLE_TIME, motor_drive, simulate_motor
from plant.log.files import write_record

RUN = CliRunner()
MOTOR = DiaphragmMotorParameters(load_force=10.0)


def logged(folder: Path, p: DiaphragmMotorParameters, name: str = "run.csv") -> Path:
    drive = motor_drive(480.0, 200.0, 0.3, SAMPLE_TIME)
    path = folder / name
    write_record(simulate_motor(p, drive, SAMPLE_TIME, sensors=BENCH_SENSORS, rng=np.random.default_rng(3)), path)
    return path


def said(verb: str, log: Path, *words: str) -> dict[str, Any]:
    done = RUN.invoke(app, [verb, "--plant", "diaphragm-motor", "--load", "10", "--json", str(log), *words])
    assert done.exit_code == 0, done.output
    (entries,) = json.loads(done.stdout)
    return entries


def test_a_fault_is_diagnosed_with_its_severity(tmp_path: Path) -> None:
    log = logged(tmp_path, motor_with_fault(MOTOR, "valve_4_leak", 0.1))
    entries = said("diagnose", log, "--condition", "valve_4_leak")
    assert (entries["outcome"], entries["condition"], entries["gate"]["passed"]) == ("ok", "valve_4_leak", True)
    low, high = entries["quantities"]["valve_4_leak"]["ci95"]
    assert low < 0.1 < high
    assert "as expected" in entries["message"]
    assert said("estimate", log)["outcome"] == "mismatch"


def test_the_simulated_fault_is_diagnosed(tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    words = ["simulate", "--plant", "diaphragm-motor", "--load", "10", "--out", str(log), "--fault"]
    assert RUN.invoke(app, [*words, "chamber_5_gas=0.03"]).exit_code == 0
    assert said("diagnose", log)["condition"] == "chamber_5_gas"
    for wrong in ("chamber_5_gas", "rust=1", "chamber_5_gas=7"):
        done = RUN.invoke(app, [*words, wrong])
        assert done.exit_code == 2
        assert "must be" in done.stderr


def test_friction_and_load_are_named_together_on_screen(tmp_path: Path) -> None:
    log = logged(tmp_path, motor_with_fault(MOTOR, "friction", 8.0))
    done = RUN.invoke(app, ["diagnose", "--plant", "diaphragm-motor", "--load", "10", str(log)])
    words = " ".join(done.stdout.split())
    assert "friction or load" in words
    assert "it could also be clogged ports" in words
    assert "next Inspect the rod seals" in words


def test_leakage_and_load_are_estimated_and_bulk_modulus_is_not(tmp_path: Path) -> None:
    entries = said("estimate", logged(tmp_path, replace(MOTOR, crossport_leakage=5e-12)))
    assert entries["quantities"]["crossport_leakage"]["value"] == pytest.approx(5e-12, rel=0.15)
    assert entries["quantities"]["load_force"]["value"] == pytest.approx(10.0, abs=1.0)
    assert entries["quantities"]["bulk_modulus"]["value"] is None
    assert "bulk modulus is not observable here" in entries["message"]
    assert "the piston leaks" in entries["findings"][0]


@pytest.mark.slow
def test_another_motor_is_a_mismatch_without_a_healthy_run_and_diagnosed_with_one(tmp_path: Path) -> None:
    other = replace(MOTOR, sensor_gain=(0.9,) * 7)
    log = logged(tmp_path, motor_with_fault(other, "electrode_2_gain", 0.2))
    entries = said("diagnose", log)
    assert (entries["outcome"], entries["condition"]) == ("mismatch", None)
    assert "calibrate on a healthy run" in entries["message"]
    healthy = logged(tmp_path, other, "healthy.csv")
    assert said("diagnose", log, "--healthy", str(healthy))["condition"] == "electrode_2_gain"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--bias-pressure", "1e5"], "does not go with diaphragm-motor"),
        (["--condition", "rust"], "--condition must be one of"),
        (["--load", "nan"], "--load must be finite"),
    ],
)
def test_options_and_logs_that_do_not_apply_to_the_motor_are_refused(
    words: list[str], message: str, tmp_path: Path
) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time_s,position_m\n" + "".join(f"{k * 1e-3},0\n" for k in range(20)), encoding="utf-8")
    done = RUN.invoke(app, ["diagnose", "--plant", "diaphragm-motor", *words, str(log)])
    assert done.exit_code == 2
    assert message in " ".join(done.stderr.split())
    done = RUN.invoke(app, ["diagnose", "--plant", "diaphragm-motor", str(log)])
    assert "drive_voltage_v" in done.stderr
