"""The motion form: bulk modulus from motor speed and position alone, where no pressure is logged.

The chambers are those of the flow form, but their pressures are not measured: they push the piston, and the log shows
how it starts, stops and rings. So friction is part of the model, with a bristle that yields before it slides, since its
stiffness acts beside the oil's. The scale of the pressures is weakly determined: by the moving mass, and by the inner
circuit's pressure, at which make-up begins.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any

from estimation.models.flow import Delivery, chamber_rates, delivered_flow
from estimation.models.greybox import GreyBoxModel
from plant.compiled.functions import Scalar, absolute, maximum, minimum, where
from plant.components.friction import velocity_under_friction
from plant.components.oil import ATMOSPHERE
from plant.eha.circuit_start import push_at_rest
from plant.eha.model import EhaParameters, load_on_rod, piston_areas
from plant.units import si


@dataclass(frozen=True, kw_only=True)
class MotionParameters(EhaParameters):
    """The actuator's parameters, and those that the motion form adds."""

    case_leakage: float = si(0.0, "m^3/(s Pa)", "drain of a port to the inner circuit", "fitted")
    speed_lead: float = si(0.0, "s", "lead of the motor on the line between samples", "fitted")
    bristle_stiffness: float = si(1e8, "N/m", "stiffness of the seals before they slide", "fitted")
    bristle_damping: float = si(1e2, "N s/m", "damping of the seals before they slide", "fitted")


Friction = Callable[[Scalar, Scalar, SimpleNamespace], tuple[Scalar, Scalar]]
"""``friction(velocity [m/s], bristle [fraction of its deflection at a_3], parameters)``, which returns the bristle's
rate [1/s] and the force against the motion [N]."""

UNKNOWNS = (
    "bulk_modulus",
    "leakage_coefficient",
    "flow_bias",
    "makeup_conductance",
    "case_leakage",
    "speed_lead",
    "friction_quadratic",
    "friction_linear",
    "friction_coulomb",
    "bristle_stiffness",
    "bristle_damping",
)
"""What is fitted; stiffness in N/m and damping in N s/m, the rest as named in the nomenclature."""

HALF_OPEN_DROP = 1.0
"""Drop at which a make-up valve is half open here, as the log does not show it [Pa]: it opens at once."""

LINEAR = {"friction_linear": 2e3}
"""Size in which the linear friction a_2 is fitted, which may be negative (errata E12) [N s/m]."""


def lagging_friction(velocity: Scalar, bristle: Scalar, p: SimpleNamespace) -> tuple[Scalar, Scalar]:
    """Return a bristle's rate and force where the bristle carries the whole steady law of equation 5.10.

    Friction then follows a change of speed only after a distance, ``force / stiffness``. Source: Canudas de Wit et al.,
    IEEE Transactions on Automatic Control 40 (1995), equations 1 to 3, with equation 5.10 as g(v).

    Parameters
    ----------
    velocity : float or Expression
        Piston velocity [m/s].
    bristle : float or Expression
        Deflection over that at which it carries a_3 [dimensionless].
    p : namespace
        The coefficients of friction and of the bristle.

    Returns
    -------
    tuple of float or Expression
        Rate [1/s] and force [N].
    """
    speed = absolute(velocity)
    law = 1.0 + (p.friction_linear + p.friction_quadratic * speed) * speed / p.friction_coulomb
    deflection = p.friction_coulomb / p.bristle_stiffness
    rate = (velocity - speed * bristle / law) / deflection
    return rate, p.friction_coulomb * bristle + p.bristle_damping * deflection * rate


def parallel_friction(velocity: Scalar, bristle: Scalar, p: SimpleNamespace) -> tuple[Scalar, Scalar]:
    """Return a bristle's rate and force where it carries a_3 alone, and what depends on speed acts beside it.

    What falls with speed stays in the bristle, as in `plant.components.presliding`.

    Parameters
    ----------
    velocity : float or Expression
        Piston velocity [m/s].
    bristle : float or Expression
        Deflection over that at which it carries a_3 [dimensionless].
    p : namespace
        The coefficients of friction and of the bristle.

    Returns
    -------
    tuple of float or Expression
        Rate [1/s] and force [N].
    """
    speed = absolute(velocity)
    falling = maximum(-p.friction_linear, 0.0)
    deflection = p.friction_coulomb / p.bristle_stiffness
    rate = (velocity - speed * bristle * (1.0 + falling * speed / p.friction_coulomb)) / deflection
    damping = p.bristle_damping * deflection / (1.0 + p.bristle_damping / p.friction_coulomb * speed)
    rest = p.friction_quadratic - falling * falling / (p.friction_coulomb + falling * speed)
    beside = (maximum(p.friction_linear, 0.0) + rest * speed) * velocity
    return rate, p.friction_coulomb * bristle + damping * rate + beside


def _at_rest(friction: Friction, p: SimpleNamespace) -> tuple[Scalar, ...]:
    """Return the state with the motor at rest; a single rod creeps if friction does not hold it.

    The low side is at the inner circuit's pressure, and the high side above it: the piston sweeps what leaks there, and
    the force that is left is friction. So the pressure is the root of the quadratic that an implicit step solves.
    """
    single, supply = absolute(p.area_difference) > 0.0, p.accumulator_pressure
    area_a, area_b = piston_areas(p)
    push = push_at_rest(p)
    high = where(push > 0.0, area_b, area_a)
    creep = (p.leakage_coefficient + p.case_leakage) / high
    above = velocity_under_friction(
        push, high + p.friction_linear * creep, p.friction_quadratic * creep * creep, p.friction_coulomb
    )
    velocity = creep * above
    free, bent = (friction(velocity, bristle, p)[0] for bristle in (0.0, 1.0))
    slides = absolute(free - bent) > 0.0
    standing = maximum(minimum(push / p.friction_coulomb, 1.0), -1.0)
    bristle = where(slides, free / where(slides, free - bent, 1.0), standing)
    held = where(single, -above, p.load_force / p.piston_area)
    moving = where(single, velocity, 0.0), where(single, bristle, 0.0)
    return 0.0, *moving, supply + maximum(held, 0.0), supply + maximum(-held, 0.0)


def _observed_position(state: Any) -> tuple[Scalar]:
    return (state[0],)


def _motion_form(name: str, friction: Friction) -> GreyBoxModel:
    def rates(state: Any, drives: Any, p: SimpleNamespace, share: Scalar) -> tuple[Scalar, ...]:
        _, velocity, bristle, p1, p2 = state
        speeds, (x, next_x), step = drives
        yielding, force = friction(velocity, bristle, p)
        delivery = Delivery(delivered_flow(speeds, p, step, share), velocity, x + share * (next_x - x))
        circuit = SimpleNamespace(**vars(p), makeup_opening=HALF_OPEN_DROP)
        pushing = chamber_rates((p1, p2), delivery, circuit, by_mass=False)
        area_1, area_2 = piston_areas(p)
        push = area_1 * (p1 - ATMOSPHERE) - area_2 * (p2 - ATMOSPHERE) - load_on_rod(x + share * (next_x - x), p)
        return velocity, (push - force) / p.moving_mass, yielding, *pushing

    return GreyBoxModel(
        name=name,
        drives=("motor_speed_rad_s", "position_m"),
        outputs=("position_m",),
        unknowns=(),
        initial=partial(_at_rest, friction),
        rates=rates,
        observe=_observed_position,
        parameters=MotionParameters,
    )


MOTION_FORMS = (_motion_form("motion_lagging", lagging_friction), _motion_form("motion_parallel", parallel_friction))
"""The motion form with either structure of friction; position is counted from where the log begins, and the measured
one sets the chambers' volumes."""
