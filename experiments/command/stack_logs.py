"""`estimate` and `diagnose` with `--plant piezo-stack`: what logs of the piezo-stack actuator say."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from estimation.piezo_stack import StackEstimate, estimate_stack
from estimation.piezo_stack_runs import DRIVE, STACK_CHANNELS
from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import finish, run_logs
from experiments.command.options import load_columns
from experiments.command.plant_logs import quantities_shown
from experiments.command.streams import clauses, short_names, table
from faults.conditions import find_condition
from faults.piezo_stack_diagnosis import MOST_MISFIT, calibrated_stack, diagnose_stack
from plant.errors import HydrostateError
from plant.piezo_stack_parameters import PiezoStackParameters
from plant.record import Record
from plant.record_files import read_record

if TYPE_CHECKING:
    from rich.console import RenderableType

SENSORS: Mapping[str, str] = {
    "stack": "stack_displacement_m",
    "force": "stack_force_n",
    "position": "position_m",
    "pressure": "chamber_pressure_pa",
}
"""Channels by the names of ``--sensors``."""

NOTHING: Result = {
    "quantities": {},
    "misfit": {},
    "channels": [],
    "condition": None,
    "findings": [],
    "gate": {"passed": False, "reasons": []},
}
"""The entries of a log that could not be used."""

MOST_DEVIATION = 0.30
"""Standard deviation over the healthy value, or over a minor fault's, above which no number is given."""

SMALLEST_FAULT: Mapping[str, float] = {"chamber_leakage": 5e-12, "crossport_leakage": 5e-12, "coulomb_friction": 100.0}
"""Sizes that leaks and friction are judged by, which are nothing or little when healthy [SI]."""

UNITS: Mapping[str, str] = {
    "air_fraction": "1",
    "chamber_leakage": "m^3/(s Pa)",
    "crossport_leakage": "m^3/(s Pa)",
    "coulomb_friction": "N",
    "polarisation": "1",
    "outlet_reed_stiffness": "N/m",
    "inlet_reed_stiffness": "N/m",
    "outlet_reed_gap": "m",
    "inlet_reed_gap": "m",
}
"""Unit of each quantity."""


def stack_logs_command(
    logs: Sequence[Path],
    *,
    diagnosing: bool,
    sensors: str,
    bias_pressure: float | None,
    load: float | None,
    healthy_log: Path | None,
    expected: str | None,
    columns: Sequence[str] | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Estimate or diagnose logs of the piezo-stack actuator, and leave with the exit code.

    Parameters
    ----------
    logs : sequence of Path
        The logs; each begins at rest.
    diagnosing : bool
        Whether a condition is wanted, not quantities.
    sensors : str
        Channels that are used, by `SENSORS`, with commas between; all where empty.
    bias_pressure, load : float or None
        Of the runs [Pa], [kg]; 1 MPa and none if not given.
    healthy_log : Path or None
        A run of the healthy actuator to calibrate on.
    expected : str or None
        The condition that is expected.
    columns : sequence of str or None
        Foreign columns, as ``--columns`` gives them.
    out : Path or None
        Where results are written too.
    as_json : bool
        Whether a program reads.

    Raises
    ------
    HydrostateError
        If an option is not usable.
    """
    channels = _channels(sensors)
    if expected is not None:
        find_condition(expected)
    mapping = load_columns(columns)
    prepare_output(out)
    conditions = {
        name: value for name, value in (("bias_pressure", bias_pressure), ("load_mass", load)) if value is not None
    }
    healthy = replace(PiezoStackParameters(), **conditions)
    if healthy_log is not None:
        healthy = calibrated_stack(_read(healthy_log, mapping), healthy)
    work = partial(_diagnosed, expected) if diagnosing else _estimated
    chosen = {"plant": "piezo-stack", "expected": expected}

    def one(log: Path) -> Result:
        return {**NOTHING, **work(_read(log, mapping), healthy, channels), **chosen}

    batch = run_logs(logs, one, {**NOTHING, **chosen}, "diagnosing" if diagnosing else "estimating")
    finish(batch, _conditions_shown if diagnosing else quantities_shown, as_json=as_json, out=out)


def _channels(sensors: str) -> tuple[str, ...]:
    names = [name.strip() for name in sensors.split(",") if name.strip()]
    for name in names:
        if name not in SENSORS:
            raise HydrostateError(f"--sensors must be of {', '.join(SENSORS)}, got {name!r}")
    return tuple(SENSORS[name] for name in names) or STACK_CHANNELS


def _read(log: Path, mapping: Mapping[str, str]) -> Record:
    return read_record(log, columns=mapping, required=(DRIVE,))


def _estimated(record: Record, healthy: PiezoStackParameters, channels: tuple[str, ...]) -> dict[str, Any]:
    found = estimate_stack(record, healthy, channels=channels)
    quantities = _quantities(found, healthy)
    lost = [name for name, entry in quantities.items() if entry["value"] is None]
    reasons = [f"{name} is missed by {misfit:.3g} times its noise" for name, misfit in _misfits(found)]
    outcome = "mismatch" if reasons else ("not_observable" if len(lost) == len(quantities) else "ok")
    if reasons:
        quantities = {name: {**entry, "value": None, "ci95": None} for name, entry in quantities.items()}
    said = [*reasons, *([f"these sensors do not tell {', '.join(lost)}"] if lost else [])]
    return {
        **_common(found, quantities),
        "outcome": outcome,
        "gate": {"passed": not reasons, "reasons": reasons},
        "message": clauses(said) if said else "every quantity is told, and the model describes the log",
    }


def _diagnosed(
    expected: str | None, record: Record, healthy: PiezoStackParameters, channels: tuple[str, ...]
) -> dict[str, Any]:
    found = diagnose_stack(record, healthy, channels=channels)
    outcome = "mismatch" if list(_misfits(found.estimate)) else ("ok" if found.condition else "not_observable")
    condition = found.condition if outcome == "ok" else None
    findings = list(found.findings) if outcome == "ok" else []
    said = [condition] if condition else list(found.reasons)
    if expected is not None and condition is not None:
        said.append("as expected" if condition == expected else f"{expected} was expected")
    return {
        **_common(found.estimate, _quantities(found.estimate, healthy)),
        "outcome": outcome,
        "condition": condition,
        "findings": findings,
        "gate": {"passed": not found.reasons, "reasons": list(found.reasons)},
        "message": clauses([*said, *findings]),
    }


def _misfits(found: StackEstimate) -> Iterable[tuple[str, float]]:
    return ((name, misfit) for name, misfit in found.misfit.items() if misfit > MOST_MISFIT)


def _common(found: StackEstimate, quantities: Mapping[str, Any]) -> dict[str, Any]:
    return {"quantities": quantities, "misfit": dict(found.misfit), "channels": list(found.misfit)}


def _quantities(found: StackEstimate, healthy: PiezoStackParameters) -> dict[str, dict[str, Any]]:
    """Return every quantity with its interval; without a number where the sensors hold too little."""
    entries: dict[str, dict[str, Any]] = {}
    for name, value in found.values.items():
        size = 1.0 if name == "polarisation" else SMALLEST_FAULT.get(name) or getattr(healthy, name) or 1e-4
        told = found.deviations[name] < MOST_DEVIATION * size
        entries[name] = {
            "value": value if told else None,
            "unit": UNITS[name],
            "std": found.deviations[name],
            "ci95": list(found.interval(name)) if told else None,
        }
    return entries


def _conditions_shown(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table("log", "condition", "verdict")
    for name, result in zip(short_names(results), results, strict=True):
        shown.add_row(name, result["condition"] or "-", result["outcome"].replace("_", " "))
    yield shown
    yield from (f"{result['file']}: {result['message']}" for result in results)
