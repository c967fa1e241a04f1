"""The flow form as process models for a filter: two chambers, make-up valves, the pump's drain, the relief valve.

Motor speed and position are measured, so both flows of equation 5.8 are known and friction plays no part. What the
pressure form lacks stands here: chambers whose volume the piston changes, a low side that the inner circuit feeds, a
drain, and flows that are balanced by mass where pressure is not small beside bulk modulus.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

from estimation.models.eha_forms import BULK_MODULUS, volume_left_open
from estimation.models.flow import Delivery, chamber_rates, delivered_flow
from estimation.models.model import ProcessModel, StateVariable
from plant.compiled.expression import ONE, as_expression, jacobian
from plant.compiled.functions import Scalar
from plant.eha.model import EhaParameters
from plant.solvers.steps import solve_linear

FLOOR_NOISE = 2e4
"""Process-noise density of a chamber's pressure, for what straight lines between samples leave out [Pa^2/s]; the noise
of measured speed comes on top (`estimation.eha.by_flow_filter.drive_noise`)."""


def _logarithm(name: str, unit: str, scale: float, lower: float = 1e-6, upper: float = 1e6) -> StateVariable:
    return StateVariable(name, unit, scale, 0.0, lower * scale, upper * scale, logarithmic=True)


STATES = (
    StateVariable("pressure_a_pa", "Pa", 1e5, FLOOR_NOISE),
    StateVariable("pressure_b_pa", "Pa", 1e5, FLOOR_NOISE),
    _logarithm(BULK_MODULUS, "Pa", 1e8, upper=200.0),
    _logarithm("leakage_coefficient", "m^3/(s Pa)", 5e-12),
    _logarithm("flow_bias", "m^3/s", 2.4e-6),
    _logarithm("makeup_conductance", "m^3/(s Pa)", 1e-9),
    _logarithm("makeup_opening", "Pa", 1e3, 0.1, 100.0),
    StateVariable("case_leakage", "m^3/(s Pa)", 2.4e-13, 0.0, 0.0, 1e-10),
    StateVariable("speed_lead", "s", 1e-5, 0.0, 0.0, 1e-3),
    _logarithm("relief_pressure", "Pa", 1e6),
    _logarithm("relief_conductance", "m^3/(s Pa)", 1e-8),
)
"""Chamber pressures, and constants: logarithms of what is positive and may be far from its first guess, as they are
what may be nothing."""

CONSTANTS = ("bulk_modulus", *(state.name for state in STATES[3:]))
"""The constants, as `estimation.models.flow.chamber_rates` calls them."""


def chamber_step(
    state: tuple[Scalar, ...], drives: Any, p: Any, h: Scalar, *, by_mass: bool = False, held: bool = False
) -> tuple[Scalar, ...]:
    """Advance the chamber pressures by one linearly implicit midpoint step, which is of second order.

    Parameters
    ----------
    state : tuple of Expression
        As `STATES`, in SI.
    drives : tuple of pairs
        Motor speed [rad/s] and piston position [m] at the start and end of the step.
    p : namespace of Expression
        The actuator.
    h : Expression
        Time step [s].
    by_mass : bool
        Whether flows are balanced by mass, see `chamber_rates`.
    held : bool
        Whether chambers keep the volume that they have in mid-stroke, as the lumped plant's do.

    Returns
    -------
    tuple of Expression
        The state one step later.
    """
    pressures = (as_expression(state[0]), as_expression(state[1]))
    values = {field.name: getattr(p, field.name) for field in fields(EhaParameters)}
    known = SimpleNamespace(**{**values, **dict(zip(CONSTANTS, state[2:], strict=True))})
    speeds, (x, next_x) = drives
    moved = next_x - x
    delivery = Delivery(delivered_flow(speeds, known, h, 0.5), moved / h, 0.0 if held else x + 0.5 * moved)
    rates = [as_expression(rate) for rate in chamber_rates(pressures, delivery, known, by_mass=by_mass)]
    slopes = jacobian(rates, pressures)
    matrix = [[(ONE if i == j else 0.0) - 0.5 * h * slopes[i][j] for j in range(2)] for i in range(2)]
    change = solve_linear(matrix, [h * rate for rate in rates])
    return (*(old + new for old, new in zip(pressures, change, strict=True)), *state[2:])


def _observe(state: tuple[Scalar, ...], p: Any) -> Mapping[str, Scalar]:
    del p
    return {"differential_pressure_pa": state[0] - state[1]}


CHAMBERS = ProcessModel(
    "chambers",
    STATES,
    chamber_step,
    _observe,
    longest_step=2.5e-4,
    drives=("motor_speed_rad_s", "position_m"),
    parameters=EhaParameters,
    opening=volume_left_open,
)
"""Balanced by volume, equations 5.1 to 5.4."""

CHAMBERS_BY_MASS = replace(CHAMBERS, name="chambers_by_mass", step=partial(chamber_step, by_mass=True))
"""Balanced by mass: oil that leaves a chamber under pressure is denser than where it arrives."""

CHAMBERS_HELD = replace(CHAMBERS, name="chambers_held", step=partial(chamber_step, held=True))
"""With the volumes of mid-stroke: of an actuator whose dead volume is far larger than what the piston sweeps."""
