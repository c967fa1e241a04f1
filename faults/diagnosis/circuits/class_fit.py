"""A circuit fitted to a log, with a prior so weak that the log decides wherever it can."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks, root_mean_square
from faults.diagnosis.circuits.circuit_runs import COORDINATES, parameter_rows, predicted_outputs
from plant.arrays import Array

STEP = 0.005
"""Finite-difference step in the logarithms [dimensionless]. The parts of friction oppose each other, so that 95 % of
their slopes cancel: a step of 0.02 has an error of 4 %, which reversed the sign of the remainder. With stick-slip the
run has jumps, and a step of 0.002 takes these for slopes."""

ROUNDS = 12
"""Most Gauss-Newton steps."""

STARTS = 3
"""Most conditions from which a fit begins: the nearest, and those that are nearly as near."""

FARTHEST = 0.7
"""Longest step in a logarithm [dimensionless]."""

LEAST_GAIN = 0.5
"""Gain in log-likelihood below which the search ends [dimensionless]."""

ROUGH_GAIN = 10.0
"""The same for a rough search, from near by or followed by others [dimensionless]: a third of a real difference."""

LEAST_PROMISED_GAIN = 2e-3
"""Gain that a step must promise to be tried [dimensionless]: a smaller one moves nothing by a fifteenth of its
deviation."""

SHORTEST_TRIAL = 0.07
"""Share of a step below which a trial without gain is the last [fraction]: 1, 0.3, 0.09 and 0.027 of it are tried."""

LEAST_SCALE = 1e-3
"""Least residual that is counted, over an output's root mean square [dimensionless]: no model is exact."""

LASTING = 30.0
"""Blocks over which a model's error persists [dimensionless]: 0.3 s, a few reversals."""

SEAL_SPREAD = 1.0
"""Standard deviation of the logarithm of presliding displacement [dimensionless]: 7 to 50 um about 20 um."""


def _prior(each: Sequence[float], rubbing_alike: float) -> Array:
    """Return a prior covariance in the coordinates; the quadratic part of friction and the whole are correlated."""
    covariance = np.diag(np.square(each))
    rubbing = [COORDINATES.index(name) for name in ("friction_quadratic", "friction_rated")]
    covariance[np.ix_(rubbing, rubbing)] += rubbing_alike**2
    return covariance


CONDITION_SPREAD = _prior((0.12, 0.12, 0.12, 0.10, 0.08, 0.2, SEAL_SPREAD), 0.08)
"""Differences of actuators in one condition: covariance of the logarithms, shape (7, 7) [dimensionless]."""

WEAK_PRIOR = _prior((0.5, 0.5, 0.3, 0.3, 0.2, 0.3, SEAL_SPREAD), 0.5)
"""Prior of an actuator in no known condition, about the nearest one: covariance, shape (7, 7)."""


@dataclass(frozen=True, eq=False)
class PointFit:
    """A circuit fitted to a log.

    Parameters
    ----------
    coordinates : ndarray, shape (7,)
        Where it is, in `COORDINATES`.
    cost : float
        Minus its log-posterior [dimensionless], up to a constant of the log.
    information : ndarray, shape (7, 7)
        Information of the log on the coordinates: inverse covariance without a prior.
    scales : ndarray, shape (outputs,)
        Root mean square of the residuals [m/s, Pa], at least the smallest that is counted.
    fitted : ndarray, shape (n, outputs)
        Outputs of the circuit [m/s, Pa].
    slopes : ndarray, shape (7, n, outputs)
        Its derivatives with respect to the coordinates.
    run_coordinates : ndarray, shape (7,), optional
        Coordinates that were run, where others are told, at which motion is the same unless a relief valve opens.
    """

    coordinates: Array
    cost: float
    information: Array
    scales: Array
    fitted: Array
    slopes: Array
    run_coordinates: Array | None = None

    @cached_property
    def as_run(self) -> "PointFit":
        """The circuit where its search ended; one object, so that what is computed from it is remembered."""
        return (
            self
            if self.run_coordinates is None
            else replace(self, coordinates=self.run_coordinates, run_coordinates=None)
        )


@lru_cache(maxsize=2)
def nominal_runs(blocks: Blocks, actuator: Actuator) -> Array:
    """Return the runs of the nine nominal circuits under a log's motor speed; cached for the log.

    Returns
    -------
    ndarray, shape (9, n, outputs)
        Velocity [m/s] and pressure [Pa]; read-only, since the cached array is returned.
    """
    runs = predicted_outputs(blocks, parameter_rows(actuator.conditions, actuator.circuit, actuator.rated))
    runs.flags.writeable = False
    return runs


def scales_of(blocks: Blocks, fitted: Array) -> Array:
    """Return the root mean square of a model's residuals.

    Parameters
    ----------
    fitted : ndarray, shape (n, outputs)
        The model.

    Returns
    -------
    ndarray, shape (outputs,)
        Residuals [m/s, Pa], at least the sensors' noise and `LEAST_SCALE`.
    """
    left = blocks.outputs[blocks.first :] - fitted[blocks.first :]
    return np.maximum(root_mean_square(left), least_scales(blocks))


def least_scales(blocks: Blocks) -> Array:
    """Return the smallest residuals that a model of a log can have.

    Returns
    -------
    ndarray, shape (outputs,)
        The sensors' noise, and at least `LEAST_SCALE` of the signal [m/s, Pa].
    """
    return np.maximum(blocks.noise, LEAST_SCALE * blocks.rms)


def least_misfit(blocks: Blocks) -> float:
    """Return the least value of `misfit`: that of a model whose residuals are the sensors' noise alone.

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
        Result of `scales_of` for it, if known [m/s, Pa].

    Returns
    -------
    float
        Up to a constant of the log [dimensionless]; infinite if the model diverged.
    """
    if not np.all(np.isfinite(fitted)):
        return float("inf")
    return float(blocks.counts @ np.log(scales_of(blocks, fitted) if scales is None else scales))


def fit_freely(
    blocks: Blocks,
    actuator: Actuator,
    condition: str,
    start: Array | PointFit | None = None,
    gained: float = LEAST_GAIN,
    wanted: float = float("inf"),
    promising: float = LEAST_PROMISED_GAIN,
) -> PointFit:
    """Fit the circuit to a log with a very weak prior.

    Parameters
    ----------
    condition : str
        The nearest condition, about which the weak prior lies.
    start : ndarray of shape (7,), or PointFit, optional
        Where the search begins: coordinates [dimensionless], or a fit about another condition to continue; the
        condition's if not given.
    gained : float
        Gain in log-likelihood below which the search ends [dimensionless].
    wanted : float
        Cost above which the circuit is of no use [dimensionless]: the search ends if all remaining steps would not
        reach it, should each gain what the last one did or the next one promises.
    promising : float
        Gain in log-likelihood that a step must promise to be tried [dimensionless].

    Returns
    -------
    PointFit
        The best circuit.
    """
    centre = actuator.conditions[list(CONDITIONS).index(condition)]
    pull = _prior_information()
    if isinstance(start, PointFit):
        best = with_cost_about(blocks, actuator, condition, start)
    else:
        best = _fit_at(blocks, actuator, centre, centre if start is None else start, pull)
    step, promised, reach, last = centre, 0.0, 0.0, float("inf")
    least = least_misfit(blocks)
    for left in range(ROUNDS, 0, -1):  # a step that gains nothing is shortened to 0.3 of its length
        if best.cost - least < promising:  # only the sensors' noise is left
            break
        if reach == 0.0:
            step, reach = _step(blocks, best, centre, pull), 1.0
            promised = _promised_gain(blocks, best, centre, pull, step)
            # a circuit whose parameters are not finite would run for ever
            if promised < promising or not np.all(np.isfinite(step)):
                break
            if best.cost - left * max(promised, last) > wanted:
                break
        there = _fit_at(blocks, actuator, centre, best.coordinates + reach * step, pull)
        gain = best.cost - there.cost
        if gain > 0.0:
            best, reach, last = there, 0.0, gain
            if gain < gained:
                break
        elif reach < SHORTEST_TRIAL or _best_gain(promised, reach, gain) < promising:
            break
        else:
            reach *= 0.3
    return best


def _best_gain(promised: float, reach: float, gain: float) -> float:
    """Return the gain of a step at its best length, on the parabola through a trial.

    Its initial slope is twice what the whole step promises, and the trial at a share ``reach`` gave the gain.
    """
    curvature = (2.0 * promised * reach - gain) / reach**2
    return promised**2 / curvature


def with_cost_about(blocks: Blocks, actuator: Actuator, condition: str, fit: PointFit) -> PointFit:
    """Return a fit with its cost about another condition.

    Parameters
    ----------
    condition : str
        The condition about which the weak prior lies.

    Returns
    -------
    PointFit
        The same circuit, with its cost there.
    """
    off = fit.coordinates - actuator.conditions[list(CONDITIONS).index(condition)]
    return replace(fit, cost=misfit(blocks, fit.fitted) + 0.5 * float(off @ _prior_information() @ off))


def normalised_rows(blocks: Blocks, fit: PointFit, slopes: Array) -> tuple[Array, Array]:
    """Return slopes and residuals of a circuit for a linear step, over the size of the residuals.

    Parameters
    ----------
    slopes : ndarray, shape (m, n, outputs)
        Derivatives of the outputs by the unknowns of the step [m/s, Pa].

    Returns
    -------
    tuple of ndarray, shapes (m, k) and (k,)
        Of the blocks that count [dimensionless]; zero where an output is unknown.
    """
    weighted = np.where(blocks.valid, slopes[:, blocks.first :] / fit.scales, 0.0).reshape(len(slopes), -1)
    left = np.where(blocks.valid, (blocks.outputs - fit.fitted)[blocks.first :] / fit.scales, 0.0)
    return weighted, left.ravel()


@cache
def _prior_information() -> Array:
    return np.asarray(LASTING * np.linalg.inv(WEAK_PRIOR), dtype=np.float64)


def _fit_at(blocks: Blocks, actuator: Actuator, centre: Array, point: Array, pull: Array) -> PointFit:
    runs = _neighbour_runs(blocks, actuator, point.tobytes())
    scales = scales_of(blocks, runs[0])
    slopes = (runs[1:] - runs[0]) / STEP
    weighted = np.where(blocks.valid, slopes[:, blocks.first :] / scales, 0.0).reshape(len(point), -1)
    information = weighted @ weighted.T
    off = point - centre
    cost = misfit(blocks, runs[0], scales) + 0.5 * float(off @ pull @ off)
    return PointFit(point, cost, information, scales, runs[0], slopes)


@lru_cache(maxsize=ROUNDS + 1)
def _neighbour_runs(blocks: Blocks, actuator: Actuator, place: bytes) -> Array:
    """Return the runs of a circuit and its neighbours; cached, as rough and thorough searches share first points."""
    point = np.frombuffer(place)
    around = np.vstack([point, point + STEP * np.eye(len(point))])
    runs = predicted_outputs(blocks, parameter_rows(around, actuator.circuit, actuator.rated))
    runs.flags.writeable = False
    return runs


def _step(blocks: Blocks, fit: PointFit, centre: Array, pull: Array) -> Array:
    """Return a Gauss-Newton step, no longer than `FARTHEST`."""
    step = np.linalg.solve(fit.information + pull, _posterior_slope(blocks, fit, centre, pull)).astype(np.float64)
    return step * min(1.0, FARTHEST / float(np.max(np.abs(step))))


def _promised_gain(blocks: Blocks, fit: PointFit, centre: Array, pull: Array, step: Array) -> float:
    """Return the gain in log-posterior that a step promises."""
    return float(step @ (_posterior_slope(blocks, fit, centre, pull) - 0.5 * (fit.information + pull) @ step))


def _posterior_slope(blocks: Blocks, fit: PointFit, centre: Array, pull: Array) -> Array:
    """Return the slope of the log-posterior, shape (7,)."""
    left = np.nan_to_num((blocks.outputs - fit.fitted)[blocks.first :]) / fit.scales**2
    gained: Array = np.einsum("ink,nk->i", fit.slopes[:, blocks.first :], left)
    return gained - pull @ (fit.coordinates - centre)
