"""`estimate` and `diagnose` with `--plant diaphragm-motor`: what logs of the seven-chamber motor say."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from estimation.card import percent
from estimation.diaphragm_motor import MotorEstimate, estimate_motor
from estimation.diaphragm_motor_card import LEAKAGE, flow_change, motor_card
from estimation.diaphragm_motor_signature import DRIVE, Signature, logged_signature
from estimation.diaphragm_motor_track import NORMAL_95
from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import finish, run_logs
from experiments.command.options import MOTOR, load_columns, require_one_of
from experiments.command.plant_logs import quantities_shown
from experiments.command.streams import clauses, short_names, table
from faults.diaphragm_motor import MOTOR_FAULTS
from faults.diaphragm_motor_diagnosis import HEALTHY, Match, MotorDiagnosis, diagnose_motor
from plant.diaphragm_motor_parameters import DiaphragmMotorParameters
from plant.diaphragm_motor_run import ELECTRODES
from plant.errors import HydrostateError
from plant.record import Record
from plant.record_files import read_record

if TYPE_CHECKING:
    from rich.console import RenderableType

NOTHING: Result = {
    "quantities": {},
    "misfit": {},
    "channels": [],
    "condition": None,
    "candidates": [],
    "lookalikes": [],
    "findings": [],
    "gate": {"passed": False, "reasons": []},
}
"""The entries of a log that could not be used."""

MOST_DEVIATION = 0.3
"""Standard deviation, over the value or the least fault's size, above which no number is given."""

SIZES: Mapping[str, tuple[str, float]] = {
    "crossport_leakage": ("m^3/(s Pa)", LEAKAGE),
    "load_force": ("N", 10.0),
    "gas_fraction": ("1", 0.01),
}
"""Unit of each quantity, and the least fault's size that its deviation is judged by."""

STANDING = 1e-4
"""Velocity below which the rod counts as standing [m/s]."""

CLEARLY = 4.0
"""Standard deviations of a negative leakage from which the maps are not believed."""


def motor_logs_command(
    logs: Sequence[Path],
    *,
    diagnosing: bool,
    load: float | None,
    healthy_log: Path | None,
    expected: str | None,
    columns: Sequence[str] | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Estimate or diagnose logs of the diaphragm motor, and leave with the exit code.

    Parameters
    ----------
    logs : sequence of Path
        The logs, each under a steady sine.
    diagnosing : bool
        Whether a fault is wanted, not quantities.
    load : float or None
        Known force against extension, also that of the healthy run [N]; none if not given.
    healthy_log : Path or None
        A run of the healthy motor to calibrate on, under the same drive and load.
    expected : str or None
        The fault that is expected.
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
    if expected is not None:
        require_one_of("--condition", expected, [HEALTHY, *MOTOR_FAULTS])
    if load is not None and not isfinite(load):
        raise HydrostateError(f"--load must be finite, got {load:g} N")
    mapping = load_columns(columns)
    prepare_output(out)
    motor = replace(DiaphragmMotorParameters(), load_force=load or 0.0)
    calibration = None if healthy_log is None else logged_signature(_read(healthy_log, mapping))
    work = partial(_diagnosed, expected) if diagnosing else _estimated
    chosen = {"plant": MOTOR, "expected": expected}

    def one(log: Path) -> Result:
        return {**NOTHING, **work(_read(log, mapping), motor, calibration), **chosen}

    batch = run_logs(logs, one, {**NOTHING, **chosen}, "diagnosing" if diagnosing else "estimating")
    finish(batch, _faults_shown if diagnosing else quantities_shown, as_json=as_json, out=out)


def _read(log: Path, mapping: Mapping[str, str]) -> Record:
    return read_record(log, columns=mapping, required=(DRIVE,))


def _estimated(record: Record, motor: DiaphragmMotorParameters, calibration: Signature | None) -> dict[str, Any]:
    found = estimate_motor(record, motor, calibration=calibration)
    reasons = _doubts(found)
    quantities = {name: _quantity(name, found, told=not reasons) for name in SIZES}
    lost = [name for name, entry in quantities.items() if entry["value"] is None]
    believed = motor if reasons else found.parameters
    card = motor_card(believed, found.drive.frequency, found.drive.peak_to_peak)
    bound = card.relative_std["bulk_modulus"]
    quantities["bulk_modulus"] = {"value": None, "unit": "Pa", "std": bound * motor.bulk_modulus, "ci95": None}
    said = list(reasons)
    if lost and not reasons:
        named = ", ".join(name.replace("_", " ") for name in lost)
        said.append(f"too uncertain to give: {named}; a load of 10 N or more, or a healthy run (--healthy), would help")
    if quantities["load_force"]["value"] is not None:
        said.append("load counts any friction above the model's")
    alarm = found.track.alarm_time
    if alarm is not None and not reasons:
        said.append(f"the piston leaks, certain since {alarm:.2f} s")
    return {
        "outcome": "mismatch" if reasons else ("not_observable" if len(lost) == len(SIZES) else "ok"),
        "quantities": quantities,
        "misfit": {"electrodes": found.pattern},
        "channels": list(card.channels),
        "findings": [said[-1]] if alarm is not None and not reasons else [],
        "gate": {"passed": not reasons, "reasons": reasons},
        "message": clauses([*said, _bulk_modulus_said(believed, found, bound)]),
    }


def _doubts(found: MotorEstimate) -> list[str]:
    reasons: list[str] = []
    if not found.pattern_holds:
        reasons.append(
            f"the electrodes' pattern is not a healthy pump's (chi-square {found.pattern:.3g} a degree of freedom), so "
            "its maps of flow and pressure do not hold: diagnose it first"
        )
    leakage, deviation = (one["crossport_leakage"] for one in (found.values, found.deviations))
    if found.pattern_holds and leakage < -CLEARLY * deviation:
        reasons.append(
            f"the rod moves faster than the pump's maps allow (leakage {leakage:.2g} m^3/(s Pa)): ports may be clogged"
        )
    return reasons


def _quantity(name: str, found: MotorEstimate, *, told: bool) -> dict[str, Any]:
    unit, size = SIZES[name]
    value, deviation = found.values[name], found.deviations[name]
    given = told and deviation < MOST_DEVIATION * max(size, abs(value))
    half = NORMAL_95 * deviation
    return {
        "value": value if given else None,
        "unit": unit,
        "std": deviation,
        "ci95": [value - half, value + half] if given else None,
    }


def _bulk_modulus_said(motor: DiaphragmMotorParameters, found: MotorEstimate, bound: float) -> str:
    drive = found.drive.frequency, found.drive.peak_to_peak
    halved, doubled = (abs(flow_change(motor, *drive, factor)) for factor in (0.5, 2.0))
    return (
        f"bulk modulus is not observable here (bound {percent(bound)} of it): halved it changes the flow by "
        f"{percent(halved)}, doubled by {percent(doubled)}, for the diaphragms give 400 times as much"
    )


def _diagnosed(
    expected: str | None, record: Record, motor: DiaphragmMotorParameters, calibration: Signature | None
) -> dict[str, Any]:
    found = diagnose_motor(record, motor, calibration=calibration)
    reasons = _against(found)
    names = [match.name for match in found.group]
    condition = None if found.unknown else " or ".join(names)
    findings = [] if found.unknown else [_finding(match) for match in found.group if match.name != HEALTHY]
    said = [condition] if condition else ["unknown: no fault of the catalogue looks like this", *reasons]
    if expected is not None and condition is not None:
        said.append("as expected" if expected in names else f"{expected} was expected")
    others = [name for name in found.lookalikes if name not in names]
    if others and not found.unknown:
        said.append(f"by the electrodes' fundamentals alone it looks like {' or '.join(others)} too")
    best = found.best
    return {
        "outcome": "mismatch" if found.unknown else "ok",
        "condition": condition,
        "candidates": [_candidate(match) for match in found.group],
        "lookalikes": list(found.lookalikes),
        "findings": findings,
        "quantities": {} if found.unknown or best.name == HEALTHY else {best.name: _candidate(best)["severity"]},
        "misfit": {"signature": best.chi_square / found.freedom},
        "channels": [DRIVE, *ELECTRODES, "position_m"],
        "gate": {"passed": not reasons, "reasons": reasons},
        "message": clauses([*said, *findings]),
    }


def _against(found: MotorDiagnosis) -> list[str]:
    reasons: list[str] = []
    if found.unknown:
        reasons.append(
            f"the nearest, {found.best.name}, leaves a chi-square of {found.best.chi_square:.3g} for {found.freedom} "
            "degrees of freedom: another motor or load, or several faults; calibrate on a healthy run"
        )
    if abs(found.signature.velocity) < STANDING:
        reasons.append(f"the rod moves at {1e3 * found.signature.velocity:.2g} mm/s: stalled, or at its end")
    return reasons


def _candidate(match: Match) -> dict[str, Any]:
    if match.name == HEALTHY:
        return {"fault": HEALTHY, "probability": match.probability, "severity": None}
    severity = {
        "value": match.severity,
        "unit": MOTOR_FAULTS[match.name].unit,
        "std": match.deviation,
        "ci95": list(match.interval),
    }
    return {"fault": match.name, "probability": match.probability, "severity": severity}


def _finding(match: Match) -> str:
    fault = MOTOR_FAULTS[match.name]
    low, high = match.interval
    unit = "" if fault.unit == "1" else f" {fault.unit}"
    name = match.name.replace("_", " ")
    return f"{name}: {fault.meaning}: {match.severity:.3g}{unit}, 95 % interval {low:.3g} to {high:.3g}{unit}"


def _faults_shown(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table("log", "fault", "probability [%]", "severity", "95 % interval", "unit")
    for name, result in zip(short_names(results), results, strict=True):
        if result["condition"] is None:
            shown.add_row(name, "UNKNOWN", "-", "-", "-", "-")
            continue
        for one in result["candidates"]:
            size = one["severity"]
            cells = ("-", "-", "-")
            if size is not None:
                cells = (f"{size['value']:.3g}", f"{size['ci95'][0]:.3g} to {size['ci95'][1]:.3g}", size["unit"])
            shown.add_row(name, one["fault"].replace("_", " "), f"{100.0 * one['probability']:.1f}", *cells)
    yield shown
    yield from (f"{result['file']}: {result['message']}" for result in results)
