"""Result of a fitted form, and the average over forms that explain a log equally well."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.pump_ripple import NO_RIPPLE, Turning
from plant.arrays import Array
from plant.notes import Note

if TYPE_CHECKING:
    from estimation.fits.hypothesis_search.explanation import Explanation

LONGEST_STEP = 2.5e-4
"""Longest model step of a form [s]; logs with a longer sample time have several steps per sample."""

TEMPER = 5.0
"""Divisor of log-likelihood differences before models are weighted [dimensionless]. No model is exact: on a log of the
circuit the balance that was likelier by 5.6 put bulk modulus five deviations off, and the other did not."""

DISCRETISED = 3e-5
"""Relative standard deviation of bulk modulus due to a form's steps and to averaging before it [fraction]. Two training
logs at 10 kHz, known to 0.002 % from noise, are 0.005 and 0.007 % too high under any noise. On 876 logs the most likely
value is 0.002 to 0.003 %."""


@dataclass(frozen=True, eq=False)
class FormFit:
    """Result of a form that was fitted to a log.

    Parameters
    ----------
    parameters : Mapping[str, tuple of float]
        Value and standard deviation in SI, by parameter name; the deviation is that due to the log's noise.
    bound : float
        Relative standard deviation of bulk modulus due to the log's noise [fraction].
    chi_square : float
        Mean squared residual over the sensor's variance [dimensionless].
    reasons : tuple of Note
        Objections to the fit.
    rig_slopes : Mapping[str, Mapping[str, float]]
        By uncertain entry of the rig: change of each parameter, in SI, per relative change of the entry.
    explanation : Explanation or None
        The effects added to the form to explain the log; None if none were needed.
    remarks : tuple of Note
        What the log leaves undecided, which is no objection to the fit.
    turning : Turning
        Pump ripple and speed offset that were corrected.
    mean_late : float
        How late an averaged pressure is logged after the middle of its rows [s].
    correlation : float
        Of the errors of leakage coefficient and flow bias [dimensionless].
    """

    parameters: Mapping[str, tuple[float, float]]
    bound: float
    chi_square: float
    reasons: tuple[Note, ...]
    rig_slopes: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])
    explanation: "Explanation | None" = None
    remarks: tuple[Note, ...] = ()
    turning: Turning = NO_RIPPLE
    mean_late: float = 0.0
    correlation: float = 0.0


def with_structure(found: Mapping[str, tuple[float, float]], structure: float) -> dict[str, tuple[float, float]]:
    """Return the result with a wider deviation of bulk modulus, because the form itself may be wrong.

    Parameters
    ----------
    found : Mapping[str, tuple of float]
        Value and deviation by parameter [SI].
    structure : float
        Relative standard deviation of bulk modulus due to what the form omits [fraction].

    Returns
    -------
    dict[str, tuple of float]
        The same with the wider deviation [SI].
    """
    value, std = found["bulk_modulus"]
    return {**found, "bulk_modulus": (value, float(np.hypot(std, structure * value)))}


def weights_of(fits: Sequence[GreyBoxFit], temper: float = TEMPER, priors: Sequence[float] | None = None) -> Array:
    """Return the probability of each of several models of one log.

    Parameters
    ----------
    fits : sequence of GreyBoxFit
        Of the same log.
    temper : float
        Divisor of log-likelihood differences [dimensionless].
    priors : sequence of float, optional
        Prior weights [dimensionless]; equal if not given.

    Returns
    -------
    ndarray, shape (fits,)
        Weights that sum to one [fraction].
    """
    costs = np.array([fit.cost for fit in fits])
    weights = np.exp(-np.minimum((costs - np.min(costs)) / temper, 700.0))
    weights *= 1.0 if priors is None else np.array(priors)
    return np.asarray(weights / np.sum(weights), dtype=np.float64)


def likelihood_mean(
    fits: Sequence[GreyBoxFit], temper: float = TEMPER, priors: Sequence[float] | None = None
) -> Mapping[str, tuple[float, float]]:
    """Return values and deviations over several models of one log, each weighted by its likelihood.

    A model that explains the log less well counts by a power of ``exp(-chi^2/2)``, see `TEMPER`. If two explain it
    equally well, their difference adds to the deviation (Hoeting et al. 1999, Statistical Science 14, equations 3 and
    4).

    Parameters
    ----------
    fits : sequence of GreyBoxFit
        Of the same log, with the same unknowns.
    temper : float
        Divisor of log-likelihood differences [dimensionless].
    priors : sequence of float, optional
        Prior weights [dimensionless]; equal if not given.

    Returns
    -------
    Mapping[str, tuple of float]
        Value and deviation by parameter [SI].
    """
    return model_mean(fits, weights_of(fits, temper, priors))


def model_mean(fits: Sequence[GreyBoxFit], weights: Array) -> Mapping[str, tuple[float, float]]:
    """Return values and deviations over several models of one log under given weights, see `likelihood_mean`.

    Parameters
    ----------
    fits : sequence of GreyBoxFit
        Of the same log, with the same unknowns.
    weights : ndarray, shape (fits,)
        As `weights_of` returns them [fraction].

    Returns
    -------
    Mapping[str, tuple of float]
        Value and deviation by parameter [SI].
    """
    best = min(fits, key=lambda fit: fit.cost)
    found: dict[str, tuple[float, float]] = {}
    for name in (name for name in best.values if all(name in fit.values for fit in fits)):
        values = np.array([fit.values[name] for fit in fits])
        stds = np.array([fit.std[name] for fit in fits])
        mean = float(weights @ values)
        heavy = weights > np.finfo(np.float64).eps
        found[name] = mean, float(np.sqrt(weights[heavy] @ (stds[heavy] ** 2 + (values[heavy] - mean) ** 2)))
    return found
