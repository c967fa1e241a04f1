"""Steady operation of the diaphragm motor: mean flow, velocity, and each electrode's tone (section 7)."""

from dataclasses import dataclass, replace
from math import ceil, pi

import numpy as np

from plant.arrays import Array, Tones
from plant.diaphragm_motor.model import FLOWS, SIDE_A, SIDE_B, VELOCITY, deflections
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import LONGEST_STEP, motor_drive, run_motor

SETTLING = 0.08
"""Time that a run is given to settle, in whole cycles at least as long [s]."""

MEASURED = 0.04
"""Time over which a settled run is averaged, in whole cycles at least as long [s]."""

FEWEST_CYCLES = 10
"""Fewest cycles that are averaged."""

OPEN_PORT = 1e-3
"""Conductance of a land that takes next to no pressure [m^3/(s Pa^0.5)]."""


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """Averages of a settled run over whole cycles.

    Parameters
    ----------
    inlet_flow, outlet_flow : float
        Mean flow through the first and the last check valve [m^3/s].
    velocity : float
        Mean velocity of the piston [m/s].
    pressure : float
        Mean of side A's pressure less side B's [Pa].
    tones : ndarray of complex, shape (7,)
        Electrodes' voltages at the drive's frequency, against the first diaphragm's drive: amplitude [V] and phase.
    second_tones : ndarray of complex, shape (7,)
        The same at twice the frequency.
    """

    inlet_flow: float
    outlet_flow: float
    velocity: float
    pressure: float
    tones: Tones
    second_tones: Tones


def pump_alone(parameters: DiaphragmMotorParameters) -> DiaphragmMotorParameters:
    """Return the motor with its pump running freely to tank, as its flow is measured (section 7.1).

    Returns
    -------
    DiaphragmMotorParameters
        The same with the directional valve at its centre and no pressure lost in it.
    """
    return replace(parameters, spool=0.0, land_conductance=OPEN_PORT)


def tone(values: Array, sample_time: float, frequency: float, start: float = 0.0) -> Tones:
    """Return the sine of a frequency in whole cycles of a signal, by its Fourier coefficient (section 7.1).

    Parameters
    ----------
    values : ndarray, shape (n,) or (n, channels)
        Samples over whole cycles [any unit].
    sample_time : float
        Seconds between samples [s].
    frequency : float
        Of the sine [Hz].
    start : float
        Time of the first sample on the clock that phases are against [s].

    Returns
    -------
    ndarray of complex, shape () or (channels,)
        Amplitude and phase: ``sin(2 pi f t)`` gives 1.

    Examples
    --------
    >>> t = 1e-3 * np.arange(100)
    >>> complex(tone(3.0 * np.sin(2 * pi * 50.0 * t), 1e-3, 50.0)).real.__round__(9)
    3.0
    """
    time = start + sample_time * np.arange(len(values))
    return 2j / len(values) * (np.exp(-2j * pi * frequency * time) @ values)


def operate(
    parameters: DiaphragmMotorParameters,
    frequency: float,
    peak_to_peak: float,
    *,
    longest_step: float = LONGEST_STEP,
    start: Array | None = None,
) -> OperatingPoint:
    """Run the motor on a sine until it has settled, and average whole cycles (section 7.1).

    Parameters
    ----------
    frequency : float
        Of the drive [Hz].
    peak_to_peak : float
        Swing of the drive [V].
    longest_step : float
        Longest step [s]; a whole count of steps makes a cycle.
    start : ndarray, shape (28,), optional
        Initial state; at rest if not given.

    Returns
    -------
    OperatingPoint
        Flow, velocity, pressure and tones.

    Raises
    ------
    DriveError
        If the diaphragms do not take the drive.
    HydrostateError
        If the state stops being finite.

    Examples
    --------
    >>> point = operate(pump_alone(DiaphragmMotorParameters()), 480.0, 200.0)
    >>> round(6e7 * point.outlet_flow, 1)
    109.6
    """
    p = parameters
    a_cycle = ceil(1.0 / (frequency * longest_step) - 1e-9)
    between = 1.0 / (frequency * a_cycle)
    settling = ceil(SETTLING * frequency) * a_cycle
    measured = max(FEWEST_CYCLES, ceil(MEASURED * frequency)) * a_cycle
    drive = motor_drive(frequency, peak_to_peak, (settling + measured) * between, between)
    states = run_motor(p, drive, between, longest_step=longest_step, start=start)[settling:-1]
    began = settling * between
    bent = deflections(states, drive[settling:-1], p) * p.sensing_gain * np.array(p.sensor_gain)
    first, second = (
        tone(bent, between, order * frequency, began) / (1.0 - 1j * p.sensing_corner / (order * frequency))
        for order in (1.0, 2.0)
    )
    flows = states[:, FLOWS].mean(axis=0)
    return OperatingPoint(
        inlet_flow=float(flows[0]),
        outlet_flow=float(flows[-1]),
        velocity=float(states[:, VELOCITY].mean()),
        pressure=float((states[:, SIDE_A] - states[:, SIDE_B]).mean()),
        tones=first,
        second_tones=second,
    )
