"""The seven-chamber diaphragm motor as a kind: the options it understands and what they do."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from estimation.diaphragm_motor.finding import motor_finding, motor_prospect
from estimation.diaphragm_motor.signature import Signature, logged_signature
from estimation.finding import Finding
from experiments.actuator_kind import ActuatorKind, Experiment, LogVerb, Options, Run, Simulation
from experiments.command.json_output import Result
from experiments.command.terminal import short_names, table
from experiments.log_pages.entries import BLANK, finding_entries, quantity_entry
from experiments.log_pages.screens import messages_shown
from experiments.page.numbers import percent_text, reader_unit
from faults.diaphragm_motor.diagnose import Match
from faults.diaphragm_motor.faults import HEALTHY, MOTOR_FAULTS, motor_with_fault
from faults.diaphragm_motor.finding import motor_fault_finding, severity_of
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import ELECTRODES, MOTOR_SENSORS, NAME, SAMPLE_TIME, motor_drive, simulate_motor
from plant.eha.rig import UNNAMED, Rig
from plant.errors import HydrostateError, require_known
from plant.log.columns import CHANNELS
from plant.notes import Code

if TYPE_CHECKING:
    from rich.console import RenderableType

DRIVE, POSITION = "drive_voltage_v", "position_m"

BENCH = {"sensors": "bench", "duration": 0.2, "sample_time": SAMPLE_TIME}
"""Sensors, duration [s] (the motor settles within some hundredths of a second), and sample time [s]."""

SINE = {"frequency": 480.0, "voltage": 200.0}
"""The default drive: frequency [Hz], voltage peak to peak [V]."""


class MotorRunCode(Code):
    """Notes on a simulated run."""

    ROD_AT_END_STOP = "the rod reaches its end stop within {duration_s:g} s"


def _simulate(rig: Rig[Any], options: Options) -> Run:
    require_known("--sensors", options["sensors"], list(MOTOR_SENSORS))
    frequency, swing, between = (options[name] for name in ("frequency", "voltage", "sample_time"))
    healthy = _with_load(rig, options).parameters
    motor = _with_fault(healthy, options["fault"])
    drive = motor_drive(frequency, swing, options["duration"], between)
    rng, sensors = np.random.default_rng(options["seed"]), MOTOR_SENSORS[options["sensors"]]
    record = simulate_motor(motor, drive, between, sensors=sensors, rng=rng)
    made_of = {"frequency_hz": frequency, "voltage_v": swing, "load_n": healthy.load_force, "fault": options["fault"]}
    made_of |= {"seed": options["seed"]}
    position = record[POSITION]
    stopped = abs(float(position[-1])) > motor.half_stroke
    half = len(position) // 2
    speed = float(position[-1] - position[half]) / (between * (len(position) - 1 - half))
    return Run(
        record.annotate(**made_of),
        {**made_of, "sensors": options["sensors"], "velocity_m_s": round(speed, 6)},
        (MotorRunCode.ROD_AT_END_STOP.note(duration_s=record.duration),) if stopped else (),
    )


def _with_fault(motor: DiaphragmMotorParameters, fault: str | None) -> DiaphragmMotorParameters:
    """Return the motor with a fault such as ``valve_4_leak=0.1``, a name and its severity."""
    if fault is None:
        return motor
    name, _, severity = fault.partition("=")
    try:
        size = float(severity)
    except ValueError:
        raise HydrostateError(
            f"--fault must be a name and a severity, such as valve_4_leak=0.1, got {fault!r}"
        ) from None
    return motor_with_fault(motor, name, size)


def _with_load(rig: Rig[Any], options: Options) -> Rig[Any]:
    """Return the rig with the load of its runs."""
    load = options["load"]
    if load is not None and not isfinite(load):
        raise HydrostateError(f"--load must be finite, got {load:g} N")
    return rig if load is None else replace(rig, parameters=replace(rig.parameters, load_force=load))


def _prepare(rig: Rig[Any], options: Options) -> tuple[Rig[Any], Signature | None]:
    """Return the motor under its load, and the signature of a healthy run, if there is one."""
    healthy = options["healthy"]
    return _with_load(rig, options), None if healthy is None else logged_signature(healthy)


def _prospects(rig: Rig[Any], options: Options) -> list[Finding]:
    return [motor_prospect(_with_load(rig, options).parameters, options["frequency"], options["voltage"])]


OWN_ENTRIES: Result = {"misfit": {}, "candidates": [], "lookalikes": []}
"""Entries that other kinds do not have."""


def _estimate_entries(found: Finding) -> dict[str, Any]:
    return {**OWN_ENTRIES, **finding_entries(found), "misfit": {"electrodes": found.evidence.pattern}}


def _fault_entries(found: Finding) -> dict[str, Any]:
    diagnosis = found.evidence
    return {
        **finding_entries(found),
        "misfit": {"signature": diagnosis.best.chi_square / diagnosis.freedom},
        "candidates": [_candidate_entry(match) for match in diagnosis.group],
        "lookalikes": list(diagnosis.lookalikes),
    }


def _candidate_entry(match: Match) -> dict[str, Any]:
    severity = None if match.name == HEALTHY else quantity_entry(severity_of(match))
    return {"fault": match.name, "probability": match.probability, "severity": severity}


def _faults_shown(results: Sequence[Result], options: Options) -> "Iterable[RenderableType]":
    del options
    shown = table("log", "fault", "probability [%]", "severity", "95 % interval", "unit")
    for name, result in zip(short_names(results), results, strict=True):
        if result["condition"] is None:
            shown.add_row(name, "UNKNOWN", "-", "-", "-", "-")
            continue
        for one in result["candidates"]:
            size = one["severity"]
            cells = ("-", "-", "-")
            if size is not None:
                scale, unit = reader_unit(size["unit"])
                value, low, high = (f"{scale * each:.3g}" for each in (size["value"], *size["ci95"]))
                cells = (value, f"{low} to {high}", unit)
            shown.add_row(name, one["fault"].replace("_", " "), percent_text(one["probability"]), *cells)
    yield shown
    yield from messages_shown(results)


LOG_VERB_FIELDS: Any = {
    "prepare": _prepare,
    "options": {"load": None, "healthy": None},
    "blank": {**BLANK, **OWN_ENTRIES},
}

DIAPHRAGM_MOTOR = ActuatorKind(
    name=NAME,
    description="seven piezo diaphragms in series that pump into a cylinder",
    parameters=DiaphragmMotorParameters,
    channels={name: CHANNELS[name] for name in (DRIVE, *ELECTRODES, POSITION)},
    required=(DRIVE,),
    conditions=(HEALTHY, *MOTOR_FAULTS),
    rig_name=UNNAMED,
    simulate=Simulation(run=_simulate, options=SINE | BENCH | {"load": None, "fault": None}),
    estimate=LogVerb(
        run=lambda record, rig, calibration: motor_finding(record, rig.parameters, calibration=calibration),
        entries=_estimate_entries,
        **LOG_VERB_FIELDS,
    ),
    diagnose=LogVerb(
        run=lambda record, rig, calibration: motor_fault_finding(record, rig.parameters, calibration=calibration),
        entries=_fault_entries,
        screen=_faults_shown,
        **LOG_VERB_FIELDS,
    ),
    identifiability=Experiment(run=_prospects, options=SINE | {"load": None}),
)
