"""A circuit fitted to a log, with a prior so weak that the log decides wherever it can."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks, root_mean_square
from faults.diagnosis.circuits.circuit_runs import COORDINATES, parameter_rows, predicted
from plant.arrays import Array

STEP = 0.005
"""Step of the finite differences in the logarithms [dimensionless]. The parts of friction pull against each other, so
that 95 % of their slopes cancel: a step of 0.02 errs by 4 %, which turned the sign of what was left. Where a piston
sticks and slips the run jumps, and a step of 0.002 makes slopes of that."""

ROUNDS = 12
"""Gauss-Newton steps at most."""

STARTS = 3
"""Conditions from which a fit begins at most: the nearest, and those that are nearly as near."""

FARTHEST = 0.7
"""Longest step in a logarithm [dimensionless]."""

GAINED = 0.5
"""Gain in log-likelihood below which the search ends [dimensionless]."""

PROMISING = 2e-3
"""Gain that a step must promise to be tried [dimensionless]: less moves nothing by a fifteenth of its deviation."""

SHORTEST = 0.07
"""Share of a step below which a trial that gains nothing is the last [fraction]: a whole step, 0.3,
0.09 and 0.027 of it are tried."""

LEAST_SCALE = 1e-3
"""Share of an output's root mean square that a residual counts as in any case [dimensionless]: no model is exact."""

LASTING = 30.0
"""Blocks over which a model's error lasts [dimensionless]: 0.3 s, a few reversals."""

SEALS = 1.0
"""Standard deviation of the logarithm of presliding displacement [dimensionless]: 7 to 50 um about 20 um."""


def _prior(each: Sequence[float], rubbing_alike: float) -> Array:
    """Return a covariance in the coordinates; the quadratic part of friction and the whole rise together too."""
    covariance = np.diag(np.square(each))
    rubbing = [COORDINATES.index(name) for name in ("friction_quadratic", "friction_rated")]
    covariance[np.ix_(rubbing, rubbing)] += rubbing_alike**2
    return covariance


WITHIN = _prior((0.12, 0.12, 0.12, 0.10, 0.08, 0.2, SEALS), 0.08)
"""How actuators in one condition differ: covariance of the logarithms, shape (7, 7) [dimensionless]."""

WEAK = _prior((0.5, 0.5, 0.3, 0.3, 0.2, 0.3, SEALS), 0.5)
"""What is believed of an actuator in no known condition, about the nearest one: covariance, shape (7, 7)."""


@dataclass(frozen=True, eq=False)
class PointFit:
    """A circuit fitted to a log.

    Parameters
    ----------
    coordinates : ndarray, shape (7,)
        Where, in `COORDINATES`.
    cost : float
        Minus its log-posterior [dimensionless], up to a constant of the log.
    information : ndarray, shape (7, 7)
        What the log says about the coordinates: the inverse of their covariance without a prior.
    scales : ndarray, shape (outputs,)
        Root mean square of the residuals [m/s, Pa], the least that counts.
    fitted : ndarray, shape (n, outputs)
        What the circuit does [m/s, Pa].
    slopes : ndarray, shape (7, n, outputs)
        Its derivatives with respect to the coordinates.
    """

    coordinates: Array
    cost: float
    information: Array
    scales: Array
    fitted: Array
    slopes: Array


@lru_cache(maxsize=2)
def nominal_runs(blocks: Blocks, actuator: Actuator) -> Array:
    """Return the runs of the nine nominal circuits under a log's motor speed, cached for the log.

    Parameters
    ----------
    blocks : Blocks
        The log.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    ndarray, shape (9, n, outputs)
        Velocity [m/s] and pressure [Pa]; it cannot be written to, since whoever asks again gets the same.
    """
    runs = predicted(blocks, parameter_rows(actuator.conditions, actuator.circuit, actuator.rated))
    runs.flags.writeable = False
    return runs


def scales_of(blocks: Blocks, fitted: Array) -> Array:
    """Return the root mean square of what a model leaves of a log.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fitted : ndarray, shape (n, outputs)
        The model.

    Returns
    -------
    ndarray, shape (outputs,)
        Residuals [m/s, Pa], not below the sensors' noise and `LEAST_SCALE`.
    """
    left = blocks.outputs[blocks.first :] - fitted[blocks.first :]
    return np.maximum(root_mean_square(left), least_scales(blocks))


def least_scales(blocks: Blocks) -> Array:
    """Return the least residuals of any model of a log.

    Returns
    -------
    ndarray, shape (outputs,)
        The sensors' noise, and not below `LEAST_SCALE` of the signal [m/s, Pa].
    """
    return np.maximum(blocks.noise, LEAST_SCALE * blocks.sizes)


def least_misfit(blocks: Blocks) -> float:
    """Return the least value of `misfit`: of a model that leaves only the sensors' noise.

    Parameters
    ----------
    blocks : Blocks
        The log.

    Returns
    -------
    float
        Up to a constant of the log [dimensionless].
    """
    return float(blocks.counts @ np.log(least_scales(blocks)))


def misfit(blocks: Blocks, fitted: Array, scales: Array | None = None) -> float:
    """Return minus the log-likelihood of a model with noise of its residuals' own size.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fitted : ndarray, shape (n, outputs)
        The model.
    scales : ndarray, shape (outputs,), optional
        What `scales_of` returns of it, if that is known [m/s, Pa].

    Returns
    -------
    float
        Up to a constant of the log [dimensionless]; infinite where the model ran away.
    """
    if not np.all(np.isfinite(fitted)):
        return float("inf")
    return float(blocks.counts @ np.log(scales_of(blocks, fitted) if scales is None else scales))


def fit_freely(
    blocks: Blocks,
    actuator: Actuator,
    condition: str,
    start: Array | PointFit | None = None,
    gained: float = GAINED,
    wanted: float = float("inf"),
    promising: float = PROMISING,
) -> PointFit:
    """Fit the circuit to a log with next to no prior.

    Parameters
    ----------
    blocks : Blocks
        The log.
    actuator : Actuator
        The healthy actuator.
    condition : str
        The nearest condition, about which the weak prior lies.
    start : ndarray of shape (7,), or PointFit, optional
        Coordinates where the search begins [dimensionless], or a fit about another condition from which it goes on;
        those of the condition if not given.
    gained : float
        Gain in log-likelihood below which the search ends [dimensionless].
    wanted : float
        Cost above which the circuit is of no use [dimensionless]: the search ends where all steps that are left would
        not bring it down to that, gaining each what the last one did or the next one promises.
    promising : float
        Gain in log-likelihood that a step must promise to be tried [dimensionless].

    Returns
    -------
    PointFit
        The best circuit.
    """
    centre = actuator.conditions[list(CONDITIONS).index(condition)]
    pull = _pull()
    if isinstance(start, PointFit):
        best = about(blocks, actuator, condition, start)
    else:
        best = _at(blocks, actuator, centre, centre if start is None else start, pull)
    step, promised, reach, last = centre, 0.0, 0.0, float("inf")
    least = least_misfit(blocks)
    for left in range(ROUNDS, 0, -1):  # a step that gains nothing is taken a third as long
        if best.cost - least < promising:  # the sensors' noise is all that is left
            break
        if reach == 0.0:
            step, reach = _step(blocks, best, centre, pull), 1.0
            promised = _promised(blocks, best, centre, pull, step)
            # a circuit of no numbers is run for ever
            if promised < promising or not np.all(np.isfinite(step)):
                break
            if best.cost - left * max(promised, last) > wanted:
                break
        there = _at(blocks, actuator, centre, best.coordinates + reach * step, pull)
        gain = best.cost - there.cost
        if gain > 0.0:
            best, reach, last = there, 0.0, gain
            if gain < gained:
                break
        elif reach < SHORTEST or _most_gained(promised, reach, gain) < promising:
            break
        else:
            reach *= 0.3
    return best


def _most_gained(promised: float, reach: float, gain: float) -> float:
    """Return the gain of a step at its best length, on the parabola through a trial.

    It begins with a slope of twice what the whole step promises, and has gained so much at a share ``reach`` of it.
    """
    curvature = (2.0 * promised * reach - gain) / reach**2
    return promised**2 / curvature


def about(blocks: Blocks, actuator: Actuator, condition: str, fit: PointFit) -> PointFit:
    """Return a fit as it counts about another condition.

    Parameters
    ----------
    blocks : Blocks
        The log.
    actuator : Actuator
        The healthy actuator.
    condition : str
        The condition about which the weak prior lies.
    fit : PointFit
        The fit.

    Returns
    -------
    PointFit
        The same circuit, with its cost there.
    """
    off = fit.coordinates - actuator.conditions[list(CONDITIONS).index(condition)]
    return replace(fit, cost=misfit(blocks, fit.fitted) + 0.5 * float(off @ _pull() @ off))


@cache
def _pull() -> Array:
    return np.asarray(LASTING * np.linalg.inv(WEAK), dtype=np.float64)


def _at(blocks: Blocks, actuator: Actuator, centre: Array, point: Array, pull: Array) -> PointFit:
    runs = _around(blocks, actuator, point.tobytes())
    scales = scales_of(blocks, runs[0])
    slopes = (runs[1:] - runs[0]) / STEP
    weighted = np.where(blocks.seen, slopes[:, blocks.first :] / scales, 0.0).reshape(len(point), -1)
    information = weighted @ weighted.T
    off = point - centre
    cost = misfit(blocks, runs[0], scales) + 0.5 * float(off @ pull @ off)
    return PointFit(point, cost, information, scales, runs[0], slopes)


@lru_cache(maxsize=ROUNDS + 1)
def _around(blocks: Blocks, actuator: Actuator, place: bytes) -> Array:
    """Return the runs of a circuit and of its neighbours: a rough and a thorough search from one start begin alike."""
    point = np.frombuffer(place)
    around = np.vstack([point, point + STEP * np.eye(len(point))])
    runs = predicted(blocks, parameter_rows(around, actuator.circuit, actuator.rated))
    runs.flags.writeable = False
    return runs


def _step(blocks: Blocks, fit: PointFit, centre: Array, pull: Array) -> Array:
    """Return a Gauss-Newton step, no longer than `FARTHEST`."""
    step = np.linalg.solve(fit.information + pull, _uphill(blocks, fit, centre, pull)).astype(np.float64)
    return step * min(1.0, FARTHEST / float(np.max(np.abs(step))))


def _promised(blocks: Blocks, fit: PointFit, centre: Array, pull: Array, step: Array) -> float:
    """Return the gain in log-posterior that a step promises."""
    return float(step @ (_uphill(blocks, fit, centre, pull) - 0.5 * (fit.information + pull) @ step))


def _uphill(blocks: Blocks, fit: PointFit, centre: Array, pull: Array) -> Array:
    """Return the slope of the log-posterior, shape (7,)."""
    left = np.nan_to_num((blocks.outputs - fit.fitted)[blocks.first :]) / fit.scales**2
    gained: Array = np.einsum("ink,nk->i", fit.slopes[:, blocks.first :], left)
    return gained - pull @ (fit.coordinates - centre)
