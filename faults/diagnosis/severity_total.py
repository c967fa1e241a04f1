"""Total intervals of severities: the effect of the rig file's uncertainty, by steady-state scaling laws.

At rated speed the pumped flow that does not move the piston leaks, so leakage answers an error of displacement or area
by pumped flow over leakage; the velocity that is lost answers it one to one. Friction is area times pressure, and the
gain of the sensor is that of the pressure. Without pressure the missing flow is the product of leakage and pressure:
what a wrong ratio adds goes into either, so each is given it in full, which is too much; the scale itself is held by
how alike actuators of one kind are, which the interval given the rig holds already.

Leakage is told at rated pressure, which few logs come near. It is carried on in proportion to pressure, as oil flows
through a narrow gap. Through a scored land or a throttle it rises with the root of pressure (Merritt, Hydraulic Control
Systems, 1967, chapter 3), and is less there.
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
"""Least share of the pumped flow that counts as leaking [fraction]."""

_TURBULENT = "turbulent_share"

TURBULENT = Spread(0.35, 0.0)
"""Share of a leakage that may rise with the root of pressure [fraction], judged: a standard deviation."""


def with_totals(
    found: Mapping[str, Quantity],
    actuator: Actuator,
    spreads: Mapping[str, Spread],
    *,
    pressure: bool,
    reached: float = inf,
) -> Mapping[str, Quantity]:
    """Return severities with their total intervals; bulk modulus and the air bring theirs along.

    Parameters
    ----------
    found : Mapping[str, Quantity]
        Severities, by the names of `faults.diagnosis.severity.UNITS`; a total that one has already is held too.
    actuator : Actuator
        The healthy actuator.
    spreads : Mapping[str, Spread]
        How far each entry of the rig may be off.
    pressure : bool
        Whether differential pressure is used.
    reached : float
        Largest differential pressure of the log [Pa].

    Returns
    -------
    Mapping[str, Quantity]
        The same, each with both intervals; without the total where the velocity that is lost is not determined.
    """
    lost = found["velocity_lost"].value
    if lost is None:
        return found
    laws, whole = _laws(lost, actuator, pressure=pressure), _whole(found, actuator)
    beyond = 1.0 - min(1.0, reached / actuator.circuit.relief_pressure) ** 0.5
    laws = {**laws, "leakage_flow": {**laws["leakage_flow"], _TURBULENT: beyond}}
    spreads = {**spreads, _TURBULENT: TURBULENT}
    totals = {name: with_total(found[name], law, spreads, whole.get(name)) for name, law in laws.items()}
    return {**found, **{name: _holding(found[name].ci95_total, one) for name, one in totals.items()}}


def _holding(ends: tuple[float, float] | None, one: Quantity) -> Quantity:
    """Return a quantity whose total interval holds another, too."""
    if ends is None or one.ci95_total is None:
        return one
    return replace(one, ci95_total=(min(ends[0], one.ci95_total[0]), max(ends[1], one.ci95_total[1])))


def _laws(lost: float, actuator: Actuator, *, pressure: bool) -> Mapping[str, Responses]:
    """Return the response of severities to errors of the rig file, as a share of the whole (`_whole`) or of itself."""
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


def _whole(found: Mapping[str, Quantity], actuator: Actuator) -> Mapping[str, float]:
    """Return the whole that each severity adds to or takes from, in the severity's unit."""
    p = actuator.circuit
    sound = float(quadratic_friction(actuator.rated, 1.0, p.friction_quadratic, p.friction_linear, p.friction_coulomb))
    value = {name: one.value or 0.0 for name, one in found.items()}
    return {
        "velocity_lost": 100.0 - value["velocity_lost"],
        "added_friction": sound + value["added_friction"],
        "pressure_rise": 100.0 + value["pressure_rise"],
    }
