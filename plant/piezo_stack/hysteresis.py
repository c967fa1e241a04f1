"""A stack driven so slowly that only hysteresis matters: equation 27 of the piezo-stack paper with errata P2."""

from typing import Any

from plant.compiled.functions import Scalar
from plant.components.bouc_wen import asymmetric_bouc_wen_rate
from plant.solvers.steps import State, rate_driven_step


def hysteresis_rate(rate: Scalar, hysteresis: Scalar, p: Any) -> Scalar:
    """Return the rate of a stack's hysteresis, equation 1 (28) of the piezo-stack paper (errata P1).

    Parameters
    ----------
    rate : float or Expression
        Rate of the drive [V/s].
    hysteresis : float or Expression
        Hysteresis h [m].

    Returns
    -------
    float or Expression
        Rate of h [m/s].
    """
    shape = p.hysteresis_phi_1, p.hysteresis_phi_2, p.hysteresis_phi_3, p.hysteresis_gamma
    return asymmetric_bouc_wen_rate(rate, hysteresis, p.hysteresis, *shape)


def _slow_derivative(state: State, _voltage: Scalar, rate: Scalar, p: Any) -> State:
    return (hysteresis_rate(rate, state[0], p),)


slow_stack_step = rate_driven_step(_slow_derivative)
"""The hysteresis [m] of a stack after a voltage step, regardless of its duration (equation 28, errata P1)."""
