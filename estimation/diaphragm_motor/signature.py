"""Signature of a diaphragm motor's log: tones of the seven electrodes and mean velocity of the rod.

Under a steady sine the electrodes' fundamentals and second harmonics, and the mean velocity, are 29 numbers. They are
computed from a log by least squares over whole cycles, with their covariance from the residuals, and from the plant by
`plant.diaphragm_motor.flow.operate`. The tolerance to which a motor agrees with its model is added to the sensors'
noise, because with noise alone the model would claim an accuracy that no bench reaches.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, pi

import numpy as np

from estimation.log_checks.longest_hold import require_live
from plant.arrays import Floats, Tones
from plant.diaphragm_motor.flow import operate
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import ELECTRODES, HIGHEST_FREQUENCY, HIGHEST_VOLTAGE
from plant.errors import LogError
from plant.log.record import Record

DRIVE, POSITION = "drive_voltage_v", "position_m"
"""Channels besides the electrodes."""

SETTLING_TIME = 0.1
"""Time from a log's start after which the motor has settled; the research gives 22 ms for 90 % [s]."""

FEWEST_CYCLES = 20
"""Fewest whole cycles to average."""

HARMONICS = 6
"""Number of harmonics that are fitted, so that the residuals are noise."""

LARGEST_UNSTEADINESS = 0.01
"""Largest deviation of a drive from a steady sine: root mean square over the sine's amplitude [dimensionless]."""

TOLERANCE: Mapping[str, float] = {
    "diaphragm_compliance": 0.005,
    "volume_a_volt": 0.005,
    "inertance": 0.005,
    "port_area": 0.005,
    "valve_lag": 0.005,
    "valve_resistance": 0.02,
}
"""Relative standard deviations by which a healthy motor differs from its model, judged [dimensionless]."""

GAIN_TOLERANCE = 0.005
"""Relative standard deviation of each electrode's gain, judged [dimensionless]."""

MODEL_ERROR = 0.002
"""Assumed error of the model in any tone, over the mean fundamental, and in velocity [dimensionless]."""


@dataclass(frozen=True)
class Drive:
    """A steady sine on the first diaphragm.

    Parameters
    ----------
    frequency : float
        Frequency [Hz].
    peak_to_peak : float
        Swing [V].
    phase : float
        Phase of ``sin`` at the log's first sample [rad].
    """

    frequency: float
    peak_to_peak: float
    phase: float


@dataclass(frozen=True)
class Signature:
    """The 29 numbers by which logs are compared.

    Parameters
    ----------
    values : ndarray, shape (29,)
        Fundamentals' real and imaginary parts, then those of the second harmonics [V], mean velocity [m/s].
    covariance : ndarray, shape (29, 29)
        Covariance from the sensors' noise alone.
    """

    drive: Drive
    values: Floats
    covariance: Floats

    @property
    def tones(self) -> Tones:
        """Electrodes' fundamentals relative to the drive [V]: amplitude and phase."""
        return self.values[:7] + 1j * self.values[7:14]

    @property
    def second_tones(self) -> Tones:
        """Electrodes' second harmonics relative to the drive [V]."""
        return self.values[14:21] + 1j * self.values[21:28]

    @property
    def velocity(self) -> float:
        """Mean velocity [m/s]."""
        return float(self.values[-1])

    def earlier(self, delay: float) -> "Signature":
        """Return the signature of electrodes that are earlier by a delay.

        Parameters
        ----------
        delay : float
            Time by which their tones turn [s].
        """
        turn = np.exp(2j * pi * self.drive.frequency * delay)
        first, second = turn * self.tones, turn**2 * self.second_tones
        values = np.concatenate([first.real, first.imag, second.real, second.imag, [self.velocity]])
        return replace(self, values=values)


def modelled_signature(p: DiaphragmMotorParameters, frequency: float, peak_to_peak: float) -> Floats:
    """Return a motor's signature from its model, without noise (section 7.1).

    Parameters
    ----------
    frequency, peak_to_peak : float
        Frequency and swing of the drive [Hz], [V].

    Returns
    -------
    ndarray, shape (29,)
        As in `Signature.values`.

    Examples
    --------
    >>> values = modelled_signature(DiaphragmMotorParameters(), 480.0, 200.0)
    >>> len(values), round(1e3 * float(values[-1]), 1)
    (29, 4.1)
    """
    point = operate(p, frequency, peak_to_peak)
    first, second = point.tones, point.second_tones
    return np.concatenate([first.real, first.imag, second.real, second.imag, [point.velocity]])


@lru_cache(maxsize=8)
def tolerance(p: DiaphragmMotorParameters, frequency: float, peak_to_peak: float) -> Floats:
    """Return the covariance with which a healthy motor's signature scatters about its model.

    Parameters
    ----------
    p : DiaphragmMotorParameters
        The healthy motor.
    frequency, peak_to_peak : float
        Frequency and swing of the drive [Hz], [V].

    Returns
    -------
    ndarray, shape (29, 29)
        Covariance of `Signature.values`.
    """
    base = modelled_signature(p, frequency, peak_to_peak)
    columns: list[Floats] = []
    for name, share in TOLERANCE.items():
        moved = replace(p, **{name: (1.0 + share) * getattr(p, name)})
        columns.append(modelled_signature(moved, frequency, peak_to_peak) - base)
    for i in range(len(ELECTRODES)):
        own = np.zeros(len(base))
        own[i : 4 * len(ELECTRODES) : len(ELECTRODES)] = GAIN_TOLERANCE
        columns.append(own * base)
    floor = np.full(len(base), MODEL_ERROR * float(np.mean(np.hypot(base[:7], base[7:14]))))
    floor[-1] = MODEL_ERROR * max(abs(float(base[-1])), _LEAST_SPEED)
    spread = np.column_stack(columns)
    return spread @ spread.T + np.diag(floor**2)


def logged_signature(record: Record, start: float = SETTLING_TIME) -> Signature:
    """Return the signature of a log after settling, over whole cycles, by least squares.

    Parameters
    ----------
    record : Record
        ``drive_voltage_v``, ``electrode_1_v`` to ``electrode_7_v`` and ``position_m``, under a steady sine.
    start : float
        Time from which the log is used [s].

    Returns
    -------
    Signature
        Its values, and their covariance from the residuals of the tones.

    Raises
    ------
    LogError
        If a channel or samples are missing, the drive is no steady sine, the log is too short, or position holds still.
    """
    require_channels(record)
    settled = ceil(start / record.sample_time)
    drive = steady_drive(record[DRIVE][settled:], record.sample_time)
    cycles = whole_cycles(len(record) - settled, record.sample_time, drive.frequency)
    count = int(cycles / drive.frequency / record.sample_time)
    chosen = slice(settled, settled + count)
    angle = drive.phase + 2.0 * pi * drive.frequency * record.sample_time * np.arange(count)
    read = np.column_stack([record[name][chosen] for name in ELECTRODES])
    position = record[POSITION][chosen]
    tones, noise = fitted_tones(read, angle, trend=3)
    path, jitter = fitted_tones(position[:, None], angle, trend=1)
    velocity = float(path[1, 0]) * 2.0 / (count * record.sample_time)
    steepest = np.sqrt(12.0 / count) / (count * record.sample_time) * float(jitter[0])
    fundamental, second = tones[4:6], tones[6:8]
    values = np.concatenate([*fundamental, *second, [velocity]])
    variances = np.concatenate([*(2.0 / count * noise**2 for _ in range(4)), [steepest**2]])
    return Signature(drive, values, np.diag(variances))


def steady_drive(voltage: Floats, sample_time: float) -> Drive:
    """Return the steady sine of a drive.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Drive [V].
    sample_time : float
        Time between samples [s].

    Raises
    ------
    LogError
        If it is no steady sine.

    Examples
    --------
    >>> steady_drive(50.0 * np.sin(2 * pi * 123.4 * 1e-4 * np.arange(2000)), 1e-4).frequency.__round__(3)
    123.4
    """
    size = len(voltage)
    if size < 8 or float(np.ptp(voltage)) <= 0.0:
        raise LogError(f"{DRIVE} must be a steady sine from {SETTLING_TIME:g} s on, got no swing")
    spectrum = np.abs(np.fft.rfft((voltage - voltage.mean()) * np.hanning(size)))
    frequency = float(np.argmax(spectrum)) / (size * sample_time)
    time = sample_time * np.arange(size)
    halves = (voltage - voltage.mean()) * np.exp(-2j * pi * frequency * time)
    turn = float(np.angle(halves[size // 2 :].sum() / halves[: size // 2].sum()))
    frequency += turn / (pi * size * sample_time)
    for _ in range(_REFINEMENTS):
        design, found = _sine_fit(voltage, frequency, time)
        slope = 2.0 * pi * time * (found[0] * design[:, 1] - found[1] * design[:, 0])
        frequency += float(np.linalg.lstsq(np.column_stack([design, slope]), voltage, rcond=None)[0][3])
    design, found = _sine_fit(voltage, frequency, time)
    amplitude = float(np.hypot(found[0], found[1]))
    left = float(np.sqrt(np.mean((voltage - design @ found) ** 2)))
    if left > LARGEST_UNSTEADINESS * amplitude or not 0.0 < frequency <= HIGHEST_FREQUENCY:
        raise LogError(
            f"{DRIVE} must be a steady sine of up to {HIGHEST_FREQUENCY:g} Hz from {SETTLING_TIME:g} s on, got "
            f"{100.0 * left / max(amplitude, 1e-12):.3g} % beside a sine of {frequency:.4g} Hz"
        )
    if amplitude > HIGHEST_VOLTAGE * (1.0 + LARGEST_UNSTEADINESS):
        raise LogError(f"the diaphragms take {HIGHEST_VOLTAGE:g} V of either sign, got {DRIVE} of {amplitude:.4g} V")
    return Drive(frequency, 2.0 * amplitude, float(np.arctan2(found[1], found[0])))


def _sine_fit(voltage: Floats, frequency: float, time: Floats) -> tuple[Floats, Floats]:
    angle = 2.0 * pi * frequency * time
    design = np.column_stack([np.sin(angle), np.cos(angle), np.ones(len(time))])
    return design, np.linalg.lstsq(design, voltage, rcond=None)[0]


def fitted_tones(values: Floats, angle: Floats, *, trend: int) -> tuple[Floats, Floats]:
    """Fit a trend and the harmonics of a drive to signals.

    Parameters
    ----------
    values : ndarray, shape (n, channels)
        Signals [any unit].
    angle : ndarray, shape (n,)
        Phase of the drive [rad].
    trend : int
        Degree of the trend's polynomial, in time from -1 to 1.

    Returns
    -------
    tuple of ndarray, shapes (trend + 1 + 2 harmonics, channels) and (channels,)
        Coefficients (trend, then sine and cosine of each harmonic), standard deviation of the residuals.
    """
    line = np.linspace(-1.0, 1.0, len(angle))
    waves = [wave(k * angle) for k in range(1, HARMONICS + 1) for wave in (np.sin, np.cos)]
    design = np.column_stack([*(line**k for k in range(trend + 1)), *waves])
    found = np.linalg.lstsq(design, values, rcond=None)[0]
    free = max(1, len(angle) - design.shape[1])
    return found, np.sqrt(np.sum((values - design @ found) ** 2, axis=0) / free)


def whole_cycles(samples: int, sample_time: float, frequency: float) -> int:
    """Return the number of whole cycles.

    Parameters
    ----------
    samples : int
        Number of samples.
    sample_time, frequency : float
        Time between them [s], frequency [Hz].

    Raises
    ------
    LogError
        If they are fewer than `FEWEST_CYCLES`.
    """
    whole = int(samples * sample_time * frequency + 1e-6)
    if whole < FEWEST_CYCLES:
        raise LogError(
            f"{FEWEST_CYCLES} cycles of {frequency:.4g} Hz are needed after the first {SETTLING_TIME:g} s, got {whole}"
        )
    return whole


def require_channels(record: Record) -> None:
    """Refuse a log that lacks a channel or samples, ends before the motor settles, or whose position stands still.

    Raises
    ------
    LogError
        If it does.
    """
    for name in (DRIVE, *ELECTRODES, POSITION):
        if name not in record:
            raise LogError(f"{name} is needed; the log has {', '.join(record)}")
        lost = int(np.sum(~np.isfinite(record[name])))
        if lost:
            raise LogError(f"{name} must be whole, got {lost} missing samples")
    length = len(record) * record.sample_time
    if length <= SETTLING_TIME:
        raise LogError(
            f"a log must be longer than the {SETTLING_TIME:g} s in which the motor settles, got {length:.3g} s"
        )
    require_live(record, [POSITION])  # an electrode may be dead: its gain is estimated


_REFINEMENTS = 4
_LEAST_SPEED = 1e-3
