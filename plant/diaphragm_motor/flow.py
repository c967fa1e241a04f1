"""Steady operation of the diaphragm motor: mean flow, velocity, and the phasor of each electrode (section 7)."""

from dataclasses import dataclass, replace
from math import ceil, pi

import numpy as np

from plant.arrays import Array, Tones
from plant.diaphragm_motor.model import FLOWS, SIDE_A, SIDE_B, VELOCITY, deflections
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import LONGEST_STEP, motor_drive, require_liquid, run_motor

SETTLING_TIME = 0.08
"""Settling time of a run, rounded up to whole cycles [s]."""

AVERAGING_TIME = 0.04
"""Averaging time after settling, rounded up to whole cycles [s]."""

FEWEST_CYCLES = 10
"""Minimum number of cycles in an average."""

OPEN_PORT_CONDUCTANCE = 1e-3
"""Conductance of a valve land with negligible pressure drop [m^3/(s Pa^0.5)]."""


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """Averages over whole cycles of a settled run.

    Parameters
    ----------
    inlet_flow, outlet_flow : float
        Mean flow through the first and the last check valve [m^3/s].
    velocity : float
        Mean velocity of the piston [m/s].
    pressure : float
        Mean pressure of side A minus side B [Pa].
    tones : ndarray of complex, shape (7,)
        Phasors of the electrode voltages at the drive frequency: amplitude [V] and phase relative to the first
        diaphragm's drive.
    second_tones : ndarray of complex, shape (7,)
        Phasors at twice the drive frequency.
    """

    inlet_flow: float
    outlet_flow: float
    velocity: float
    pressure: float
    tones: Tones
    second_tones: Tones


def pump_alone(parameters: DiaphragmMotorParameters) -> DiaphragmMotorParameters:
    """Return the motor with its pump running freely to tank, the condition in which flow is measured (section 7.1).

    Returns
    -------
    DiaphragmMotorParameters
        The same motor with a centred directional valve that causes no pressure drop.
    """
    return replace(parameters, spool=0.0, land_conductance=OPEN_PORT_CONDUCTANCE)


def tone(values: Array, sample_time: float, frequency: float, start: float = 0.0) -> Tones:
    """Return the phasor of one frequency over whole cycles of a signal, by its Fourier coefficient (section 7.1).

    Parameters
    ----------
    values : ndarray, shape (n,) or (n, channels)
        Samples over whole cycles [any unit].
    sample_time : float
        Seconds between samples [s].
    frequency : float
        Frequency of the sine [Hz].
    start : float
        Time of the first sample on the clock that defines the phase [s].

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
        Drive frequency [Hz].
    peak_to_peak : float
        Peak-to-peak drive voltage [V].
    longest_step : float
        Longest step [s]; each cycle has a whole number of steps.
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
        If the state stops being finite, or a place is out of liquid once settled.

    Examples
    --------
    >>> point = operate(pump_alone(DiaphragmMotorParameters()), 480.0, 200.0)
    >>> round(6e7 * point.outlet_flow, 1)
    109.6
    """
    p = parameters
    a_cycle = ceil(1.0 / (frequency * longest_step) - 1e-9)
    between = 1.0 / (frequency * a_cycle)
    settling = ceil(SETTLING_TIME * frequency) * a_cycle
    measured = max(FEWEST_CYCLES, ceil(AVERAGING_TIME * frequency)) * a_cycle
    drive = motor_drive(frequency, peak_to_peak, (settling + measured) * between, between)
    states = run_motor(p, drive, between, longest_step=longest_step, start=start)[settling:-1]
    began = settling * between
    require_liquid(states, p, between, began)
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
