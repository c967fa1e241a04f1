"""Initial states of the circuit: with its motor at rest, or under the pressure at the start of a log.

The inner circuit's pressure pushes a single rod out, since it acts on two unlike areas. Friction holds against that
push and a load as far as it can. What is left compresses one chamber, whose oil leaks off, so the piston creeps:
leakage, friction, pressures and make-up flow then balance, and the state hardly changes.
"""

from typing import Any, NamedTuple

import numpy as np

from plant.compiled.functions import Scalar, absolute, maximum, minimum, sqrt, where
from plant.components.friction import quadratic_friction
from plant.components.oil import ATMOSPHERE, specific_volume
from plant.components.orifice import laminar_orifice_flow, orifice_constant
from plant.components.valves import relief_flow
from plant.eha.circuit import CircuitState, CircuitValues, chamber_volumes
from plant.eha.model import piston_areas


def at_rest(p: CircuitValues) -> CircuitState:
    """Return the state in mid-stroke with the motor at rest.

    A through rod stands: both chambers are at the accumulator's pressure, or one is higher and holds a load. A single
    rod stands too if friction holds it, else it creeps in balance.

    Parameters
    ----------
    p : CircuitParameters or namespace of float or ndarray
        The circuit, or many circuits.

    Returns
    -------
    tuple of float or ndarray
        As named in `STATES`.
    """
    standing = under_pressure(p.load_force / p.piston_area, 0.0, p)
    single = np.asarray(p.area_difference) != 0.0
    if not np.any(single):
        return standing
    pairs = zip(_creeping(p), standing, strict=True)
    speed, bristle, position, velocity, oil_a, oil_b, held = (np.where(single, one, other) for one, other in pairs)
    return speed, bristle, position, velocity, oil_a, oil_b, held


def under_pressure(pressure: Scalar, velocity: Scalar, p: CircuitValues) -> CircuitState:
    """Return a state in mid-stroke under a differential pressure: one chamber is above the accumulator's pressure.

    The seals are deflected as far as the force on the piston deflects them.

    Parameters
    ----------
    pressure : float
        Differential pressure [Pa].
    velocity : float
        Piston velocity [m/s].
    p : CircuitParameters or namespace of float
        The circuit.

    Returns
    -------
    tuple of float
        As named in `STATES`.
    """
    area_a, area_b = piston_areas(p)
    push = where(pressure > 0.0, area_a, area_b) * pressure + push_at_rest(p)
    bristle = maximum(minimum(push / where(p.friction_coulomb > 0.0, p.friction_coulomb, 1.0), 1.0), -1.0)
    return _state(bristle, velocity, (maximum(pressure, 0.0), maximum(-pressure, 0.0)), p)


def pressure_of_force(force: Scalar, p: CircuitValues) -> Scalar:
    """Return the differential pressure that holds a force, with one chamber at the accumulator's pressure.

    Parameters
    ----------
    force : float or ndarray
        Friction against extension [N].
    p : CircuitParameters or namespace of float or ndarray
        The circuit.

    Returns
    -------
    float or ndarray
        Pressure in chamber A less that in chamber B [Pa].
    """
    area_a, area_b = piston_areas(p)
    held = force - push_at_rest(p)
    return held / where(held > 0.0, area_a, area_b)


def push_at_rest(p: CircuitValues) -> Scalar:
    """Return the force on the piston, less the load, with both chambers at the accumulator's pressure.

    Parameters
    ----------
    p : CircuitParameters or namespace of float or ndarray
        The circuit.

    Returns
    -------
    float or ndarray
        Force that extends the rod [N].
    """
    area_a, area_b = piston_areas(p)
    return (area_a - area_b) * (p.accumulator_pressure - ATMOSPHERE) - p.load_force


class _Creep(NamedTuple):
    """A creep under a differential pressure: how far the low side is below the accumulator, and the speed."""

    drop: Any
    speed: Any


def _creeping(p: CircuitValues) -> CircuitState:
    """Return the state in which a piston creeps under its push, or stands if friction holds it.

    The chamber that the push compresses is the high side. Its pressure above the low side is found by bisection: the
    piston sweeps what leaks at that pressure, and the force that is left is friction at that speed.
    """
    area_a, area_b = piston_areas(p)
    push = push_at_rest(p)
    outward = push > 0.0
    force, high, low = absolute(push), where(outward, area_b, area_a), where(outward, area_a, area_b)
    coefficients = p.friction_quadratic, p.friction_linear, p.friction_coulomb
    least, most = np.zeros_like(force / high), force / high
    for _ in range(_HALVINGS):
        middle = 0.5 * (least + most)
        drop, speed = _creep(middle, high, low, p)
        held = low * drop + high * (middle - drop) + quadratic_friction(speed, 1.0, *coefficients)
        least, most = where(held < force, middle, least), where(held < force, most, middle)
    stands = force <= p.friction_coulomb
    above = where(stands, 0.0, 0.5 * (least + most))
    drop, speed = _creep(above, high, low, p)
    direction, coulomb = where(outward, 1.0, -1.0), where(p.friction_coulomb > 0.0, p.friction_coulomb, 1.0)
    falling = maximum(-p.friction_linear, 0.0) / coulomb
    bristle = direction * where(stands, force / coulomb, 1.0 / (1.0 + falling * speed))
    sides = where(outward, -drop, above - drop), where(outward, above - drop, -drop)
    return _state(bristle, direction * speed, sides, p)


_HALVINGS = 60
"""Halvings of the range in which the pressure is sought, down to the rounding of a number."""


def _creep(above: Scalar, high: Scalar, low: Scalar, p: CircuitValues) -> _Creep:
    """Return the creep at which the flows of both chambers balance, by `plant.eha.circuit.circuit_flows`.

    The low side takes in what it sweeps through its make-up valve, and through the leaks of the high side. What it has
    too much of leaves through a piloted valve, else through its drain: then it has to be well above the accumulator.
    """
    drain = p.pump_case_leakage + p.cylinder_drain_leakage
    inside = p.leakage_coefficient - p.pump_crossport_leakage - 0.5 * drain
    crossed = (
        laminar_orifice_flow(above, inside, orifice_constant(p.throttle_rated_flow, p.throttle_rated_pressure))
        + (p.pump_crossport_leakage + p.bypass_conductance) * above
        + relief_flow(above, p.relief_pressure, p.relief_conductance)
    )
    ratio = low / high
    # with the case at the accumulator's pressure, or floating below it between the chambers
    fed = _make_up_drop((ratio - 1.0) * crossed + ratio * drain * above, drain * (1.0 + ratio), p)
    floating = _make_up_drop((ratio - 1.0) * (crossed + 0.5 * drain * above), 0.0, p)
    floats = 0.5 * above < fed
    drop = where(floats, floating, fed)
    return _Creep(drop, (crossed + drain * where(floats, 0.5 * above, above - drop)) / high)


def _make_up_drop(wanted: Scalar, drained: Scalar, p: CircuitValues) -> Scalar:
    """Return the drop at which the low side's make-up valve and its drain pass a flow, the root of a quadratic [Pa]."""
    dense = specific_volume(p.accumulator_pressure, p.bulk_modulus, p.air_fraction, p.vapour_pressure)
    check, pilot = p.makeup_conductance * dense, p.pilot_share * p.makeup_conductance * dense
    wide, seat = check + pilot + drained, (pilot + drained) * p.makeup_opening - wanted
    root = sqrt(seat * seat + 4.0 * wide * maximum(wanted, 0.0) * p.makeup_opening)
    opened = where(
        seat > 0.0,
        2.0 * maximum(wanted, 0.0) * p.makeup_opening / where(seat > 0.0, seat + root, 1.0),
        0.5 * (root - seat) / where(wide > 0.0, wide, 1.0),
    )
    out = maximum(pilot + drained, _TIGHTEST * (p.makeup_conductance + p.leakage_coefficient))
    returned = minimum(wanted, 0.0) / where(out > 0.0, out, 1.0)
    most = _MOST_DROP * (p.accumulator_pressure - p.vapour_pressure)
    return maximum(minimum(where(wanted > 0.0, opened, returned), most), -p.relief_pressure)


_MOST_DROP = 0.9
"""Largest drop at which a creep is sought, over that to vapour [fraction]: valves that are shut pass nothing."""

_TIGHTEST = 1e-9
"""Least conductance out of the low side, over that of make-up valve and leakage [dimensionless]: without pilot and
drain it is pumped up until it holds the piston."""


def _state(bristle: Scalar, velocity: Scalar, above: tuple[Scalar, Scalar], p: CircuitValues) -> CircuitState:
    """Return a state in mid-stroke with the chambers so far above the accumulator's pressure."""
    filled_a, filled_b = (
        volume / specific_volume(p.accumulator_pressure + more, p.bulk_modulus, p.air_fraction, p.vapour_pressure)
        for volume, more in zip(chamber_volumes(0.0, p), above, strict=True)
    )
    return 0.0, bristle, 0.0, velocity, filled_a, filled_b, p.accumulator_oil
