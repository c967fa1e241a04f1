"""Two plants that are nothing but hysteresis: the public benchmark's oscillator, and a stack driven slowly.

The oscillator is that of Noël and Schoukens' benchmark (2016, equations 1 and 2): a mass on a spring, a damper and a
Bouc-Wen force. The slow stack is equation 27 of the piezo-stack paper with errata P2.
"""

from dataclasses import dataclass, fields
from math import isfinite
from typing import Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.functions import Scalar
from plant.components.bouc_wen import asymmetric_bouc_wen_rate, bouc_wen_rate
from plant.errors import RigError
from plant.integrate import rk4_step
from plant.units import SI

Array: TypeAlias = NDArray[np.float64]

BENCHMARK = "Noël and Schoukens 2016, Table 1"


@dataclass(frozen=True, kw_only=True)
class OscillatorParameters:
    """The benchmark's oscillator, ``m y'' + c y' + k y + z = u``; its true values by default.

    Only the products beta gamma and beta delta act, so they are the parameters.

    Raises
    ------
    RigError
        If a value is not finite, or mass, stiffness or alpha are not positive.
    """

    mass: Annotated[float, SI("kg", "mass m", BENCHMARK)] = 2.0
    damping: Annotated[float, SI("N s/m", "damping c", BENCHMARK)] = 10.0
    stiffness: Annotated[float, SI("N/m", "stiffness k", BENCHMARK)] = 5e4
    alpha: Annotated[float, SI("N/m", "small-signal stiffness of the Bouc-Wen force", BENCHMARK)] = 5e4
    beta_gamma: Annotated[float, SI("1/m", "beta times gamma", BENCHMARK)] = 800.0
    beta_delta: Annotated[float, SI("1/m", "beta times delta", BENCHMARK)] = -1100.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isfinite(value) or (field.name in ("mass", "stiffness", "alpha") and value <= 0.0):
                raise RigError(f"{field.name} must be finite, and mass, stiffness and alpha positive, got {value!r}")


def oscillator_derivative(state: tuple[Scalar, ...], force: Scalar, p: Any) -> tuple[Scalar, ...]:
    """Return the rates of the benchmark's oscillator. Source: Noël and Schoukens 2016, equations 1 and 2.

    Parameters
    ----------
    state : tuple of float or Expression
        Displacement [m], velocity [m/s], hysteretic force [N].
    force : float or Expression
        Drive u [N].
    p : OscillatorParameters or namespace of Expression
        The oscillator.

    Returns
    -------
    tuple of float or Expression
        Rates, each a second.

    Examples
    --------
    >>> oscillator_derivative((0.0, 0.0, 1.0), 2.0, OscillatorParameters())
    (0.0, 0.5, 0.0)
    """
    y, v, z = state
    return (
        v,
        (force - p.damping * v - p.stiffness * y - z) / p.mass,
        bouc_wen_rate(v, z, p.alpha, 1.0, p.beta_gamma, p.beta_delta),
    )


oscillator_step = rk4_step(oscillator_derivative)
"""A Runge-Kutta step of the oscillator."""


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
