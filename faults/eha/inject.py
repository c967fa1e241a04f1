"""Faults over time, air in the oil, and the spread between one actuator and the next."""

from dataclasses import replace

import numpy as np

from faults.conditions import FRICTION_COEFFICIENTS, LEAKAGE_COEFFICIENTS
from plant.eha.model import EhaParameters
from plant.eha.parameter_path import ParameterPath
from plant.errors import HydrostateError


def abrupt_fault(base: EhaParameters, faulty: EhaParameters, at: float) -> ParameterPath:
    """Return parameters that jump from the base to the faulty ones.

    Parameters
    ----------
    at : float
        Time of the jump [s], positive.

    Returns
    -------
    ParameterPath
        The base before `at`, the faulty actuator from `at` on.

    Raises
    ------
    HydrostateError
        If the time is not positive and finite.

    Examples
    --------
    >>> from faults.conditions import CONDITIONS, parameters_for
    >>> path = abrupt_fault(EhaParameters(), parameters_for(CONDITIONS["minor_leakage"]), at=5.0)
    >>> path.sample([4.0, 5.0])[:, 5].tolist()
    [4.784e-12, 2.523e-11]
    """
    if not (np.isfinite(at) and at > 0.0):
        raise HydrostateError(f"an abrupt fault must come at a positive time, got {at!r} s")
    return ParameterPath((0.0, at), (base, faulty), "step")


def growing_fault(base: EhaParameters, faulty: EhaParameters, start: float, end: float) -> ParameterPath:
    """Return parameters that change linearly from the base to the faulty ones.

    Parameters
    ----------
    start, end : float
        Times at which the change begins and is complete [s].

    Returns
    -------
    ParameterPath
        The base before `start`, the faulty actuator after `end`.

    Raises
    ------
    HydrostateError
        If the times are not finite, or the end is not after the start.
    """
    if not (np.isfinite(start) and np.isfinite(end) and end > start):
        raise HydrostateError(f"a growing fault must end after it starts, got start {start!r} s, end {end!r} s")
    return ParameterPath((start, end), (base, faulty), "linear")


def varied_actuator(
    parameters: EhaParameters,
    rng: np.random.Generator,
    leakage: float = 0.1,
    friction: float = 0.1,
    bulk_modulus: float = 0.2,
) -> EhaParameters:
    """Return another actuator of the same kind: uniform relative spread, geometry and pump fixed.

    Parameters
    ----------
    parameters : EhaParameters
        The nominal actuator.
    rng : numpy.random.Generator
        Source of the spread; it draws the same six numbers for any half-widths.
    leakage : float
        Half-width for the leakage coefficient and for the flow bias [dimensionless].
    friction : float
        Half-width for each of a_1, a_2, a_3 [dimensionless].
    bulk_modulus : float
        Half-width for the bulk modulus [dimensionless].

    Raises
    ------
    HydrostateError
        If a half-width is not at least 0 and below 1.
    """
    for name, width in (("leakage", leakage), ("friction", friction), ("bulk_modulus", bulk_modulus)):
        if not 0.0 <= width < 1.0:
            raise HydrostateError(f"{name} spread must be at least 0 and below 1, got {width!r}")
    leaking, rubbing = dict.fromkeys(LEAKAGE_COEFFICIENTS, leakage), dict.fromkeys(FRICTION_COEFFICIENTS, friction)
    widths = {**leaking, **rubbing, "bulk_modulus": bulk_modulus}
    draws = rng.uniform(-1.0, 1.0, len(widths))
    changes = {
        name: getattr(parameters, name) * (1.0 + width * float(draw))
        for (name, width), draw in zip(widths.items(), draws, strict=True)
    }
    return replace(parameters, **changes)
