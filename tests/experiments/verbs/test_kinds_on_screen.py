"""What a terminal shows for logs of the other actuators."""

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import hydrostate
from experiments.cli import app
from plant.log import files


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(one) for one in arguments])


@pytest.fixture(scope="module")
def stack_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("stack") / "run.csv"
    made = invoke(
        "simulate", "--plant", "piezo-stack", "--load", 10, "--duration", 0.03, "--fault", "major_leakage", "--out", out
    )
    assert made.exit_code == 0, made.output
    return out


def test_the_condition_of_the_stack_is_followed_by_the_work_to_do(stack_log: Path) -> None:
    done = invoke("diagnose", "--plant", "piezo-stack", "--load", 10, stack_log)
    assert done.exit_code == 0, done.output
    assert f"{stack_log}: major leakage next Inspect the seal" in " ".join(done.stdout.split())


def test_logs_of_two_kinds_of_actuator_are_distinguished_by_their_columns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    usual = files.open_tables
    monkeypatch.setattr(files, "open_tables", lambda path, *more: opened.append(path.name) or usual(path, *more))
    logs = {"piezo-stack": tmp_path / "stack.csv", "diaphragm-motor": tmp_path / "motor.csv"}
    for kind, words in {"piezo-stack": (0.03, "--fault", "air_doubled"), "diaphragm-motor": (0.15,)}.items():
        made = invoke("simulate", "--plant", kind, "--duration", *words, "--out", logs[kind])
        assert made.exit_code == 0, made.output
    done = invoke("estimate", *logs.values())
    assert done.exit_code == 0, done.output
    assert opened == ["stack.csv", "motor.csv"]  # each is opened once, although the first kind tried is not theirs
    for quantity in ("outlet reed stiffness", "gas fraction"):
        assert quantity in done.stdout
    for kind, log in logs.items():
        assert f"{log}: read as a log of the kind {kind}, by its columns" in " ".join(done.stderr.split())
        assert f"`hydrostate rig init rig.toml --plant {kind}` writes a file" in " ".join(done.stderr.split())
    assert "`hydrostate rig init rig.toml`" not in done.stderr
    shown = " ".join(invoke("diagnose", logs["piezo-stack"]).stdout.split())
    assert "stack.csv: air in the oil: 4.9" in shown
    assert "healthy share; leakage and friction are normal next Bleed the oil" in shown
    assert hydrostate.read(logs["piezo-stack"]).plant == "piezo-stack"
    refused = invoke("diagnose", "--plant", "eha", logs["piezo-stack"])
    assert refused.exit_code == 2
    assert "column motor_speed_rad_s is missing" in refused.stderr


def test_a_healthy_run_of_the_stack_calibrates_it(stack_log: Path, tmp_path: Path) -> None:
    healthy = tmp_path / "healthy.csv"
    words = ("--plant", "piezo-stack", "--load", 10)
    assert invoke("simulate", *words, "--duration", 0.03, "--out", healthy).exit_code == 0
    done = invoke("diagnose", *words, "--healthy", healthy, stack_log)
    assert done.exit_code == 0, done.output
    assert "major leakage" in done.stdout


def test_a_sensor_that_the_stack_does_not_have_is_refused(stack_log: Path) -> None:
    done = invoke("estimate", "--plant", "piezo-stack", "--sensors", "position,thermometer", stack_log)
    assert done.exit_code == 2
    assert "--sensors must be of stack, force, position, pressure, got 'thermometer'" in " ".join(done.stderr.split())


def test_identifiability_of_the_stack_is_given_for_its_sensors() -> None:
    done = invoke("identifiability", "--plant", "piezo-stack", "--sensors", "position", "--seconds", 0.05)
    assert done.exit_code == 0, done.output
    assert "leakage" in done.stdout


def test_a_motor_log_that_no_fault_explains_is_shown_as_unknown(tmp_path: Path) -> None:
    logs = {}
    for name, words in {"leaky": ("--load", 10, "--fault", "valve_4_leak=0.1"), "rust": ("--load", 10)}.items():
        logs[name] = tmp_path / f"{name}.csv"
        simulated = invoke("simulate", "--plant", "diaphragm-motor", *words, "--duration", 0.15, "--out", logs[name])
        assert simulated.exit_code == 0
    rows = logs["rust"].read_text(encoding="utf-8").splitlines()
    wrong = [row.rsplit(",", 1) for row in rows[1:]]  # an encoder that counts twice
    doubled = [f"{before},{2.0 * float(position)!r}" for before, position in wrong]
    logs["rust"].write_text("\n".join([rows[0], *doubled]) + "\n", encoding="utf-8")
    done = invoke("diagnose", "--plant", "diaphragm-motor", "--load", 10, *logs.values())
    said = " ".join(done.stdout.split())
    assert "probability [%]" in said
    assert "leaky" in said
    assert "valve 4 leak" in said
    assert "UNKNOWN" in said


@pytest.mark.parametrize("wrong", ["chamber_5_gas", "rust=1", "chamber_5_gas=7"])
def test_a_fault_of_the_motor_without_a_valid_name_and_severity_is_refused(wrong: str, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    done = invoke("simulate", "--plant", "diaphragm-motor", "--fault", wrong, "--out", out)
    assert done.exit_code == 2
    assert "must be" in done.stderr
    assert not out.exists()
