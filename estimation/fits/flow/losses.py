"""`losses(fits, weights)`: lumped leakage coefficient and flow bias of a log, with their covariance.

The form has two leaks: between the chambers, and a drain from each port to the inner circuit. Equation 5.8 and Table 3
have one, the lumped leakage: the leak between the chambers plus half of a port's drain (errata E17). A log often
determines it far better than its two parts. See decision 304.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypothesis_search.form_fit import DISCRETISED
from estimation.models.flow_parameters import is_single
from plant.arrays import Array
from plant.eha.model import EhaParameters

LEAKAGE, DRAIN, BIAS = "leakage_coefficient", "case_leakage", "flow_bias"

DRAIN_SHARE = 0.5
"""Share of a port's drain that is lumped leakage [fraction]: each of the two ports takes half of the differential
pressure."""

UNEVEN_SIDES = 3e-4
"""What a single rod's balance omits, over the pump's flow at rated speed [fraction]: how the make-up valves open while
the other side loads or unloads is unknown. The flow bias of four building logs was off by this, root mean square."""

UNEVEN_OIL = 1e-3
"""Relative standard deviation of bulk modulus from the same cause [fraction]: root mean square error of 13 building
logs."""

LARGEST_CORRELATION = 0.999
"""Largest correlation of the two that is reported [dimensionless]: a covariance estimated from windows may exceed
one."""


def losses(fits: Sequence[GreyBoxFit], weights: Array) -> tuple[Array, Array]:
    """Return lumped leakage coefficient and flow bias over several fits of a log, with their covariance.

    Parameters
    ----------
    fits : sequence of GreyBoxFit
        Fits of flow forms.
    weights : ndarray, shape (fits,)
        How likely each is [fraction].

    Returns
    -------
    tuple of ndarray, shapes (2,) and (2, 2)
        Values [m^3/(s Pa), m^3/s] and their covariance. It includes the differences between fits, and is infinite if
        the log does not determine one of the two.
    """
    heavy = [(fit, weight) for fit, weight in zip(fits, weights, strict=True) if weight > np.finfo(np.float64).eps]
    each = [_losses_of_fit(fit) for fit, _ in heavy]
    shares = np.array([weight for _, weight in heavy]) / sum(weight for _, weight in heavy)
    values = np.array([value for value, _ in each])
    mean = shares @ values
    apart = values - mean
    within = np.tensordot(shares, np.array([covariance for _, covariance in each]), axes=1)
    return mean, np.asarray(within + (apart.T * shares) @ apart, dtype=np.float64)


def _losses_of_fit(fit: GreyBoxFit) -> tuple[Array, Array]:
    """Return the losses of one fit, whose unknowns are logarithms, and their covariance."""
    names = (LEAKAGE, DRAIN, BIAS)
    across, drain, bias = (fit.values[name] for name in names)
    found = np.array([across + DRAIN_SHARE * drain, bias])
    if math.isinf(fit.std[LEAKAGE]) or math.isinf(fit.std[BIAS]):
        return found, np.diag([np.inf, np.inf])
    places = [fit.model.unknowns.index(name) for name in names]
    answers = np.array([[across, DRAIN_SHARE * drain, 0.0], [0.0, 0.0, bias]])
    return found, answers @ fit.covariance[np.ix_(places, places)] @ answers.T


def with_lumped(
    found: Mapping[str, tuple[float, float]],
    fits: Sequence[GreyBoxFit],
    weights: Array,
    p: EhaParameters,
    pressure: float = np.inf,
) -> tuple[dict[str, tuple[float, float]], float]:
    """Return the result with the lumped leakage coefficient, and its correlation with the flow bias.

    Parameters
    ----------
    found : Mapping[str, tuple of float]
        Value and deviation by parameter [SI]. The leakage coefficient is that between the chambers, at the end of a log
        in which it changes.
    fits : sequence of GreyBoxFit
        As in `losses`; the first is the likeliest, if it alone was used.
    weights : ndarray, shape (fits,)
        As in `losses`.
    p : EhaParameters
        The actuator. Leakage is known no better than the error of the form's balance at rated speed, over relief
        pressure.
    pressure : float
        Root mean square of the log's differential pressure, which a single rod's error refers to [Pa].

    Returns
    -------
    tuple of (dict[str, tuple of float], float)
        The same, and the correlation [dimensionless]; as it was if the form knows no drain.
    """
    if not {LEAKAGE, DRAIN, BIAS} <= set(found):
        return {**found}, 0.0
    values, covariance = losses(fits, weights)
    single = is_single(found, p.area_difference)
    left_out = (UNEVEN_SIDES if single else DISCRETISED) * p.rated_flow
    covariance[0, 0] += (left_out / (min(p.relief_pressure, pressure) if single else p.relief_pressure)) ** 2
    if single:
        # a side held at accumulator pressure drains nothing, so the two leaks look alike
        covariance[0, 0] += (DRAIN_SHARE * found[DRAIN][0]) ** 2
        covariance[1, 1] += left_out**2
        found = {**found, BIAS: (found[BIAS][0], math.hypot(found[BIAS][1], left_out))}
    deviations = np.sqrt(np.diag(covariance))
    if not np.all(np.isfinite(deviations)) or not np.all(deviations > 0.0):
        return {**found, LEAKAGE: (found[LEAKAGE][0] + DRAIN_SHARE * found[DRAIN][0], found[LEAKAGE][1])}, 0.0
    across = float(np.sum(weights * [fit.values[LEAKAGE] for fit in fits]) / np.sum(weights))
    grown = found[LEAKAGE][0] / across
    lumped = float(grown * values[0]), float(grown * deviations[0])
    return {**found, LEAKAGE: lumped}, float(
        np.clip(covariance[0, 1] / np.prod(deviations), -LARGEST_CORRELATION, LARGEST_CORRELATION)
    )


def with_lumped_slopes(slopes: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    """Return the response of the result to the rig's parameters, for the lumped leakage coefficient.

    Parameters
    ----------
    slopes : Mapping[str, Mapping[str, float]]
        By entry of the rig, and by parameter [SI].

    Returns
    -------
    dict[str, dict[str, float]]
        The same.
    """
    return {
        entry: {**one, LEAKAGE: one[LEAKAGE] + DRAIN_SHARE * one[DRAIN]} if {LEAKAGE, DRAIN} <= set(one) else {**one}
        for entry, one in slopes.items()
    }
