"""Scale of all pressures, which motion does not show: its likeliest value in a condition, and its uncertainty."""

from dataclasses import replace

import numpy as np

from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import CONDITION_SPREAD, WEAK_PRIOR, PointFit
from faults.diagnosis.circuits.model_doubt import lasting_misfit
from plant.arrays import Array

PRESSURE_SCALE = np.array([-1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
"""Direction in which all pressures scale without a change of motion [dimensionless]."""

_PULL = np.linalg.solve(CONDITION_SPREAD, PRESSURE_SCALE)

SCALE_INFORMATION = float(_PULL @ PRESSURE_SCALE)
"""Information that the spread of actuators in one condition gives on the logarithm of the scale [dimensionless]."""

ALIKE, ALIKE_COUNT = 0.25, 1.0
"""Prior squared difference of actuators of one kind, in units of `CONDITION_SPREAD` (0.25 is some 10 % in leakage and
friction), and the weight of that prior in deviations [dimensionless]."""


def scale_between(one: Array, other: Array) -> float:
    """Return the scale of pressures by which one circuit most likely differs from another of its condition.

    Parameters
    ----------
    one, other : ndarray, shape (7,)
        Coordinates of both, in `COORDINATES`.

    Returns
    -------
    float
        Logarithm of the scale [dimensionless].
    """
    return float(_PULL @ (one - other)) / SCALE_INFORMATION


def at_likeliest_scale(fit: PointFit, centre: Array) -> PointFit:
    """Return a fit without pressure at the scale that is most likely within a condition.

    Parameters
    ----------
    centre : ndarray, shape (7,)
        Coordinates of the condition.
    """
    shift = scale_between(centre, fit.coordinates)
    return replace(fit, coordinates=fit.coordinates + shift * PRESSURE_SCALE, run_coordinates=fit.coordinates)


def spread_without_pressure(fit: PointFit, information: Array, blocks: Blocks, centre: Array) -> Array:
    """Return the covariance of a fit's coordinates without pressure, for intervals, including the model's error.

    If the model is right, its residuals are the sensors' noise, which averages away; the error of a wrong model
    persists. So variances grow with what remains after averaging over a tenth of a second, beyond white noise. The
    common scale of pressure is known only as far as actuators of one kind are alike; one that differs much in what its
    log determines is assumed to do so in the rest.

    Parameters
    ----------
    fit : PointFit
        The fit.
    information : ndarray, shape (7, 7)
        Credible information, see `credible_information`.
    blocks : Blocks
        Its log, without pressure.
    centre : ndarray, shape (7,)
        Coordinates of its condition.

    Returns
    -------
    ndarray, shape (7, 7)
        Covariance under the weak prior [dimensionless].
    """
    known = information / max(1.0, lasting_misfit(fit.fitted, blocks)) + np.linalg.inv(WEAK_PRIOR)
    weight = information @ np.linalg.inv(np.eye(len(CONDITION_SPREAD)) + CONDITION_SPREAD @ information)
    off, told = fit.coordinates - centre, float(np.trace(CONDITION_SPREAD @ weight))
    unlike = (ALIKE_COUNT * ALIKE + float(off @ weight @ off)) / (ALIKE_COUNT + told)
    known = known + np.outer(_PULL, _PULL) / (unlike * SCALE_INFORMATION)
    return np.asarray(np.linalg.inv(known), dtype=np.float64)
