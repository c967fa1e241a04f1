"""Suspected errors of units in a log, for actuators between a desk model and an excavator."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from plant.arrays import Array
from plant.errors import LogError
from plant.log.columns import TRUTH_PREFIX
from plant.log.notes import LogCode
from plant.notes import Note


@dataclass(frozen=True)
class Plausible:
    """Usual range of the largest magnitude of a channel (of a position, the span).

    Parameters
    ----------
    least, most : float
        The bounds, in units of ``unit``.
    unit : str
        The channel's SI unit.
    if_less, if_more : str
        The slip of units that a value below or above the bounds looks like.
    """

    least: float
    most: float
    unit: str
    if_less: str
    if_more: str


_PRESSURE = Plausible(1e4, 1e8, "Pa", "kPa or bar read as Pa", "Pa read as kPa or bar")
LIMITS: Mapping[str, Plausible] = {
    "motor_speed_rad_s": Plausible(0.5, 2000.0, "rad/s", "krad/s read as rad/s", "mrad/s read as rad/s"),
    "position_m": Plausible(1e-6, 5.0, "m", "km read as m, or mm converted twice", "mm read as m"),
    "velocity_m_s": Plausible(1e-5, 10.0, "m/s", "km/s read as m/s, or mm/s converted twice", "mm/s read as m/s"),
    "differential_pressure_pa": _PRESSURE,
    "pressure_a_pa": _PRESSURE,
    "pressure_b_pa": _PRESSURE,
    "motor_voltage_v": Plausible(1e-2, 2e3, "V", "kV read as V", "mV read as V"),
}
"""Each channel that has a usual magnitude; judged: a thousandfold slip of common rigs crosses a limit."""

MOTION_CHANNELS = ("motor_speed_rad_s", "position_m", "velocity_m_s")
"""Channels that show one motion: where one is out of range, comparing it with the others says nothing more."""

SAMPLE_TIME_RANGE = (5e-6, 0.5)
"""Sample times [s] between which hydraulics is logged."""

DISPLACEMENT_RATIO = 30.0
"""Ratio of displacement to integrated velocity that no calibration error explains."""

ALIKE, ALIKE_SUMS = 0.5, 0.9
"""Correlations from which two rates, or two running sums (which drift), are taken to show one motion."""

TRAVEL_RANGE = (1e-6, 0.1)
"""Piston travel a radian of pump [m], pump displacement over piston area: 3.7e-4 for the paper's rig."""


LARGEST, SMALLEST = 1e15, 1e-30
"""Sizes [SI] beyond which a value is no sensor's, whatever it measures."""


def require_measurable(channels: Mapping[str, Array], source: str) -> None:
    """Refuse values that no sensor gives, because results would not be finite numbers.

    Parameters
    ----------
    channels : Mapping[str, ndarray, shape (n,)]
        Values in SI; columns of simulated truth are passed over.
    source : str
        What messages call the log.

    Raises
    ------
    LogError
        If a value is too large, or a channel is nothing but values too small.

    Examples
    --------
    >>> require_measurable({"position_m": np.array([0.0, 1e200])}, "a.csv")
    Traceback (most recent call last):
    plant.errors.LogError: a.csv: position_m reaches 1e+200, no sensor gives more than 1e+15 (SI); check its column
    """
    for name, values in channels.items():
        size = 0.0 if name.startswith(TRUTH_PREFIX) or np.isnan(values).all() else float(np.nanmax(np.abs(values)))
        if size > LARGEST:
            said = f"reaches {size:.3g}, no sensor gives more than {LARGEST:g} (SI)"
            raise LogError(f"{name} {said}; check its column", source)
        if 0.0 < size < SMALLEST:
            said = f"reaches only {size:.3g}, no sensor gives less than {SMALLEST:g} (SI)"
            raise LogError(f"{name} {said}; check its column", source)


def implausibility_notes(sample_time: float, channels: Mapping[str, Array]) -> list[Note]:
    """Return a note for each suspected error of units, and if nothing moves.

    Parameters
    ----------
    sample_time : float
        Time between samples [s].
    channels : Mapping[str, ndarray, shape (n,)]
        Values in SI, NaN where a sample is missing.

    Examples
    --------
    >>> speed = 100.0 * np.sin(np.arange(100.0))
    >>> print(implausibility_notes(1e-3, {"motor_speed_rad_s": 1e3 * speed})[0])
    motor_speed_rad_s reaches 100000 rad/s, but at most 2000 rad/s is usual: check the unit (mrad/s read as rad/s?)
    """
    still = _stillness_note(channels)
    slips: list[Note] = []
    if sample_time < SAMPLE_TIME_RANGE[0]:
        slips.append(LogCode.SAMPLE_TIME_SHORT.note(sample_time_s=sample_time))
    if sample_time > SAMPLE_TIME_RANGE[1]:
        slips.append(LogCode.SAMPLE_TIME_LONG.note(sample_time_s=sample_time))
    for name in MOTION_CHANNELS:
        slips += _range_notes(name, channels)
    slips = slips or _displacement_notes(sample_time, channels) or _travel_notes(sample_time, channels)
    for name in sorted(LIMITS.keys() - MOTION_CHANNELS):
        slips += _range_notes(name, channels)
    return slips if still is None else [still, *slips]


def _span(values: Array) -> float:
    return float(np.nanmax(values) - np.nanmin(values))


def _stillness_note(channels: Mapping[str, Array]) -> Note | None:
    if channels and all(_span(values) == 0.0 for values in channels.values()):
        return LogCode.NOTHING_MEASURED.note()
    if "motor_speed_rad_s" in channels and _span(channels["motor_speed_rad_s"]) == 0.0:
        return LogCode.SPEED_CONSTANT.note()
    motion = [name for name in ("position_m", "velocity_m_s") if name in channels]
    if motion and all(_span(channels[name]) == 0.0 for name in motion):
        return LogCode.NOTHING_MOVES.note(channels=" and ".join(motion))
    return None


def _range_notes(name: str, channels: Mapping[str, Array]) -> list[Note]:
    if name not in channels:
        return []
    values, limits = channels[name], LIMITS[name]
    is_position = name == "position_m"
    size = _span(values) if is_position else float(max(np.nanmax(values), -np.nanmin(values)))
    seen = {"channel": name, "verb": "spans" if is_position else "reaches", "size": size, "unit": limits.unit}
    if size > limits.most:
        return [LogCode.CHANNEL_LARGE.note(**seen, limit=limits.most, slip=limits.if_more)]
    if 0.0 < size < limits.least and (_above_noise(values) or not is_position):
        return [LogCode.CHANNEL_SMALL.note(**seen, limit=limits.least, slip=limits.if_less)]
    return []


def _above_noise(values: Array) -> bool:
    """Tell a signal from sensor noise: white noise, or its derivative, has large second differences."""
    if _span(values) == 0.0:
        return False
    present = values[np.isfinite(values)]
    scaled = present / np.max(np.abs(present))
    noise = float(np.mean(np.diff(scaled, 2) ** 2)) / 6.0
    return float(np.var(scaled)) > 4.0 * noise


def _displacement_notes(sample_time: float, channels: Mapping[str, Array]) -> list[Note]:
    """Compare the position with the integral of the velocity."""
    if "position_m" not in channels or "velocity_m_s" not in channels:
        return []
    ratio = _gain(channels["position_m"], _integrated(sample_time, channels["velocity_m_s"]), ALIKE_SUMS)
    if (
        ratio is None
        or 1.0 / DISPLACEMENT_RATIO < ratio < DISPLACEMENT_RATIO
        or not _above_noise(channels["velocity_m_s"])
    ):
        return []
    slip = "mm read as m, or s read as ms" if ratio > 1.0 else "mm/s read as m/s, or ms read as s"
    return [LogCode.POSITION_AND_VELOCITY_UNITS.note(ratio=ratio, slip=slip)]


def _travel_notes(sample_time: float, channels: Mapping[str, Array]) -> list[Note]:
    """Compare the piston's motion with the pump's."""
    if "motor_speed_rad_s" not in channels:
        return []
    speed = channels["motor_speed_rad_s"]
    if "velocity_m_s" in channels:
        name, travel = "velocity_m_s", _gain(channels["velocity_m_s"], speed, ALIKE)
    elif "position_m" in channels:
        turned = _integrated(sample_time, speed)
        name, travel = "position_m", _gain(channels["position_m"], turned, ALIKE_SUMS)
    else:
        return []
    if travel is None or TRAVEL_RANGE[0] < travel < TRAVEL_RANGE[1]:
        return []
    return [LogCode.TRAVEL_UNITS.note(travel_m=travel, least=TRAVEL_RANGE[0], most=TRAVEL_RANGE[1], channel=name)]


def _integrated(sample_time: float, rate: Array) -> Array:
    present = np.flatnonzero(np.isfinite(rate))
    whole = rate if len(present) == len(rate) else np.interp(np.arange(len(rate)), present, rate[present])
    return np.cumsum(whole) * sample_time


def _gain(output: Array, cause: Array, alike: float) -> float | None:
    """Return the ratio of the amplitudes of two signals without their trends; None if their shapes differ."""
    there = np.isfinite(output) & np.isfinite(cause)
    if there.sum() < 3 or not _above_noise(output):
        return None
    y, x = _detrended(output[there]), _detrended(cause[there])
    size_y, size_x = float(np.linalg.norm(y)), float(np.linalg.norm(x))
    if size_x == 0.0 or size_y == 0.0 or not abs(float(y @ x)) >= alike * size_x * size_y:
        return None
    return size_y / size_x


def _detrended(values: Array) -> Array:
    ramp = np.linspace(-1.0, 1.0, len(values))
    level = values - values.mean()
    return level - ramp * float(ramp @ level) / float(ramp @ ramp)
