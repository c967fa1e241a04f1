"""Measurement noise read off the log itself, not taken as published (errata E11)."""

from collections.abc import Mapping, Sequence

import numpy as np

from plant.arrays import Array
from plant.log.record import Record

SMALLEST_VARIANCE: Mapping[str, float] = {
    "position_m": 1e-12,
    "velocity_m_s": 1e-10,
    "differential_pressure_pa": 1e2,
}
"""Least variance that a filter is given [SI squared]: the paper's R for position (equation 7.7), and for the others
well below any bench sensor, so that a noiseless simulation stays solvable."""

NORMAL_MAD = 1.482602218505602
"""Standard deviation of a normal variable over its median absolute deviation."""


def measurement_variances(record: Record, channels: Sequence[str]) -> Mapping[str, float]:
    """Estimate each channel's measurement variance from its second differences.

    A second difference removes everything smooth and holds six times the variance of white noise; its median absolute
    deviation ignores the moments at which the piston really jumps. A channel that mostly repeats its last value is
    taken for quantised: one twelfth of the squared quantum is the least that it can have.

    Parameters
    ----------
    record : Record
        The log.
    channels : sequence of str
        Channels wanted.

    Returns
    -------
    Mapping[str, float]
        Variance [SI squared] by channel.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(1).normal(0.0, 1e-3, 20_000)
    >>> log = Record(1e-3, {"velocity_m_s": 0.04 * np.sin(np.arange(20_000) * 1e-2) + noise})
    >>> round(measurement_variances(log, ["velocity_m_s"])["velocity_m_s"] * 1e6, 1)
    1.0
    """
    return {channel: _variance(channel, record[channel]) for channel in channels}


def _variance(channel: str, values: Array) -> float:
    values = values[np.isfinite(values)]  # a slow sensor has no three samples in a row
    bends = np.diff(values, n=2)
    smallest = max(SMALLEST_VARIANCE.get(channel, 0.0), _quantum(values) ** 2 / 12.0)
    if not len(bends):
        return smallest
    deviation = NORMAL_MAD * float(np.median(np.abs(bends - np.median(bends)))) / 6.0**0.5
    return float(max(deviation**2, smallest))


def _quantum(values: Array) -> float:
    """Return the smallest step of a channel that mostly does not move; 0 for any other."""
    steps = np.abs(np.diff(values))
    moved = steps[steps > 0.0]
    held = np.count_nonzero(steps == 0.0)
    return float(np.min(moved)) if held > len(moved) > 0 else 0.0


QUANTISED = 2.0
"""White noise up to this many quanta is taken for the quantisation itself [dimensionless]."""


def position_variance(position: Array) -> float:
    """Return a position sensor's own variance, without the floor that a filter is given.

    An encoder's steps are all multiples of its quantum, and where that is the larger part of the noise, one twelfth of
    its square is the variance.

    Parameters
    ----------
    position : ndarray, shape (n,)
        Position [m]; NaN where missing.

    Returns
    -------
    float
        Variance [m^2].

    Examples
    --------
    >>> import numpy as np
    >>> walked = np.round(np.linspace(0.0, 1e-3, 5000) / 1e-6) * 1e-6
    >>> round(position_variance(walked) * 12e12, 3)
    1.0
    """
    position = position[np.isfinite(position)]
    steps = np.abs(np.diff(position))
    moved = steps[steps > 0.0]
    bends = np.diff(position, n=2)
    if not len(moved) or not len(bends):
        return SMALLEST_VARIANCE["position_m"]
    deviation = NORMAL_MAD * float(np.median(np.abs(bends - np.median(bends)))) / 6.0**0.5
    quantum = float(np.min(moved))
    return float(quantum**2 / 12.0 if deviation < QUANTISED * quantum else deviation**2)
