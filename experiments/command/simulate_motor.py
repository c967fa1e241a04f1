"""`hydrostate simulate --plant diaphragm-motor`: a run of the diaphragm motor, as its sensors would have logged it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from experiments.command.options import require_one_of
from experiments.command.streams import note
from faults.diaphragm_motor import motor_with_fault
from plant.diaphragm_motor_parameters import DiaphragmMotorParameters
from plant.diaphragm_motor_run import MOTOR_SENSORS, NAME, SAMPLE_TIME, motor_drive, simulate_motor
from plant.errors import HydrostateError
from plant.record import Record

DEFAULTS: Mapping[str, float] = {"--frequency": 480.0, "--voltage": 200.0, "--load": 0.0}
"""What options are where they are not given: frequency [Hz], voltage peak to peak [V], load [N]."""

DURATION = 0.2
"""Length of a run [s], of which the motor takes some hundredths to settle."""


def simulated_motor(
    options: Mapping[str, Any],
    duration: float | None,
    sample_time: float | None,
    sensors: str,
    seed: int,
) -> tuple[Record, dict[str, Any]]:
    """Return a run of the diaphragm motor, and what made it.

    Parameters
    ----------
    options : Mapping[str, Any]
        The plant's own options by name, None where not given.
    duration, sample_time : float or None
        Length and time between samples [s]; the bench's if not given.
    sensors : str
        ``bench`` or ``ideal``.
    seed : int
        Seed of the noise.

    Returns
    -------
    tuple of Record and dict[str, Any]
        The run, and what to say of it.

    Raises
    ------
    HydrostateError
        If an option is not usable.
    """
    require_one_of("--sensors", sensors, list(MOTOR_SENSORS))
    chosen = {name: value if options[name] is None else float(options[name]) for name, value in DEFAULTS.items()}
    frequency, swing, load = chosen.values()
    motor = _with_fault(replace(DiaphragmMotorParameters(), load_force=load), options["--fault"])
    between = sample_time or SAMPLE_TIME
    drive = motor_drive(frequency, swing, duration or DURATION, between)
    rng = np.random.default_rng(seed)
    record = simulate_motor(motor, drive, between, sensors=MOTOR_SENSORS[sensors], rng=rng)
    made_of = {"frequency_hz": frequency, "voltage_v": swing, "load_n": load, "fault": options["--fault"], "seed": seed}
    position = record["position_m"]
    if abs(float(position[-1])) > motor.half_stroke:
        note(f"the rod reaches its end stop within {record.duration:g} s")
    half = len(position) // 2
    speed = float(position[-1] - position[half]) / (between * (len(position) - 1 - half))
    return record.annotate(**made_of), {"plant": NAME, **made_of, "sensors": sensors, "velocity_m_s": round(speed, 6)}


def _with_fault(motor: DiaphragmMotorParameters, fault: str | None) -> DiaphragmMotorParameters:
    """Return the motor with a fault such as ``valve_4_leak=0.1``, a name and its severity."""
    if fault is None:
        return motor
    name, _, severity = fault.partition("=")
    try:
        return motor_with_fault(motor, name, float(severity))
    except ValueError:
        raise HydrostateError(
            f"--fault must be a name and a severity, such as valve_4_leak=0.1, got {fault!r}"
        ) from None
