"""Faults of the piezo-stack actuator as changes of its parameters, and the nine conditions as leakage and friction."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeAlias

from faults.conditions import CONDITIONS, find_condition
from plant.errors import require_known
from plant.piezo_stack.parameters import PiezoStackParameters

StackFault: TypeAlias = Callable[[PiezoStackParameters], PiezoStackParameters]
"""Maps a healthy actuator to a faulty one."""

CROSSPORT_LEAKAGE: Mapping[str, float] = {"none": 0.0, "minor": 5e-12, "major": 2e-11}
"""Cross-port leakage of the cylinder at each level [m^3/(s Pa)]: about 10 and 33 % of the flow at 275 Hz and 10 kg,
judged."""

ADDED_FRICTION: Mapping[str, float] = {"none": 0.0, "minor": 100.0, "major": 250.0}
"""Coulomb friction added to the healthy one at each level [N]: about 23 and 56 % of that flow, judged."""


def _with_air(factor: float) -> StackFault:
    return lambda p: replace(p, air_fraction=factor * p.air_fraction)


def _with_depolarised_stack(share: float) -> StackFault:
    return lambda p: replace(
        p, free_stroke_a_volt=(1.0 - share) * p.free_stroke_a_volt, hysteresis=(1.0 - share) * p.hysteresis
    )


STACK_FAULTS: Mapping[str, StackFault] = {
    "air_doubled": _with_air(2.0),
    "air_fourfold": _with_air(4.0),
    "chamber_leakage_minor": lambda p: replace(p, chamber_leakage=5e-12),
    "chamber_leakage_major": lambda p: replace(p, chamber_leakage=2e-11),
    "outlet_reed_soft": lambda p: replace(p, outlet_reed_stiffness=0.5 * p.outlet_reed_stiffness),
    "inlet_reed_soft": lambda p: replace(p, inlet_reed_stiffness=0.5 * p.inlet_reed_stiffness),
    "outlet_reed_gap": lambda p: replace(p, outlet_reed_gap=3e-5),
    "inlet_reed_gap": lambda p: replace(p, inlet_reed_gap=3e-5),
    "outlet_reed_stuck_open": lambda p: replace(p, outlet_reed_gap=1.5e-4),
    "inlet_reed_jammed": lambda p: replace(p, inlet_reed_stiffness=100.0 * p.inlet_reed_stiffness),
    "depolarised_10_percent": _with_depolarised_stack(0.10),
    "depolarised_25_percent": _with_depolarised_stack(0.25),
    "bias_lost": lambda p: replace(p, bias_pressure=0.6 * p.bias_pressure),
}
"""Faults other than the nine conditions, by name."""


def stack_in_condition(healthy: PiezoStackParameters, name: str) -> PiezoStackParameters:
    """Return the actuator in one of the nine conditions: leakage across the cylinder, and friction on its rod.

    Raises
    ------
    HydrostateError
        If there is no such condition.

    Examples
    --------
    >>> stack_in_condition(PiezoStackParameters(), "major_leakage_minor_friction").coulomb_friction
    120.0
    """
    condition = find_condition(name)
    return replace(
        healthy,
        crossport_leakage=healthy.crossport_leakage + CROSSPORT_LEAKAGE[condition.leakage],
        coulomb_friction=healthy.coulomb_friction + ADDED_FRICTION[condition.friction],
    )


def stack_with_fault(healthy: PiezoStackParameters, name: str) -> PiezoStackParameters:
    """Return the actuator with a fault or in a condition.

    Parameters
    ----------
    name : str
        One of `STACK_FAULTS` or of the nine conditions.

    Raises
    ------
    HydrostateError
        If there is no such fault.

    Examples
    --------
    >>> stack_with_fault(PiezoStackParameters(), "air_doubled").air_fraction
    0.049
    """
    if name in STACK_FAULTS:
        return STACK_FAULTS[name](healthy)
    require_known("a fault of the piezo stack", name, [*CONDITIONS, *STACK_FAULTS])
    return stack_in_condition(healthy, name)
