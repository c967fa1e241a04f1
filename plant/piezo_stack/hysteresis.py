"""A stack driven so slowly that it is nothing but hysteresis: equation 27 of the piezo-stack paper with errata P2."""

from typing import Any

from plant.compiled.functions import Scalar
from plant.components.bouc_wen import asymmetric_bouc_wen_rate
from plant.solvers.steps import rk4_step


def slow_stack_step(
    state: tuple[Scalar, ...], voltages: tuple[Scalar, Scalar], p: Any, h: Scalar
) -> tuple[Scalar, ...]:
    """Return the hysteresis of a stack after a step of voltage, whatever the time it takes (equation 28, errata P1).

    Parameters
    ----------
    state : tuple of Expression
        Hysteresis h [m].
    voltages : tuple of Expression
        Drive at the step's start and end [V].
    p : namespace of Expression
        The stack.
    h : Expression
        Step [s].

    Returns
    -------
    tuple of Expression
        Hysteresis at the step's end [m].
    """
    rate = (voltages[1] - voltages[0]) / h
    shape = {
        "alpha": p.hysteresis,
        "phi_1": p.hysteresis_phi_1,
        "phi_2": p.hysteresis_phi_2,
        "phi_3": p.hysteresis_phi_3,
        "gamma": p.hysteresis_gamma,
    }

    def law(x: tuple[Scalar, ...], _voltage: Scalar, _p: object) -> tuple[Scalar, ...]:
        return (asymmetric_bouc_wen_rate(rate, x[0], **shape),)

    return rk4_step(law)(state, voltages, p, h)
