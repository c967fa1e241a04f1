"""Runs of the piezo-stack actuator: drive, sensors, and the flow that a test bench infers (test-bench section)."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from plant.arrays import Array
from plant.components.piezo_stack import stack_force
from plant.errors import DriveError
from plant.log.record import Record
from plant.piezo_stack.model import StackValues, stack_pressures
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.trajectory import NAME, run_stack
from plant.runs import checked_series, require_drivable, require_frequency, sample_count, with_noise
from plant.sensors.sensors import require_not_negative
from plant.units import si

HIGHEST_VOLTAGE = 150.0
"""Rated voltage of the stack [V]; it does not withstand reverse voltage (output performance section)."""

HIGHEST_FREQUENCY = 450.0
"""Frequency limit set by the amplifier's power [Hz] (output performance section)."""

SAMPLE_TIME = 5e-5
"""Time between the samples of a log [s]."""

FINE_TIME = 1e-5
"""Time between samples for a nearly ideal sine drive [s]: linear interpolation errs by 4e-5."""

OBSERVED = "the piezo-stack paper's test bench has these sensors; their noise is judged"


@dataclass(frozen=True, kw_only=True)
class StackSensors:
    """Standard deviations of the bench sensors' white Gaussian noise; the drive voltage is known exactly.

    Raises
    ------
    RigError
        If a noise is negative or not finite.

    Examples
    --------
    >>> StackSensors().stack_displacement_m
    5e-08
    """

    stack_displacement_m: float = si(5e-8, "m", "eddy current sensor on the stack", OBSERVED)
    stack_force_n: float = si(10.0, "N", "force sensor below the stack", OBSERVED)
    position_m: float = si(2e-5, "m", "laser on the cylinder's rod", OBSERVED)
    chamber_pressure_pa: float = si(1e4, "Pa", "pressure sensor in the pump chamber", OBSERVED)

    def __post_init__(self) -> None:
        require_not_negative(self)


BENCH_SENSORS = StackSensors()
"""Sensors of the bench."""

IDEAL_SENSORS = StackSensors(stack_displacement_m=0.0, stack_force_n=0.0, position_m=0.0, chamber_pressure_pa=0.0)
"""Ideal sensors, without noise."""

STACK_SENSORS: Mapping[str, StackSensors] = {"bench": BENCH_SENSORS, "ideal": IDEAL_SENSORS}
"""The sensor sets by name."""


def sine_drive(
    frequency: float, peak_to_peak: float, duration: float, sample_time: float, bias: float | None = None
) -> Array:
    """Return a biased sine that starts at its lowest voltage (Source: output performance section, 140 V on 70 V).

    Parameters
    ----------
    frequency : float
        Frequency [Hz], up to 450.
    peak_to_peak : float
        Voltage from trough to crest [V].
    duration, sample_time : float
        Length of the signal and time between samples [s].
    bias : float, optional
        Mean voltage [V]; half the peak-to-peak voltage if not given.

    Returns
    -------
    ndarray, shape (n,)
        Voltage [V] at ``k * sample_time``, the end included.

    Raises
    ------
    DriveError
        If the voltage would leave 0 to 150 V, or the frequency 0 to 450 Hz, or samples are too few for it.

    Examples
    --------
    >>> sine_drive(250.0, 140.0, 4e-3, 1e-3).round(6).tolist()
    [0.0, 70.0, 140.0, 70.0, 0.0]
    """
    count = sample_count(duration, sample_time) + 1
    require_drivable(frequency, HIGHEST_FREQUENCY)
    require_frequency("frequency", frequency, sample_time)
    middle = 0.5 * peak_to_peak if bias is None else bias
    voltage = middle - 0.5 * peak_to_peak * np.cos(2.0 * np.pi * frequency * sample_time * np.arange(count))
    return checked_voltage(voltage)


def checked_voltage(voltage: Array, overshoot: float = 0.0) -> Array:
    """Return the drive if the stack withstands it. Source: output performance section.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Drive at the samples [V].
    overshoot : float
        Amount by which the drive may leave its range, as a measured one does because of noise [V].

    Returns
    -------
    ndarray, shape (n,)
        The unchanged drive [V].

    Raises
    ------
    DriveError
        If it is no series, not finite, or leaves 0 to 150 V.
    """
    drive = checked_series(voltage)
    low, high = float(drive.min()), float(drive.max())
    slack = max(overshoot, 1e-9 * HIGHEST_VOLTAGE)
    if low < -slack or high > HIGHEST_VOLTAGE + slack:
        raise DriveError(f"the stack takes 0 to {HIGHEST_VOLTAGE:g} V, got a drive from {low:g} to {high:g} V")
    return drive


def stack_channels(states: Array, parameters: StackValues) -> Mapping[str, Array]:
    """Return the bench's channels: displacement, force below the stack (equation 2), rod, chamber pressure.

    Parameters
    ----------
    states : ndarray, shape (n, 19)
        As named in `plant.piezo_stack.model.STATES`.
    parameters : PiezoStackParameters or namespace
        The actuator. A namespace with the same names may hold values that no actuator has, such as a negative leakage.

    Returns
    -------
    Mapping[str, ndarray]
        Channels of shape (n,).
    """
    p = parameters
    x, v, driven, h = states.T[:4]
    return {
        "stack_displacement_m": x,
        "stack_force_n": stack_force(driven, h, x, v, p.stack_stiffness, p.stack_damping),
        "position_m": states[:, 12],
        "chamber_pressure_pa": stack_pressures(tuple(states.T), p).chamber,
    }


def simulate_stack(
    parameters: PiezoStackParameters,
    voltage: Array,
    sample_time: float,
    *,
    sensors: StackSensors = IDEAL_SENSORS,
    rng: np.random.Generator | None = None,
    keep_truth: bool = False,
) -> Record:
    """Run the actuator from rest under a drive and return what its sensors log (equations 1 to 22).

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Drive at the samples [V], linearly interpolated.
    sample_time : float
        Seconds between samples [s].
    rng : numpy.random.Generator, optional
        Source of sensor noise; required unless the sensors are ideal.
    keep_truth : bool
        Whether to add the noiseless channels as ``true_...``.

    Returns
    -------
    Record
        ``drive_voltage_v`` and the channels of `stack_channels`.

    Raises
    ------
    DriveError
        If the drive is not a finite series within 0 to 150 V.
    HydrostateError
        If the state stops being finite, or noise is wanted without a generator.

    Examples
    --------
    >>> record = simulate_stack(PiezoStackParameters(), sine_drive(275.0, 140.0, 0.01, 1e-5), 1e-5)
    >>> round(1e6 * float(np.ptp(record["stack_displacement_m"])))
    39
    """
    drive = checked_voltage(voltage)
    states = run_stack(parameters, drive, sample_time)
    truth = {"drive_voltage_v": drive, **stack_channels(states, parameters)}
    noise = asdict(sensors)
    channels = with_noise(truth, noise, rng, keep_truth=keep_truth)
    metadata = {"plant": NAME, "parameters": asdict(parameters), "sensors": noise}
    return Record(sample_time, channels, metadata)
