"""Coefficients of the acceleration form in the filter's scaled units, for hand-written peers.

With states in units ``s``, equation 5.14 (errata E3, E8) reads ``a' = b pull + (damping + 2 quadratic |v|) a`` with
``pull = pumped - bias + velocity v + square v |v| + coulomb sign(v) + acceleration a``.
"""

from dataclasses import dataclass

from estimation.models.eha_forms import ACCELERATION_FORM
from plant.eha.model import EhaParameters


@dataclass(frozen=True)
class Coefficients:
    """Scaled coefficients of the acceleration's rate: those multiplied by bulk modulus, then the others [any unit]."""

    pumped: float
    bias: float
    velocity: float
    square: float
    coulomb: float
    acceleration: float
    damping: float
    quadratic: float


def coefficients(p: EhaParameters) -> Coefficients:
    """Return the coefficients of an actuator; motor speed u pumps ``sign(u) max(pumped |u| - bias, 0)``."""
    _, v, a, b = (state.scale for state in ACCELERATION_FORM.states)
    A, L, M = p.piston_area, p.leakage_coefficient, p.moving_mass
    gain = A * b / (M * p.chamber_volume) / a
    return Coefficients(
        pumped=gain * p.pump_displacement,
        bias=gain * p.flow_bias,
        velocity=-gain * (A + L / A * p.friction_linear) * v,
        square=-gain * L / A * p.friction_quadratic * v * v,
        coulomb=-gain * L / A * p.friction_coulomb,
        acceleration=-gain * L * M / A * a,
        damping=-p.friction_linear / M,
        quadratic=-p.friction_quadratic / M * v,
    )
