"""Leakage, flow bias and friction from the steady parts of logs: equations 5.7, 5.8 and 5.11, with intervals.

Where motor speed, velocity and differential pressure are constant, the flow balance is a line in pressure and the force
balance a parabola in velocity. Each steady stretch of a log is one point. A fit through many points gives the
coefficients and their intervals.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.errors import LogError
from plant.log.record import Record

Variance: TypeAlias = Callable[[Array], Array]
"""Variance of the points' residuals, given the coefficients."""

ROUNDS = 5
"""How often a fit is weighted again by the variances that its result gives [count]."""

CONFIDENCE = 0.95
"""Probability with which an interval should hold the true value."""

_STEADY = 3.0
"""Standard errors by which the halves of a steady stretch may differ."""

_FLAT = 1e-4
"""Least difference that is allowed, over a channel's largest magnitude, for logs without noise."""

_UNKNOWN_COMPLIANCE = 0.5
"""Share of the compression flow that counts as error."""

_MOVING = 10.0
"""Standard errors of velocity above which the piston moves."""


@dataclass(frozen=True)
class SteadyPoints:
    """Steady stretches of logs, one entry each, with the direction of motion as positive; errors are standard errors.

    Parameters
    ----------
    speed, velocity, pressure : ndarray, shape (n,)
        Motor speed [rad/s], velocity [m/s], differential pressure [Pa], positive in the sense of motion.
    drift : ndarray, shape (n,)
        Remaining rate of pressure [Pa/s].
    speed_error, velocity_error, pressure_error, drift_error : ndarray, shape (n,)
        Their standard errors, in the same units.
    """

    speed: Array
    velocity: Array
    pressure: Array
    drift: Array
    speed_error: Array
    velocity_error: Array
    pressure_error: Array
    drift_error: Array

    def __len__(self) -> int:
        return len(self.speed)


@dataclass(frozen=True)
class Coefficient:
    """A fitted coefficient.

    Parameters
    ----------
    value, std : float
        Estimate and standard deviation [SI].
    low, high : float
        Ends of its 95 % interval [SI].
    """

    value: float
    std: float
    low: float
    high: float

    def covers(self, truth: float) -> bool:
        """Return whether the interval contains a value.

        Parameters
        ----------
        truth : float
            The value [SI].
        """
        return self.low <= truth <= self.high


@dataclass(frozen=True)
class SteadyFit:
    """Coefficients from steady points.

    Parameters
    ----------
    coefficients : Mapping[str, Coefficient]
        By the names of `EhaParameters`.
    points : int
        Count of steady points.
    misfit : float
        Mean square of the residuals over what the sensors' noise explains [dimensionless]: 1 when the law holds.
    """

    coefficients: Mapping[str, Coefficient]
    points: int
    misfit: float


def steady_points(records: Iterable[Record], window: float = 1.0) -> SteadyPoints:
    """Return the steady stretches of logs in which the piston moves.

    Logs are cut into windows. One is steady if the means of its halves agree in motor speed, velocity and
    pressure; a window without a sample in some channel is left out. Where position is logged, velocity is its slope.

    Parameters
    ----------
    records : iterable of Record
        Logs with motor speed, velocity or position, and differential pressure.
    window : float
        Length of a window [s].

    Raises
    ------
    LogError
        If a window has fewer than eight samples, or a channel is missing.
    """
    found = [point for record in records for point in _points_of(record, window)]
    table = np.array(found, dtype=np.float64).reshape(-1, 8)
    return SteadyPoints(*np.ascontiguousarray(table.T))


def fit_leakage(points: SteadyPoints, p: EhaParameters) -> SteadyFit:
    """Fit leakage coefficient and flow bias to steady points, equations 5.7 and 5.8.

    The remaining rate of pressure takes a little flow. Make-up flow holds the low chamber, so only the high one is
    compressed, with twice the lumped volume (errata E2). That flow is subtracted, and half of it counts as error, since
    neither bulk modulus nor the state of the make-up valve is known here.

    Parameters
    ----------
    points : SteadyPoints
        Steady points at several pressures.
    p : EhaParameters
        The actuator; its pump displacement, piston area, and chamber volume over bulk modulus are used.

    Returns
    -------
    SteadyFit
        ``leakage_coefficient`` [m^3/(s Pa)] and ``flow_bias`` [m^3/s].

    Raises
    ------
    LogError
        If there are fewer than three points, or their pressures are all the same.
    """
    D, A = p.pump_displacement, p.piston_area
    compliance = 2.0 * p.chamber_volume / p.bulk_modulus
    lost = D * points.speed - A * points.velocity - compliance * points.drift
    design = np.column_stack([points.pressure, np.ones(len(points))])
    unsettled = _UNKNOWN_COMPLIANCE * compliance * np.abs(points.drift) + compliance * points.drift_error
    known = (D * points.speed_error) ** 2 + (A * points.velocity_error) ** 2 + unsettled**2

    def variance(found: Array) -> Array:
        return known + (found[0] * points.pressure_error) ** 2

    return _weighted_fit(("leakage_coefficient", "flow_bias"), design, lost, variance)


def fit_friction(points: SteadyPoints, p: EhaParameters) -> SteadyFit:
    """Fit the friction parabola to steady points, equation 5.11.

    Parameters
    ----------
    points : SteadyPoints
        Steady points at several velocities.
    p : EhaParameters
        The actuator; only its piston area is used.

    Returns
    -------
    SteadyFit
        ``friction_quadratic`` [N s^2/m^2], ``friction_linear`` [N s/m], ``friction_coulomb`` [N].

    Raises
    ------
    LogError
        If there are fewer than four points, or fewer than three different velocities.
    """
    A, v = p.piston_area, points.velocity
    design = np.column_stack([v**2, v, np.ones(len(points))])

    def variance(found: Array) -> Array:
        slope = 2.0 * found[0] * v + found[1]
        return (A * points.pressure_error) ** 2 + (slope * points.velocity_error) ** 2

    names = ("friction_quadratic", "friction_linear", "friction_coulomb")
    return _weighted_fit(names, design, A * points.pressure, variance)


def _points_of(record: Record, window: float) -> list[tuple[float, ...]]:
    count = round(window / record.sample_time)
    if count < 8:
        raise LogError(f"a steady window needs at least 8 samples, got {count} in {window:g} s")
    speed, pressure = record["motor_speed_rad_s"], record["differential_pressure_pa"]
    from_position = "position_m" in record
    motion = record["position_m" if from_position else "velocity_m_s"]
    flat = {name: _FLAT * float(np.nanmax(np.abs(values))) for name, values in (("w", speed), ("p", pressure))}
    found: list[tuple[float, ...]] = []
    for start in range(0, len(record) - count + 1, count):
        part = slice(start, start + count)
        w, w_error, w_steady = _mean(speed[part], flat["w"])
        dp, dp_error, dp_steady = _mean(pressure[part], flat["p"])
        v, v_error = _slope(motion[part], record.sample_time) if from_position else _mean(motion[part], 0.0)[:2]
        if w_steady and dp_steady and abs(v) > _MOVING * v_error:
            sense = 1.0 if v > 0.0 else -1.0
            drift, drift_error = _slope(pressure[part], record.sample_time)
            moving = sense * w, sense * v, sense * dp, sense * drift
            found.append((*moving, w_error, v_error, dp_error, drift_error))
    return found


def _mean(values: Array, flat: float) -> tuple[float, float, bool]:
    """Return mean and its standard error, and whether the two halves agree."""
    half = len(values) // 2
    first, second = values[:half], values[half:]
    error = float(np.std(np.diff(values))) / np.sqrt(2.0 * len(values))
    apart = abs(float(np.mean(second)) - float(np.mean(first)))
    return float(np.mean(values)), error, bool(apart <= max(2.0 * _STEADY * error, flat))


def _slope(values: Array, sample_time: float) -> tuple[float, float]:
    """Return the slope of a channel over time, and its standard error from the residuals."""
    time = sample_time * (np.arange(len(values)) - 0.5 * (len(values) - 1))
    spread = float(time @ time)
    slope = float(time @ values) / spread
    rest = values - np.mean(values) - slope * time
    return slope, float(np.sqrt(rest @ rest / (len(values) - 2) / spread))


def _weighted_fit(names: Sequence[str], design: Array, target: Array, variance: Variance) -> SteadyFit:
    """Fit by least squares, weighted by variances that depend on the answer."""
    from scipy.stats import t as student

    count, width = design.shape
    if count <= width:
        raise LogError(f"a fit of {', '.join(names)} needs more than {width} steady points, got {count}")
    scale = np.max(np.abs(design), axis=0)
    found = np.linalg.lstsq(design / scale, target, rcond=None)[0] / scale
    weights, scaled = np.ones(count), design / scale
    for _ in range(ROUNDS):
        known = variance(found)
        weights = 1.0 / np.sqrt(np.maximum(known, np.max(known) * np.finfo(float).eps))
        scaled = weights[:, None] * design / scale
        found, _, rank, _ = np.linalg.lstsq(scaled, weights * target, rcond=1e-9)
        if rank < width:
            raise LogError(f"a fit of {', '.join(names)} needs steady points that differ more, got {count} alike")
        found = found / scale
    rest = weights * (target - design @ found)
    misfit = float(rest @ rest) / (count - width)
    covariance = np.linalg.inv(scaled.T @ scaled) / np.outer(scale, scale) * max(1.0, misfit)
    deviations = np.sqrt(np.diag(covariance))
    reach = float(student.ppf(0.5 + 0.5 * CONFIDENCE, count - width))
    coefficients = {
        name: Coefficient(float(value), float(std), float(value - reach * std), float(value + reach * std))
        for name, value, std in zip(names, found, deviations, strict=True)
    }
    return SteadyFit(MappingProxyType(coefficients), count, misfit)
