"""No decision depends on a sentence: if every sentence is replaced by "x", everything but text stays the same."""

import importlib
import json
import pkgutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from estimation.finding import OUTCOMES
from experiments.cli import app
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.rig import rig_template
from plant.eha.simulate import LUMPED, simulate
from plant.log.files import write_record
from plant.log.record import Record
from plant.notes import Code
from plant.sensors.faults import SensorFault, with_fault
from plant.sensors.sensors import BENCH

PACKAGES = ("plant", "estimation", "faults", "experiments")
TEXT = frozenset({"message", "reasons", "warnings", "not_told", "advice", "findings", "text"})
"""Entries that contain sentences: whether there are any must not change, but their words may."""

T = 2e-3
"""Sample time of the logs [s]."""

LONG = {
    "estimate": (
        *("at_rest", "far_off", "faulty", "frozen_encoder", "frozen_pressure", "frozen_velocity", "healthy", "stuck"),
        "under_load",
    ),
    "diagnose": ("dead_pressure", "far_off", "frozen_pressure"),
}
"""Logs that take seconds each, or that repeat what a verb says of another log; only slow tests use them. The other logs
raise every kind of note."""

SPEED, POSITION, VELOCITY, PRESSURE = "motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa"


def run(condition: str, drive: str = "steps", seconds: float = 2.0) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(8)
    return simulate(LUMPED, make_drive(drive, seconds, T, p, rng), T, p, sensors=BENCH, rng=rng)


def frozen(record: Record, channel: str) -> Record:
    return with_fault(record, SensorFault(channel=channel, kind="freeze", start=1.0))


def logs() -> dict[str, Record]:
    healthy, leaking = run("normal"), run("minor_leakage")
    hit = np.arange(len(leaking)) % 75 == 7
    spoilt = {name: np.where(hit, leaking[name] + 20.0 * np.std(leaking[name]), leaking[name]) for name in leaking}
    noise = 1e-6 * np.random.default_rng(9).normal(size=len(healthy))
    gap = np.where(np.arange(len(healthy)) // 15 % 33 == 5, np.nan, healthy[PRESSURE])
    limit = 0.7 * float(np.max(np.abs(leaking[PRESSURE])))
    return {
        "healthy": healthy,
        "faulty": run("major_leakage_minor_friction"),
        "frozen_encoder": frozen(leaking, POSITION),
        "frozen_velocity": frozen(leaking, VELOCITY),
        "frozen_pressure": frozen(leaking, PRESSURE),
        "dead_pressure": leaking.replace(**{PRESSURE: np.zeros(len(leaking))}).slice(0, 300),
        "clipped": leaking.replace(**{PRESSURE: np.clip(leaking[PRESSURE], -limit, limit)}),
        "outliers": leaking.replace(**spoilt),
        "gaps": healthy.replace(**{PRESSURE: gap}),
        "stuck": run("major_friction", "sine"),
        "at_rest": healthy.replace(**{SPEED: np.zeros(len(healthy)), POSITION: noise, VELOCITY: noise}),
        "swapped": leaking.replace(**{POSITION: leaking[VELOCITY], VELOCITY: leaking[POSITION]}),
        "in_millimetres": leaking.replace(**{POSITION: 1e3 * leaking[POSITION]}),
        "far_off": leaking.replace(**{PRESSURE: leaking[PRESSURE] + np.linspace(0.0, 1e6, len(leaking))}),
        "under_load": run("minor_leakage", seconds=3.0).slice(600),
        "velocity_alone": leaking.replace(**{POSITION: None, PRESSURE: None}),
        "short": leaking.slice(0, 60),
    }


def codes() -> Iterator[Code]:
    """Yield every code in the packages."""
    for package in PACKAGES:
        for found in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
            if not found.name.endswith("__main__"):
                importlib.import_module(found.name)
    enums = [Code]
    while enums:
        enum = enums.pop()
        enums += enum.__subclasses__()
        yield from enum


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    for name, record in logs().items():
        write_record(record, folder / f"{name}.csv")
    (folder / "unreadable.csv").write_text("time_s,motor_speed_rad_s\n0.0,fast\n")
    columns = f'{POSITION} = "POS_MM:mm"\n'
    (folder / "columns.toml").write_text(rig_template() + columns)
    relief = "relief_pressure = "
    lines = [f"{relief}1e9" if line.startswith(relief) else line for line in rig_template().splitlines()]
    (folder / "no_circuit.toml").write_text("\n".join(lines) + "\n")
    return folder


@pytest.fixture(scope="module")
def as_written() -> dict[str, tuple[int, list[dict[str, Any]]]]:
    """Return a dictionary for what calls print with their original sentences."""
    return {}


def printed(*arguments: object) -> tuple[int, list[dict[str, Any]]]:
    done = CliRunner().invoke(app, [str(argument) for argument in (*arguments, "--json")])
    return done.exit_code, json.loads(done.stdout)


def without_text(value: Any, name: str = "") -> Any:
    """Return a result with each text replaced by whether there is one."""
    if name in TEXT:
        return bool(value)
    if isinstance(value, dict):
        return {key: without_text(one, key) for key, one in value.items()}
    return [without_text(one) for one in value] if isinstance(value, list) else value


def swept(call: tuple[str, ...], folder: Path) -> list[object]:
    """Return the arguments of a call: ``*`` becomes all logs that are not in `LONG`, and file names become paths."""
    every = [one for one in sorted(folder.glob("*.csv")) if one.stem not in LONG.get(call[0], ())]
    return [one for word in call for one in (every if word == "*" else [folder / word] if "." in word else [word])]


CALLS: dict[str, tuple[str, ...]] = {
    "estimate, most logs": ("estimate", "*"),
    "diagnose, most logs": ("diagnose", "*"),
    **{f"{verb}, long": (verb, *(f"{name}.csv" for name in names)) for verb, names in LONG.items()},
    "estimate, a column of the rig missing": ("estimate", "healthy.csv", "--rig", "columns.toml"),
    "diagnose, a column of the rig missing": ("diagnose", "healthy.csv", "--rig", "columns.toml"),
    "diagnose, no circuit": (
        "diagnose",
        "healthy.csv",
        "frozen_velocity.csv",
        "swapped.csv",
        "--rig",
        "no_circuit.toml",
    ),
    "diagnose, as expected": ("diagnose", "faulty.csv", "--condition", "major_leakage_minor_friction"),
    "estimate, the published form": ("estimate", "faulty.csv", "stuck.csv", "--form", "acceleration"),
    "estimate, filtered": ("estimate", "faulty.csv", "swapped.csv", "--form", "pressure"),
    "estimate, without pressure": ("estimate", "healthy.csv", "stuck.csv", "--no-pressure"),
    "diagnose, without pressure": ("diagnose", "healthy.csv", "stuck.csv", "--no-pressure"),
}

SLOW = {name for name in CALLS if "without pressure" in name or "long" in name} | {
    "diagnose, most logs",
    "estimate, most logs",
    "diagnose, a column of the rig missing",
    "estimate, filtered",
}


@pytest.mark.parametrize(
    "call", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in CALLS]
)
def test_replacing_every_sentence_by_x_changes_only_text(
    call: str,
    folder: Path,
    as_written: dict[str, tuple[int, list[dict[str, Any]]]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    arguments = swept(CALLS[call], folder)
    code, before = as_written[call] = printed(*arguments)
    for member in codes():
        monkeypatch.setattr(member, "template", "x")
    for outcome in OUTCOMES:
        monkeypatch.setitem(OUTCOMES, outcome, "x")
    code_of_x, after = printed(*arguments)
    assert code_of_x == code
    assert [without_text(one) for one in after] == [without_text(one) for one in before]
    said = {note["text"] for one in after for note in one["notes"]}
    assert said <= {"x"}
    assert bool(said) == any(one["notes"] for one in before)


@pytest.mark.slow
def test_the_logs_used_raise_notes_and_outcomes_of_every_kind(
    folder: Path, as_written: dict[str, tuple[int, list[dict[str, Any]]]]
) -> None:
    every = (f"{verb}, most logs" for verb in ("estimate", "diagnose"))
    estimated, diagnosed = (
        (as_written[call] if call in as_written else printed(*swept(CALLS[call], folder)))[1] for call in every
    )
    raised = {note["code"] for one in (*estimated, *diagnosed) for note in one["notes"]}
    assert raised >= {
        "samples_masked",
        "channel_large",
        "sensor_froze",
        "sensor_constant",
        "sensor_clipped",
        "outliers_left_out",
        "bound_too_wide",
        "pump_and_piston_rest",
        "none_fits",
        "unexplained",
        "friction_not_visible",
        "check_sensor",
        "fit_doubted",
        "closer_speeds",
    }
    assert {one["outcome"] for one in (*estimated, *diagnosed)} >= {"ok", "not_observable", "mismatch", "failed"}
    assert {one["unknown"] for one in diagnosed} == {True, False, None}
