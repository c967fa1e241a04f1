"""The flow form as one filter for a controller: seven states, begun near the rig's own values.

On a controller there is no room for a bank that reads a log again (`estimation.eha.by_flow_filter`), so drain and the
make-up valves' opening are taken as known, and the filter is as good as its first belief.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from estimation.models.eha_forms import BULK_MODULUS, volume_left_open
from estimation.models.flow import flow_rates
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel, StateVariable
from plant.compiled.expression import ONE, as_expression, jacobian
from plant.compiled.functions import Scalar
from plant.eha.model import EhaParameters
from plant.solvers.steps import solve_linear

MAKEUP = 1e-9
"""First guess of the make-up conductance [m^3/(s Pa)]."""

GUESS_STD = 0.3
"""Standard deviation of each guess's logarithm [dimensionless]."""

PRESSURE_STD = 1e4
"""Standard deviation of the chamber pressures before the first sample, at rest [Pa]."""

LOAD_STD = 0.3
"""Standard deviation of the chamber pressures before the first sample of a log that begins under load [fraction of the
load]."""

SECONDARY_STD: Mapping[str, float] = {"makeup_conductance": 0.1, "speed_lead": 1.0}
"""Relative deviations of what is estimated along with them [fraction]."""

OPENING = 1e3
"""Drop at which a make-up check valve is taken to be half open [Pa]."""

LEAST = 1e-3
"""A guess that is zero begins at this share of the default actuator's value [fraction]."""


def _state(name: str, unit: str, scale: float) -> StateVariable:
    return StateVariable(name, unit, scale, 0.0, 1e-6 * scale, 1e6 * scale, logarithmic=True)


STATES = (
    StateVariable("pressure_a_pa", "Pa", 1e5, 1e6),
    StateVariable("pressure_b_pa", "Pa", 1e5, 1e6),
    replace(_state(BULK_MODULUS, "Pa", 1e8), upper=2e10),
    _state("leakage_coefficient", "m^3/(s Pa)", 5e-12),
    _state("flow_bias", "m^3/s", 2.4e-6),
    _state("makeup_conductance", "m^3/(s Pa)", 1e-9),
    _state("speed_lead", "s", 1e-5),
)
"""Chamber pressures with the process noise that measured speed brings, and constants."""


def flow_filter_step(state: tuple[Scalar, ...], drives: Any, p: Any, h: Scalar) -> tuple[Scalar, ...]:
    """Advance the chamber pressures by one linearly implicit Euler step of the flow form.

    Parameters
    ----------
    state : tuple of Expression
        Chamber pressures [Pa], effective bulk modulus [Pa], leakage coefficient [m^3/(s Pa)], flow bias [m^3/s],
        make-up conductance [m^3/(s Pa)], speed lead [s].
    drives : tuple of pairs
        Motor speed [rad/s] and piston position [m] at the start and end of the step.
    p : namespace of Expression
        The actuator.
    h : Expression
        Time step [s].

    Returns
    -------
    tuple of Expression
        The state one step later.
    """
    pressures = (as_expression(state[0]), as_expression(state[1]))
    constants = dict(zip(("bulk_modulus", *(s.name for s in STATES[3:])), state[2:], strict=True))
    values = {field.name: getattr(p, field.name) for field in fields(EhaParameters)}
    known = SimpleNamespace(**{**values, **constants, "case_leakage": 0.0, "makeup_opening": OPENING})
    rates = [as_expression(rate) for rate in flow_rates(pressures, (*drives, h), known, 0.5)]
    slopes = jacobian(rates, pressures)
    matrix = [[(ONE if i == j else 0.0) - h * slopes[i][j] for j in range(2)] for i in range(2)]
    moved = solve_linear(matrix, [h * rate for rate in rates])
    return (*(x + dx for x, dx in zip(pressures, moved, strict=True)), *state[2:])


def _observe(state: tuple[Scalar, ...], p: Any) -> Mapping[str, Scalar]:
    del p
    return {"differential_pressure_pa": state[0] - state[1]}


FLOW_FILTER = ProcessModel(
    "flow_filter",
    STATES,
    flow_filter_step,
    _observe,
    longest_step=2.5e-4,
    drives=("motor_speed_rad_s", "position_m"),
    parameters=EhaParameters,
    opening=volume_left_open,
)
"""The flow form as a process model: driven by what is measured, so friction plays no part."""


def flow_belief(
    p: EhaParameters,
    load: float = 0.0,
    modulus: float = 1.0,
    leakage: float = 1.0,
    bias: float = 1.0,
    makeup: float = MAKEUP,
) -> Gaussian:
    """Return the belief of the flow form before the first sample.

    Parameters
    ----------
    p : EhaParameters
        The actuator.
    load : float
        Differential pressure that the log begins with [Pa].
    modulus, leakage, bias : float
        First guesses, as multiples of the actuator's [dimensionless].
    makeup : float
        First guess of the make-up conductance [m^3/(s Pa)].
    """
    healthy = EhaParameters()
    means = {
        "pressure_a_pa": p.accumulator_pressure + max(load, 0.0),
        "pressure_b_pa": p.accumulator_pressure + max(-load, 0.0),
        BULK_MODULUS: modulus * p.bulk_modulus,
        "leakage_coefficient": leakage * max(p.leakage_coefficient, LEAST * healthy.leakage_coefficient),
        "flow_bias": bias * max(p.flow_bias, LEAST * healthy.flow_bias),
        "makeup_conductance": makeup,
        "speed_lead": 1e-5,
    }
    stds = [
        float(np.hypot(PRESSURE_STD, LOAD_STD * load))
        if state.unit == "Pa" and not state.logarithmic
        else SECONDARY_STD.get(state.name, GUESS_STD) * value
        for state, value in zip(STATES, means.values(), strict=True)
    ]
    return Gaussian(np.array(list(means.values())), np.diag(np.square(stds)))
