"""Sensors: a bench's log of a true run, with noise, quantisation and drop-outs."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from math import isfinite
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant.errors import RigError
from plant.log.record import Record
from plant.units import si

BENCH_NOTES = "reference bench logs"


def require_not_negative(sensors: Any) -> None:
    """Refuse a set of sensors with a number that is negative or not finite.

    Parameters
    ----------
    sensors : dataclass instance
        Its noises and quanta, each in its own unit; booleans are not checked.

    Raises
    ------
    RigError
        If a number is negative or not finite; the message names it.

    Examples
    --------
    >>> require_not_negative(Sensors())
    """
    for field in fields(sensors):
        value = getattr(sensors, field.name)
        if not isinstance(value, bool) and (not isfinite(value) or value < 0.0):
            raise RigError(f"{field.name} must be finite and not negative, got {value!r}")


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """Sensors of a bench: noise and quantisation; the defaults are those of the reference bench.

    Noise is white and Gaussian and given by its standard deviation; it is added before quantisation.

    Raises
    ------
    RigError
        If a noise or quantum is negative or not finite, or the velocity window is not positive.

    Examples
    --------
    >>> Sensors(velocity_noise=0.01).velocity_noise
    0.01
    """

    speed_noise: float = si(0.05, "rad/s", "motor speed noise", BENCH_NOTES)
    velocity_noise: float = si(1e-3, "m/s", "noise of a velocity sensor", BENCH_NOTES)
    pressure_noise: float = si(5e3, "Pa", "differential pressure noise", BENCH_NOTES)
    pressure_quantum: float = si(500.0, "Pa", "differential pressure quantum", BENCH_NOTES)
    position_noise: float = si(0.0, "m", "position noise", BENCH_NOTES)
    position_quantum: float = si(1e-6, "m", "position quantum", BENCH_NOTES)
    velocity_window: float = si(
        5e-3, "s", "span over which position is differentiated", "judged: 0.08 mm/s of noise from a 1 um encoder"
    )
    velocity_from_position: bool = si(
        False, "1", "velocity is differentiated position, not a sensor of its own", "section 2"
    )
    pressure: bool = si(True, "1", "differential pressure is logged", "section 2")

    def __post_init__(self) -> None:
        require_not_negative(self)
        if self.velocity_window == 0.0:
            raise RigError("velocity_window must be positive, got 0.0 s")


BENCH = Sensors()
"""The sensors of the reference bench logs."""

IDEAL = Sensors(
    speed_noise=0.0,
    velocity_noise=0.0,
    pressure_noise=0.0,
    pressure_quantum=0.0,
    position_noise=0.0,
    position_quantum=0.0,
)
"""Sensors that change nothing. Their variances are zero, so a filter cannot use them."""

PAPER = replace(IDEAL, velocity_noise=1e-2, position_noise=1e-6, pressure=False)
"""The setting of the paper's filter: R of equation 7.7, position and velocity measured, motor speed known."""

RIG = Sensors(velocity_from_position=True)
"""The paper's rig, section 2: an optical encoder, its position differentiated, and pressure transducers; noise as on
the reference bench, since the paper gives none."""

SENSORS: Mapping[str, Sensors] = {"bench": BENCH, "rig": RIG, "paper": PAPER, "ideal": IDEAL}
"""The sensor sets by name."""


def measure(truth: Record, sensors: Sensors, rng: np.random.Generator, keep_truth: bool = False) -> Record:
    """Return the sensors' log of a true run.

    Each channel has its own stream, spawned from the generator, so that changing or switching off one sensor does not
    change the noise of the others.

    Parameters
    ----------
    truth : Record
        True ``motor_speed_rad_s``, ``position_m``, ``velocity_m_s``, and ``differential_pressure_pa`` if it is logged.
    rng : numpy.random.Generator
        Parent of the channels' streams.
    keep_truth : bool
        Whether the record also holds the true channels, as ``true_position_m`` and so on.

    Returns
    -------
    Record
        The measured channels, with the truth's clock and metadata and an entry ``sensors``.

    Raises
    ------
    LogError
        If the truth lacks a channel.
    RigError
        If velocity is differentiated over a window shorter than two sample times.
    """
    speed_rng, position_rng, velocity_rng, pressure_rng = rng.spawn(4)
    speed, position = truth["motor_speed_rad_s"], truth["position_m"]
    measured = {
        "motor_speed_rad_s": _noisy(speed, sensors.speed_noise, speed_rng),
        "position_m": _quantised(_noisy(position, sensors.position_noise, position_rng), sensors.position_quantum),
    }
    if sensors.velocity_from_position:
        measured["velocity_m_s"] = differentiated(measured["position_m"], truth.sample_time, sensors.velocity_window)
    else:
        measured["velocity_m_s"] = _noisy(truth["velocity_m_s"], sensors.velocity_noise, velocity_rng)
    if sensors.pressure:
        noisy = _noisy(truth["differential_pressure_pa"], sensors.pressure_noise, pressure_rng)
        measured["differential_pressure_pa"] = _quantised(noisy, sensors.pressure_quantum)
    if keep_truth:
        measured |= {f"true_{name}": truth[name] for name in truth}
    return Record(truth.sample_time, measured, truth.metadata, truth.start_time).annotate(sensors=asdict(sensors))


def differentiated(position: NDArray[np.float64], sample_time: float, window: float) -> NDArray[np.float64]:
    """Return velocity as the difference of position across a window centred on each sample.

    A centred window has no delay; within half a window of the ends the window is cut and the noise grows.

    Parameters
    ----------
    position : ndarray, shape (n,)
        Position [m].
    sample_time : float
        Time between samples [s].
    window : float
        Span of the difference [s], rounded to an even number of sample times.

    Returns
    -------
    ndarray, shape (n,)
        Velocity [m/s].

    Raises
    ------
    RigError
        If the window is shorter than two sample times, or there are fewer than two samples.

    Examples
    --------
    >>> differentiated(np.array([0.0, 1e-3, 4e-3]), 0.1, 0.2).round(6).tolist()
    [0.01, 0.02, 0.03]
    """
    if window < 2.0 * sample_time * (1.0 - 1e-9):
        raise RigError(f"velocity_window must be at least two sample times ({2.0 * sample_time:g} s), got {window:g} s")
    count = len(position)
    if count < 2:
        raise RigError(f"velocity from position needs at least 2 samples, got {count}")
    half = round(0.5 * window / sample_time)
    here = np.arange(count)
    before, after = np.maximum(here - half, 0), np.minimum(here + half, count - 1)
    return (position[after] - position[before]) / ((after - before) * sample_time)


def noise_variances(sensors: Sensors) -> Mapping[str, float]:
    """Return the variance that a filter should expect on each logged channel.

    Quantisation counts as uniform noise, its quantum squared over 12. Differentiated velocity carries the position's
    errors at both ends of the window; they are correlated from sample to sample, which a variance cannot express.

    Returns
    -------
    Mapping[str, float]
        Variance by channel name, in the square of the channel's unit.

    Examples
    --------
    >>> noise_variances(PAPER)["velocity_m_s"]
    0.0001
    """
    position = _variance(sensors.position_noise, sensors.position_quantum)
    variances = {
        "motor_speed_rad_s": _variance(sensors.speed_noise, 0.0),
        "position_m": position,
        "velocity_m_s": _variance(sensors.velocity_noise, 0.0),
    }
    if sensors.velocity_from_position:
        variances["velocity_m_s"] = 2.0 * position / sensors.velocity_window**2
    if sensors.pressure:
        variances["differential_pressure_pa"] = _variance(sensors.pressure_noise, sensors.pressure_quantum)
    return MappingProxyType(variances)


def drop_samples(
    record: Record, fraction: float, rng: np.random.Generator, channels: Sequence[str] | None = None
) -> Record:
    """Return a copy in which a fraction of the samples is missing (NaN), in all channels at the same times.

    Parameters
    ----------
    record : Record
        A measured run.
    fraction : float
        Fraction of missing samples, 0 to 1 [dimensionless]; rounded to whole samples.
    channels : sequence of str, optional
        The channels that drop out; all but the ``true_`` ones when not given.

    Raises
    ------
    RigError
        If the fraction is not between 0 and 1.
    LogError
        If a channel is not in the record.
    """
    if not 0.0 <= fraction <= 1.0:
        raise RigError(f"the fraction of missing samples must be between 0 and 1, got {fraction!r}")
    missing = np.zeros(len(record), dtype=np.bool_)
    missing[rng.choice(len(record), round(fraction * len(record)), replace=False)] = True
    names = [name for name in record if not name.startswith("true_")] if channels is None else channels
    return record.replace(**{name: np.where(missing, np.nan, record[name]) for name in names})


def _noisy(values: NDArray[np.float64], deviation: float, rng: np.random.Generator) -> NDArray[np.float64]:
    if deviation == 0.0:
        return values
    return values + deviation * rng.standard_normal(len(values))


def _quantised(values: NDArray[np.float64], quantum: float) -> NDArray[np.float64]:
    if quantum == 0.0:
        return values
    return quantum * np.round(values / quantum)


def _variance(deviation: float, quantum: float) -> float:
    return deviation**2 + quantum**2 / 12.0
