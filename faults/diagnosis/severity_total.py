"""Total intervals of severities: the effect of the rig file's uncertainty, by steady-state scaling laws.

At rated speed, pumped flow that does not move the piston leaks. So the response of leakage to a relative error of
displacement or area is pumped flow over leakage; that of velocity lost is one. Friction is area times pressure, and
responds to the gain of the pressure sensor. Without pressure the missing flow is the product of leakage and pressure:
the error of a wrong ratio goes into one or the other, and each gets all of it, which is too much. The scale itself is
limited by how alike actuators of one kind are, which the interval given the rig includes already.

Leakage is reported at rated pressure, which few logs reach. It is extrapolated in proportion to pressure, as oil flows
through a narrow gap. Through a scored land or a throttle it rises with the square root of pressure (Merritt, Hydraulic
Control Systems, 1967, chapter 3), and is less there.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import inf

from estimation.eha.rig_share import Responses, with_total
from estimation.finding import Quantity
from faults.diagnosis.circuits.actuator import Actuator
from plant.components.friction import quadratic_friction
from plant.eha.doubts import PRESSURE_GAIN, Spread

LEAST_LEAKAGE = 1e-2
"""Least share of the pumped flow that counts as leakage [fraction]."""

_TURBULENT = "turbulent_share"

TURBULENT = Spread(0.35, 0.0)
"""Share of a leakage that may rise with the square root of pressure [fraction], judged: a standard deviation."""


def with_totals(
    found: Mapping[str, Quantity],
    actuator: Actuator,
    spreads: Mapping[str, Spread],
    *,
    pressure: bool,
    reached: float = inf,
) -> Mapping[str, Quantity]:
    """Return severities with their total intervals; bulk modulus and air have theirs already.

    Parameters
    ----------
    found : Mapping[str, Quantity]
        Severities, by the names of `faults.diagnosis.severity.UNITS`; an existing total interval is included.
    spreads : Mapping[str, Spread]
        Uncertainty of each entry of the rig.
    pressure : bool
        Whether differential pressure is used.
    reached : float
        Largest differential pressure of the log [Pa].

    Returns
    -------
    Mapping[str, Quantity]
        The same, each with both intervals; without the total if velocity lost is not determined.
    """
    lost = found["velocity_lost"].value
    if lost is None:
        return found
    laws, whole = _rig_responses(lost, actuator, pressure=pressure), _whole_quantities(found, actuator)
    beyond = 1.0 - min(1.0, reached / actuator.circuit.relief_pressure) ** 0.5
    laws = {**laws, "leakage_flow": {**laws["leakage_flow"], _TURBULENT: beyond}}
    spreads = {**spreads, _TURBULENT: TURBULENT}
    totals = {name: with_total(found[name], law, spreads, whole.get(name)) for name, law in laws.items()}
    return {**found, **{name: _total_including(found[name].ci95_total, one) for name, one in totals.items()}}


def _total_including(ends: tuple[float, float] | None, one: Quantity) -> Quantity:
    """Return a quantity whose total interval includes another."""
    if ends is None or one.ci95_total is None:
        return one
    return replace(one, ci95_total=(min(ends[0], one.ci95_total[0]), max(ends[1], one.ci95_total[1])))


def _rig_responses(lost: float, actuator: Actuator, *, pressure: bool) -> Mapping[str, Responses]:
    """Return the response of severities to errors of the rig file, over the whole (`_whole_quantities`) or itself."""
    healthy = actuator.circuit
    swept = healthy.piston_area * actuator.rated * (1.0 - lost / 100.0)
    pumped = healthy.rated_flow
    ratio = pumped / max(pumped - swept, LEAST_LEAKAGE * pumped)
    flows: Responses = {"pump_displacement": ratio, "piston_area": 1.0 - ratio}
    gauge: Responses = {"pump_displacement": 1.0, "piston_area": 1.0, PRESSURE_GAIN: -1.0}
    return {
        "leakage_flow": {**flows, PRESSURE_GAIN: 1.0} if pressure else flows,
        "velocity_lost": {"pump_displacement": 1.0, "piston_area": -1.0},
        "added_friction": gauge if pressure else flows,
        "pressure_rise": gauge if pressure else flows,
    }


def _whole_quantities(found: Mapping[str, Quantity], actuator: Actuator) -> Mapping[str, float]:
    """Return the whole from which each severity is a difference, in the severity's unit."""
    p = actuator.circuit
    sound = float(quadratic_friction(actuator.rated, 1.0, p.friction_quadratic, p.friction_linear, p.friction_coulomb))
    value = {name: one.value or 0.0 for name, one in found.items()}
    return {
        "velocity_lost": 100.0 - value["velocity_lost"],
        "added_friction": sound + value["added_friction"],
        "pressure_rise": 100.0 + value["pressure_rise"],
    }
