"""The flow form as process models for a filter: two chambers, make-up valves, the pump's drain, the relief valve.

Motor speed and position are measured, so both flows of equation 5.8 are known, and friction does not appear. Beyond the
pressure form it has: chambers whose volume the piston changes, a low side fed by the inner circuit, a drain, and flows
that are balanced by mass if pressure is not small beside bulk modulus.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from estimation.models.eha_forms import BULK_MODULUS, undetermined_volume
from estimation.models.flow import Delivery, chamber_rates, delivered_flow
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel, StateVariable
from plant.compiled.expression import ONE, as_expression, jacobian
from plant.compiled.functions import Scalar
from plant.eha.model import EhaParameters
from plant.solvers.steps import solve_linear

FLOOR_NOISE = 2e4
"""Process-noise density of a chamber's pressure, for the error of straight lines between samples [Pa^2/s]; the noise of
measured speed is added (`estimation.eha.by_flow_filter.drive_noise`)."""


def logarithm_of(name: str, unit: str, scale: float, lower: float = 1e-6, upper: float = 1e6) -> StateVariable:
    """Return a constant that the filter carries as its logarithm.

    Parameters
    ----------
    name, unit : str
        Its name and unit.
    scale : float
        Its typical size [unit].
    lower, upper : float
        Its bounds, as multiples of the typical size [dimensionless].
    """
    return StateVariable(name, unit, scale, 0.0, lower * scale, upper * scale, logarithmic=True)


STATES = (
    StateVariable("pressure_a_pa", "Pa", 1e5, FLOOR_NOISE),
    StateVariable("pressure_b_pa", "Pa", 1e5, FLOOR_NOISE),
    logarithm_of(BULK_MODULUS, "Pa", 1e8, upper=200.0),
    logarithm_of("leakage_coefficient", "m^3/(s Pa)", 5e-12),
    logarithm_of("flow_bias", "m^3/s", 2.4e-6),
    logarithm_of("makeup_conductance", "m^3/(s Pa)", 1e-9),
    logarithm_of("makeup_opening", "Pa", 1e3, 0.1, 100.0),
    StateVariable("case_leakage", "m^3/(s Pa)", 2.4e-13, 0.0, 0.0, 1e-10),
    StateVariable("speed_lead", "s", 1e-5, 0.0, 0.0, 1e-3),
    logarithm_of("relief_pressure", "Pa", 1e6),
    logarithm_of("relief_conductance", "m^3/(s Pa)", 1e-8),
)
"""Chamber pressures and constants. A positive constant that may be far from its first guess is a logarithm; one that
may be zero is not."""

STDS: Mapping[str, float] = {
    BULK_MODULUS: 0.3,
    "leakage_coefficient": 0.3,
    "flow_bias": 0.3,
    "makeup_conductance": 0.5,
    "makeup_opening": 1.0,
    "case_leakage": 1.0,
    "speed_lead": 2.0,
    "relief_pressure": 0.02,
    "relief_conductance": 0.7,
}
"""Relative standard deviation of each guess [fraction]; for bulk modulus, leakage and bias about half the distance to
the next."""

PRESSURE_STD = 1e4
"""Standard deviation of the chamber pressures before the first sample, at rest [Pa]."""

LOAD_STD = 0.3
"""Standard deviation of the chamber pressures before the first sample of a log that begins under load, where the lower
one may differ from the inner circuit's [fraction of the load]."""

MAKEUP, OPENING, DRAIN, LEAD = 1e-9, 1e3, 2.4e-13, 1e-5
"""First guesses of the make-up conductance [m^3/(s Pa)], of the drop at which a make-up valve is half open [Pa], of the
drain a port [m^3/(s Pa)], and of the motor's lead on the straight line between samples [s]."""

LEAST_GUESS_SHARE = 1e-3
"""Share of the default actuator's value at which a guess of zero begins [fraction]."""

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


def observe_chambers(state: tuple[Scalar, ...], p: Any) -> Mapping[str, Scalar]:
    """Return the differential pressure of two chambers.

    Parameters
    ----------
    state : tuple of Expression
        Both chamber pressures first [Pa].
    p : namespace of Expression
        The actuator, of which nothing is needed.

    Returns
    -------
    Mapping[str, Expression]
        Differential pressure by its channel [Pa].
    """
    del p
    return {"differential_pressure_pa": state[0] - state[1]}


CHAMBERS = ProcessModel(
    "chambers",
    STATES,
    chamber_step,
    observe_chambers,
    longest_step=2.5e-4,
    drives=("motor_speed_rad_s", "position_m"),
    parameters=EhaParameters,
    opening=undetermined_volume,
)
"""Balanced by volume, equations 5.1 to 5.4."""

CHAMBERS_BY_MASS = replace(CHAMBERS, name="chambers_by_mass", step=partial(chamber_step, by_mass=True))
"""Balanced by mass: oil that leaves a chamber under pressure is denser than where it arrives."""

CHAMBERS_HELD = replace(CHAMBERS, name="chambers_held", step=partial(chamber_step, held=True))
"""With the volumes of mid-stroke: of an actuator whose dead volume is far larger than what the piston sweeps."""


def chamber_belief(
    p: EhaParameters,
    load: float,
    modulus: float,
    leakage: float = 1.0,
    bias: float = 1.0,
    makeup: float = MAKEUP,
    *,
    states: Sequence[StateVariable] = STATES,
    stds: Mapping[str, float] = STDS,
) -> Gaussian:
    """Return the prior belief of a chamber filter.

    Parameters
    ----------
    load : float
        Differential pressure that the log begins with [Pa].
    modulus : float
        First guess of bulk modulus [Pa].
    leakage, bias : float
        First guesses, as multiples of the actuator's [dimensionless].
    makeup : float
        First guess of the make-up conductance [m^3/(s Pa)].
    states : sequence of StateVariable
        The filter's states, some of `STATES` by name.
    stds : Mapping[str, float]
        Relative standard deviation of each first guess by state name [fraction].
    """
    healthy = EhaParameters()
    means = {
        "pressure_a_pa": p.accumulator_pressure + max(load, 0.0),
        "pressure_b_pa": p.accumulator_pressure + max(-load, 0.0),
        BULK_MODULUS: modulus,
        "leakage_coefficient": leakage * max(p.leakage_coefficient, LEAST_GUESS_SHARE * healthy.leakage_coefficient),
        "flow_bias": bias * max(p.flow_bias, LEAST_GUESS_SHARE * healthy.flow_bias),
        "makeup_conductance": makeup,
        "makeup_opening": OPENING,
        "case_leakage": DRAIN,
        "speed_lead": LEAD,
        "relief_pressure": p.relief_pressure,
        "relief_conductance": p.relief_conductance,
    }
    pressure = float(np.hypot(PRESSURE_STD, LOAD_STD * load))
    guesses = np.array([means[state.name] for state in states])
    spread = [
        stds[state.name] * guess if state.name in stds else pressure
        for state, guess in zip(states, guesses, strict=True)
    ]
    return Gaussian(guesses, np.diag(np.square(spread)))
