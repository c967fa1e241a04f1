"""`friction_by_forces(record, p, rated)`: friction of a sliding piston, from the force balance alone.

A fitted circuit determines friction from the whole motion, with an assumed model of the seals at reversals. While a
piston slides in one direction, the pressure force beyond inertia is its friction, whatever pump and seals do. The three
parts of the friction law are regressed on the sliding velocities. A constant force, of a load or a sensor's zero, does
not change sign with direction and is fitted beside them. See decision 319.
"""

import math
from itertools import pairwise

import numpy as np

from estimation.arrays import IntArray
from estimation.log_checks.channel_names import POSITION, PRESSURE
from estimation.log_checks.measurement_noise import is_coarse, measurement_variances, position_variance
from faults.diagnosis.circuits.friction_shape import friction_bends
from faults.diagnosis.circuits.model_doubt import SELDOM_KNOWN
from faults.diagnosis.severity import KnownFriction
from plant.arrays import Array
from plant.eha.circuit_parameters import circuit_of
from plant.eha.model import EhaParameters, load_on_rod
from plant.log.record import Record

WINDOW = 0.02
"""Time over which forces are averaged [s]: short enough for nearly constant velocity, long enough to average the
noise."""

LEAST_SAMPLES = 10
"""Least number of samples in a window: slower logs do not show how pressure and velocity change within it. At 100 Hz,
friction under binary drives was six deviations off."""

REACH = 2e-3
"""Half of the time over which velocity is read off positions, as the slope of a cubic [s]. A straight line of half its
length lost 2 % of what rings at 55 Hz, which is friction that goes with the square of velocity."""

SLIDING_TRAVEL = 25.0
"""Travel since a reversal from which a piston slides, over the rig's presliding displacement [dimensionless], judged:
0.5 mm on the paper's actuator, ten times the yield of seals of 0.05 mm."""

SLOWEST = 1e-3
"""Velocity below which a piston may stick [m/s]."""

FEWEST = 30
"""Least number of windows for the three parts of friction."""

LASTING_WINDOWS = 5
"""Windows over which residuals are averaged to detect a lasting error: a tenth of a second."""

NOISE_ONLY = 2.0
"""Root mean square residual over the sensors' noise above which the friction law does not fit this piston
[dimensionless]. It is 1.0 to 1.4 in plain training logs."""

CLIPPED, ROUNDS = 3.0, 6
"""Deviations from which a residual counts linearly [dimensionless], and iterations of the weights."""

LARGEST_CONDITION_NUMBER = 1e12
"""Largest condition number of the normal equations [dimensionless]: above it, a log does not separate the parts."""


def friction_by_forces(record: Record, p: EhaParameters, rated: float) -> KnownFriction | None:
    """Return the friction of a log whose piston slides.

    Parameters
    ----------
    record : Record
        Position and differential pressure, at any rate [m, Pa].
    p : EhaParameters
        The actuator; its area, mass and load on the rod are used.
    rated : float
        Its rated velocity [m/s].

    Returns
    -------
    KnownFriction or None
        None if one of the channels is missing or too slow, if the areas differ (differential pressure is then no
        force), if the pressure converter is too coarse, if the piston hardly slides, or if residuals exceed the
        sensors' noise.
    """
    if not {POSITION, PRESSURE} <= set(record.channels) or p.single_rod or rated <= 0.0:
        return None
    position, pressure = (np.asarray(record[name], dtype=np.float64) for name in (POSITION, PRESSURE))
    step = record.sample_time
    reach, length = max(2, round(REACH / step)), round(WINDOW / step)
    if length < LEAST_SAMPLES or len(position) < 4 * reach + length:
        return None
    noise_x, noise_p = position_variance(position), measurement_variances(record, (PRESSURE,))[PRESSURE]
    if is_coarse(pressure, noise_p):
        return None
    lost = np.convolve(np.isnan(position), np.ones(2 * reach + 1), "same") > 0.0
    position, known = np.nan_to_num(position), np.isfinite(pressure) & ~lost
    cubic = np.vander(np.arange(-reach, reach + 1.0), 4, increasing=True)
    slope = np.asarray(np.linalg.pinv(cubic)[1], dtype=np.float64) / step
    velocity, noise_v = np.convolve(position, slope[::-1], "same"), noise_x * float(slope @ slope)
    way = np.where(known & (np.abs(velocity) >= SLOWEST), np.sign(velocity), 0.0)
    way[:reach], way[-reach:] = 0.0, 0.0
    yields = circuit_of(p).presliding_displacement
    first = _windows(position, way, SLIDING_TRAVEL * yields, length)
    if len(first) < FEWEST:
        return None
    last, time = first + length, length * step
    pushed = _window_means(np.nan_to_num(pressure), first, length) * p.piston_area
    pushed = pushed - load_on_rod(_window_means(position, first, length), p)
    inertia = p.moving_mass * (velocity[last] - velocity[first]) / time
    direction = way[first]
    speed = _window_means(np.abs(velocity), first, length) / rated
    square = (_window_means(velocity**2, first, length) - noise_v) / rated**2
    columns = np.stack([1.0 - speed, square - speed, speed, direction, direction * inertia], axis=1)
    least = p.piston_area**2 * noise_p / length + 2.0 * (p.moving_mass / time) ** 2 * noise_v
    return _regress_forces(columns, direction * (pushed - inertia), least, friction_bends(speed))


def _windows(position: Array, way: Array, slides: float, length: int) -> IntArray:
    """Return the first samples of windows in which the piston slides, and has slid, in one direction."""
    turns = np.concatenate([[0], np.flatnonzero(np.diff(way)) + 1, [len(way)]])
    found = [np.empty(0, dtype=np.int64)]
    for begin, end in pairwise(turns):
        travel = np.abs(position[begin:end] - position[begin])
        if way[begin] != 0.0 and end - begin > length and travel[-1] >= slides:
            found.append(np.arange(begin + int(np.argmax(travel >= slides)), end - length, length))
    return np.concatenate(found)


def _window_means(values: Array, first: IntArray, length: int) -> Array:
    """Return means over windows by trapezoids."""
    sums = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    return np.asarray((sums[first + length] - sums[first]) / length, dtype=np.float64)


def _regress_forces(columns: Array, forces: Array, least: float, bends: Array) -> KnownFriction | None:
    """Return the regression of forces with a least noise variance [N^2]; bends are shares of friction at rest."""
    count, unknowns = columns.shape
    prior = np.zeros((unknowns, unknowns))
    prior[-1, -1] = SELDOM_KNOWN["moving_mass"] ** -2
    power, left = least, np.zeros(count)
    weighed, inverse, found = columns.T, prior, np.zeros(unknowns)
    for _ in range(ROUNDS):
        weights = 1.0 / np.maximum(1.0, np.abs(left) / (CLIPPED * math.sqrt(power)))
        weighed = columns.T * weights
        normal = weighed @ columns + prior * power
        if not np.linalg.cond(normal[:-1, :-1]) < LARGEST_CONDITION_NUMBER:
            return None
        inverse = np.linalg.inv(normal)
        found = inverse @ (weighed @ forces)
        left = forces - columns @ found
        power = max(least, float(weights @ left**2) / max(1.0, float(np.sum(weights)) - unknowns))
    if power > NOISE_ONLY**2 * least:
        return None
    together = left[: count // LASTING_WINDOWS * LASTING_WINDOWS].reshape(-1, LASTING_WINDOWS).sum(axis=1)
    lasting = float(np.mean(together**2)) / LASTING_WINDOWS / power * count / (count - unknowns)
    covariance = np.asarray((inverse * power * max(1.0, lasting))[:3, :3], dtype=np.float64)
    bent = (inverse @ weighed @ bends)[:3] * found[0]
    return KnownFriction(found[:3], covariance, np.asarray(covariance + bent @ bent.T, dtype=np.float64))
