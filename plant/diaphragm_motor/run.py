"""Runs of the diaphragm motor: its drive, its seven sensing electrodes, the rod's encoder (sections 2 and 7)."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from math import pi
from typing import TypeAlias

import numpy as np
from scipy.signal import lfilter

from plant.arrays import Array
from plant.diaphragm_motor.model import (
    POSITION,
    PRESSURES,
    SIDE_A,
    SIDE_B,
    STATES,
    MotorRow,
    at_rest,
    deflections,
    motor_row,
    motor_step,
)
from plant.diaphragm_motor.parameters import DIAPHRAGMS, DiaphragmMotorParameters
from plant.errors import DriveError, HydrostateError
from plant.log.record import Record
from plant.runs import checked_series, require_drivable, require_finite, sample_count, steps_a_sample, with_noise
from plant.sensors.sensors import require_not_negative
from plant.solvers.trajectory import compile_trajectory
from plant.units import si

Schedule: TypeAlias = Sequence[tuple[float, DiaphragmMotorParameters]]
"""Start times [s] and the motor from then on: a load step, a switched valve, a fault. The first time is 0."""

NAME = "diaphragm-motor"
"""Name of the plant on the command line and in metadata."""

HIGHEST_VOLTAGE = 150.0
"""Largest voltage of either polarity [V]: 0.75 kV/mm on 0.2 mm, below the coercive field (errata M27)."""

HIGHEST_FREQUENCY = 1000.0
"""Highest frequency of the drive [Hz]; the paper's range ends at 600 Hz (abstract)."""

LONGEST_STEP = 1e-5
"""Step of the integrator [s]; halving it changes the mean flow by 0.02 %."""

SAMPLE_TIME = 2e-5
"""Time between the samples of a log [s]: 104 in a cycle of 480 Hz."""

FEWEST_SAMPLES = 20
"""Minimum samples in a cycle: linear interpolation between them then errs by 1 % for a sine."""

RAMP_TIME = 0.01
"""Time over which a drive rises to its full amplitude [s]."""

ELECTRODES = tuple(f"electrode_{i}_v" for i in range(1, DIAPHRAGMS + 1))
"""Channels of the sensing electrodes, ordered from the inlet."""

JUDGED = "judged, errata M22"

_ROUNDING = 1e-12
"""Fraction of the supply pressure by which the least pressure may be missed due to rounding."""


@dataclass(frozen=True, kw_only=True)
class MotorSensors:
    """Standard deviations of the sensors' white Gaussian noise; the drive voltage is known exactly.

    Raises
    ------
    RigError
        If a noise is negative or not finite.

    Examples
    --------
    >>> MotorSensors().electrode_v
    0.02
    """

    electrode_v: float = si(0.02, "V", "each sensing electrode", JUDGED)
    position_m: float = si(2e-6, "m", "encoder on the rod", JUDGED)

    def __post_init__(self) -> None:
        require_not_negative(self)


BENCH_SENSORS = MotorSensors()
"""Sensors of the bench."""

IDEAL_SENSORS = MotorSensors(electrode_v=0.0, position_m=0.0)
"""Ideal sensors, without noise."""

MOTOR_SENSORS: Mapping[str, MotorSensors] = {"bench": BENCH_SENSORS, "ideal": IDEAL_SENSORS}
"""The sensor sets by name."""


def motor_drive(frequency: float, peak_to_peak: float, duration: float, sample_time: float) -> Array:
    """Return an unbiased sine that rises to its amplitude over `RAMP_TIME` (section 2; volts peak to peak, errata M27).

    Parameters
    ----------
    frequency : float
        Frequency [Hz], up to 1000.
    peak_to_peak : float
        Voltage from trough to crest [V], up to 300.
    duration, sample_time : float
        Length of the signal and time between samples [s].

    Returns
    -------
    ndarray, shape (n,)
        Drive of the first diaphragm [V] at ``k * sample_time``, the end included.

    Raises
    ------
    DriveError
        If the voltage would leave -150 to 150 V, the frequency 0 to 1000 Hz, or samples are too few for it.

    Examples
    --------
    >>> motor_drive(50.0, 200.0, 0.02, 1e-3)[::5].round(6).tolist()
    [0.0, 50.0, 0.0, -100.0, -0.0]
    """
    count = sample_count(duration, sample_time) + 1
    require_drivable(frequency, HIGHEST_FREQUENCY)
    if frequency * sample_time * FEWEST_SAMPLES > 1.0 + 1e-9:
        most = 1.0 / (FEWEST_SAMPLES * frequency)
        raise DriveError(
            f"sample_time must be at most {most:.3g} s, {FEWEST_SAMPLES} samples in a cycle of {frequency:g} Hz, "
            f"got {sample_time:g} s"
        )
    time = sample_time * np.arange(count)
    swing = 0.5 * peak_to_peak * np.minimum(time / RAMP_TIME, 1.0)
    return _checked_drive(swing * np.sin(2.0 * pi * frequency * time))


def _checked_drive(voltage: Array) -> Array:
    """Return the drive [V]; raise if it would depolarise the diaphragms (errata M27)."""
    drive = checked_series(voltage)
    most = float(np.max(np.abs(drive)))
    if most > HIGHEST_VOLTAGE * (1.0 + 1e-9):
        raise DriveError(f"the diaphragms take {HIGHEST_VOLTAGE:g} V of either sign, got a drive of {most:g} V")
    return drive


def run_motor(
    parameters: DiaphragmMotorParameters,
    voltage: Array,
    sample_time: float,
    *,
    longest_step: float = LONGEST_STEP,
    start: Array | None = None,
) -> Array:
    """Return the states of a run, from rest unless a start is given (`motor_step`, errata M22).

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Drive of the first diaphragm at the samples [V], linearly interpolated.
    sample_time : float
        Seconds between samples [s].
    longest_step : float
        Longest step [s].
    start : ndarray, shape (28,), optional
        Initial state; at rest if not given.

    Returns
    -------
    ndarray, shape (n, 28)
        States at the samples, as named in `plant.diaphragm_motor.model.STATES`.

    Raises
    ------
    HydrostateError
        If the state stops being finite.
    """
    run = compile_trajectory("diaphragm_motor", motor_step, len(STATES), MotorRow)
    initial = at_rest(parameters) if start is None else start
    row = motor_row(parameters)[None]
    states = run(initial, voltage, row, sample_time, steps_a_sample(sample_time, longest_step))
    require_finite(states, sample_time, NAME)
    return states


def require_liquid(states: Array, parameters: DiaphragmMotorParameters, sample_time: float, begin: float = 0.0) -> None:
    """Raise an error if a place of a run ran out of liquid (errata M22).

    The model then holds its pressure, and does not count the vapour that has to be filled before the pressure rises.

    Parameters
    ----------
    states : ndarray, shape (n, 28)
        As named in `plant.diaphragm_motor.model.STATES`.
    sample_time : float
        Seconds between samples [s].
    begin : float
        Time of the first sample [s].

    Raises
    ------
    HydrostateError
        If a chamber or a side of the cylinder is at the least pressure.
    """
    p = parameters
    lowest = p.least_pressure - p.supply_pressure
    places = np.column_stack([states[:, PRESSURES], states[:, [SIDE_A, SIDE_B]]])
    dry = places <= lowest + _ROUNDING * p.supply_pressure
    if not np.any(dry):
        return
    first = int(np.argmax(np.any(dry, axis=1)))
    place = int(np.argmax(dry[first]))
    where = f"chamber {place + 1}" if place < DIAPHRAGMS else f"side {'AB'[place - DIAPHRAGMS]} of the cylinder"
    raise HydrostateError(
        f"the {NAME} plant stopped at {begin + sample_time * first:.4f} s: {where} ran out of liquid; raise "
        f"supply_pressure, {p.supply_pressure:g} Pa, or lower the drive or the load"
    )


def electrode_voltages(bent: Array, parameters: DiaphragmMotorParameters, sample_time: float) -> Array:
    """Return the electrode voltages of a run from rest: gain and charge leakage (equation 15, errata M15).

    Parameters
    ----------
    bent : ndarray, shape (n, 7)
        Centre deflections [m].
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    ndarray, shape (n, 7)
        Voltages [V], by the trapezoidal rule.

    Examples
    --------
    >>> held = electrode_voltages(np.full((2, 7), 1e-6), DiaphragmMotorParameters(), 1e-3)
    >>> held[:, 0].round(3).tolist()
    [0.994, 0.981]
    """
    corner = pi * parameters.sensing_corner * sample_time
    passed = lfilter([1.0, -1.0], [1.0 + corner, corner - 1.0], bent, axis=0)
    return parameters.sensing_gain * np.array(parameters.sensor_gain) * np.asarray(passed)


def run_schedule(schedule: Schedule, voltage: Array, sample_time: float) -> tuple[Array, Array]:
    """Return states and deflections of a motor whose parameters change at given times, from rest (section 5.1).

    Parameters
    ----------
    schedule : sequence of tuple of float and DiaphragmMotorParameters
        Start times [s] and the motor from then on; the first time is 0, times rise.
    voltage : ndarray, shape (n,)
        Drive of the first diaphragm [V].
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    tuple of ndarray, shapes (n, 28) and (n, 7)
        States, deflections [m].

    Raises
    ------
    DriveError
        If the times do not rise from 0.
    HydrostateError
        If the state stops being finite, or a place runs out of liquid.
    """
    times = [time for time, _ in schedule]
    if not times or times[0] != 0.0 or any(b <= a for a, b in pairwise(times)):
        raise DriveError(f"a schedule's times must rise from 0, got {times}")
    last = len(voltage) - 1
    edges = [min(round(time / sample_time), last) for time in times] + [last]
    states = np.empty((len(voltage), len(STATES)))
    bent = np.empty((len(voltage), DIAPHRAGMS))
    start = None
    for (_, p), first, end in zip(schedule, edges[:-1], edges[1:], strict=True):
        here = slice(first, end + 1)
        states[here] = run_motor(p, voltage[here], sample_time, start=start)
        require_liquid(states[here], p, sample_time, sample_time * first)
        bent[here] = deflections(states[here], voltage[here], p)
        start = states[end].copy()
    return states, bent


def simulate_motor(
    parameters: DiaphragmMotorParameters | Schedule,
    voltage: Array,
    sample_time: float,
    *,
    sensors: MotorSensors = IDEAL_SENSORS,
    rng: np.random.Generator | None = None,
    keep_truth: bool = False,
) -> Record:
    """Run the motor from rest under a drive and return what its sensors log (sections 2 and 7, errata M22).

    Parameters
    ----------
    parameters : DiaphragmMotorParameters or sequence of tuple
        The motor, or start times [s] with the motor from then on, see `run_schedule`. Gain and corner of the electrodes
        are those of the first motor.
    voltage : ndarray, shape (n,)
        Drive of the first diaphragm at the samples [V], linearly interpolated.
    sample_time : float
        Seconds between samples [s].
    rng : numpy.random.Generator, optional
        Source of sensor noise; required unless the sensors are ideal.
    keep_truth : bool
        Whether to add the noiseless channels as ``true_...``.

    Returns
    -------
    Record
        ``drive_voltage_v``, ``electrode_1_v`` to ``electrode_7_v`` and ``position_m``.

    Raises
    ------
    DriveError
        If the drive is not a finite series within -150 to 150 V.
    HydrostateError
        If the state stops being finite, a place runs out of liquid, or noise is wanted without a generator.

    Examples
    --------
    >>> record = simulate_motor(DiaphragmMotorParameters(), motor_drive(480.0, 200.0, 0.05, 2e-5), 2e-5)
    >>> round(1e3 * float(record["position_m"][-1]), 2)
    0.16
    """
    schedule: Schedule = ((0.0, parameters),) if isinstance(parameters, DiaphragmMotorParameters) else parameters
    drive = _checked_drive(voltage)
    states, bent = run_schedule(schedule, drive, sample_time)
    first = schedule[0][1]
    read = electrode_voltages(bent, first, sample_time)
    truth = {
        "drive_voltage_v": drive,
        **dict(zip(ELECTRODES, read.T, strict=True)),
        "position_m": states[:, POSITION],
    }
    noise = {**dict.fromkeys(ELECTRODES, sensors.electrode_v), "position_m": sensors.position_m}
    channels = with_noise(truth, noise, rng, keep_truth=keep_truth)
    metadata = {"plant": NAME, "parameters": asdict(first), "sensors": asdict(sensors)}
    return Record(sample_time, channels, metadata)
