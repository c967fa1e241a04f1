"""The flow form as one filter for a controller: seven states, started near the rig's own values.

A controller has no room for a bank that reads a log again (`estimation.eha.by_flow_filter`). So drain and the make-up
valves' opening are taken as known, and the filter is only as good as its first belief.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

from estimation.models.chambers import CHAMBERS, OPENING, logarithm_of
from estimation.models.completed_flow import CRACKS
from estimation.models.eha_forms import BULK_MODULUS
from estimation.models.flow import flow_rates
from estimation.models.model import StateVariable
from plant.compiled.expression import ONE, as_expression, jacobian
from plant.compiled.functions import Scalar
from plant.eha.model import EhaParameters
from plant.solvers.steps import solve_linear

STDS: Mapping[str, float] = {
    BULK_MODULUS: 0.3,
    "leakage_coefficient": 0.3,
    "flow_bias": 0.3,
    "makeup_conductance": 0.1,
    "speed_lead": 1.0,
}
"""Relative standard deviation of each first guess [fraction]."""

STATES = (
    StateVariable("pressure_a_pa", "Pa", 1e5, 1e6),
    StateVariable("pressure_b_pa", "Pa", 1e5, 1e6),
    logarithm_of(BULK_MODULUS, "Pa", 1e8, upper=200.0),
    logarithm_of("leakage_coefficient", "m^3/(s Pa)", 5e-12),
    logarithm_of("flow_bias", "m^3/s", 2.4e-6),
    logarithm_of("makeup_conductance", "m^3/(s Pa)", 1e-9),
    logarithm_of("speed_lead", "s", 1e-5),
)
"""Chamber pressures with the process noise from measured speed, and constants."""


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
    absent = dict.fromkeys(("case_leakage", *CRACKS), 0.0)
    known = SimpleNamespace(**{**values, **constants, **absent, "makeup_opening": OPENING})
    rates = [as_expression(rate) for rate in flow_rates(pressures, (*drives, h), known, 0.5)]
    slopes = jacobian(rates, pressures)
    matrix = [[(ONE if i == j else 0.0) - h * slopes[i][j] for j in range(2)] for i in range(2)]
    moved = solve_linear(matrix, [h * rate for rate in rates])
    return (*(x + dx for x, dx in zip(pressures, moved, strict=True)), *state[2:])


FLOW_FILTER = replace(CHAMBERS, name="flow_filter", states=STATES, step=flow_filter_step)
"""The flow form as a process model: driven by measurements, so friction has no part in it."""
