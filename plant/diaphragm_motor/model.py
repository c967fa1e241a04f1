"""The seven-chamber piezo diaphragm motor: diaphragms in series, eight check valves, 4/3 valve, double-acting cylinder.

Equations 1, 2, 15, 16, 20 and 21 of the diaphragm-motor paper with errata M1 to M22, written as the physics behind
them: the volume balance of each chamber, the momentum of each port, and the motion of the piston. Neighbouring
diaphragms are driven 180 degrees apart. The hysteresis law is odd: the loops of neighbours mirror each other, so one
state serves all seven. Pressures are relative to the tank.
"""

from collections.abc import Mapping
from dataclasses import fields, make_dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np

from plant.arrays import Array
from plant.compiled.functions import Scalar, absolute, maximum, tanh
from plant.components.bouc_wen import power_bouc_wen_rate
from plant.components.diaphragm import centre_deflection, chamber_compliance
from plant.components.directional_valve import fed_pressure, pressure_after_return, return_flow, tank_openings
from plant.components.end_stop import end_stop_force
from plant.components.flap_valve import late_share, opening_target, orifice_drag, port_flow_after
from plant.diaphragm_motor.parameters import DIAPHRAGMS, ROWS, VALVES, DiaphragmMotorParameters

State: TypeAlias = tuple[Scalar, ...]

STATES = (
    *(f"chamber_{i}_pressure_pa" for i in range(1, DIAPHRAGMS + 1)),
    "hysteresis_v",
    *(f"valve_{j}_flow_m3_s" for j in range(1, VALVES + 1)),
    *(f"valve_{j}_opening" for j in range(1, VALVES + 1)),
    "pressure_a_pa",
    "pressure_b_pa",
    "velocity_m_s",
    "position_m",
)
"""The states; flows and openings of the check valves are ordered from the inlet."""

PRESSURES = slice(0, DIAPHRAGMS)
HYSTERESIS = DIAPHRAGMS
FLOWS = slice(DIAPHRAGMS + 1, DIAPHRAGMS + 1 + VALVES)
OPENINGS = slice(FLOWS.stop, FLOWS.stop + VALVES)
SIDE_A, SIDE_B, VELOCITY, POSITION = range(OPENINGS.stop, OPENINGS.stop + 4)

POLARITY = tuple(1.0 if i % 2 == 0 else -1.0 for i in range(DIAPHRAGMS))
"""Sign of each diaphragm's drive: neighbours are 180 degrees apart (section 2)."""

END_STIFFNESS, END_DAMPING = 1e6, 20.0
"""Stiffness and damping of the cylinder's end stops [N/m], [s/m]."""

_NAMES: Mapping[str, list[str]] = {
    field.name: [f"{field.name}_{i}" for i in range(1, ROWS[field.name] + 1)] if field.name in ROWS else [field.name]
    for field in fields(DiaphragmMotorParameters)
}

MotorRow = make_dataclass("MotorRow", [(name, float) for names in _NAMES.values() for name in names])
"""The parameters as compiled kernels take them: each value of a row has its own name."""


def motor_row(p: DiaphragmMotorParameters) -> Array:
    """Return the parameters as an array, in the order of `MotorRow` (Table 1, errata M22).

    Returns
    -------
    ndarray, shape (parameters,)
        Parameter values in SI.
    """
    return np.concatenate([np.atleast_1d(np.asarray(getattr(p, field.name), np.float64)) for field in fields(p)])


def reassemble_rows(flat: Any) -> SimpleNamespace:
    """Return the parameters with their rows reassembled from names such as ``valve_leak_3`` (Table 1).

    Parameters
    ----------
    flat : namespace
        Values or symbols with the names of `MotorRow`.

    Returns
    -------
    namespace
        The same values with the names of `DiaphragmMotorParameters`.
    """
    rows = {name: tuple(getattr(flat, one) for one in names) for name, names in _NAMES.items()}
    return SimpleNamespace(**{name: row if name in ROWS else row[0] for name, row in rows.items()})


def _drops(pressures: State, outlet: Scalar) -> list[Scalar]:
    """Return the pressure drop across each check valve, from the tank through the chambers to the supplied side."""
    nodes = [0.0, *pressures, outlet]
    return [before - behind for before, behind in pairwise(nodes)]


def _targets(drops: list[Scalar], p: Any) -> list[Scalar]:
    return [
        opening_target(drop, leak, lift, p.cracking_pressure, p.opening_range)
        for drop, leak, lift in zip(drops, p.valve_leak, p.valve_lift, strict=True)
    ]


def _drags(openings: State, p: Any) -> list[Scalar]:
    """Return the quadratic drag of each port; the supplying land is in series with the last check valve."""
    drags = [orifice_drag(s, p.port_area, p.discharge_coefficient, p.density) for s in openings]
    return [*drags[:-1], drags[-1] + 1.0 / (p.land_conductance * p.land_conductance)]


def _compliances(pressures: State, p: Any) -> list[Scalar]:
    rest, walls = p.supply_pressure, (p.diaphragm_compliance, p.chamber_volume / p.bulk_modulus)
    return [
        chamber_compliance(rest + pressure, *walls, fraction * p.chamber_volume, p.gas_exponent, rest)
        for pressure, fraction in zip(pressures, p.gas_fraction, strict=True)
    ]


def _side_inflows(feed: Scalar, velocity: Scalar, leaked: Scalar, p: Any) -> tuple[Scalar, Scalar]:
    """Return the flows into sides A and B, excluding the return flow to tank."""
    swept = p.piston_area * velocity
    return fed_pressure(p.spool, feed, 0.0) - swept - leaked, fed_pressure(p.spool, 0.0, feed) + swept + leaked


def _side_compliance(p: Any) -> Scalar:
    return p.line_compliance + p.cylinder_volume / p.cylinder_bulk_modulus


def _force(side_a: Scalar, side_b: Scalar, velocity: Scalar, position: Scalar, p: Any) -> Scalar:
    """Return the force on the piston, excluding its inertia: equation 2 with errata M2."""
    rubbed = p.viscous_friction * velocity + p.coulomb_friction * tanh(velocity / p.friction_speed)
    sprung = p.spring_stiffness * position + p.cubic_stiffness * position * position * position
    stopped = end_stop_force(position, velocity, p.half_stroke, END_STIFFNESS, END_DAMPING)
    return p.piston_area * (side_a - side_b) - p.load_force - rubbed - sprung + stopped


def _hysteresis_rate(rate: Scalar, hysteresis: Scalar, p: Any) -> Scalar:
    shape = p.hysteresis, p.hysteresis_beta, p.hysteresis_gamma, p.hysteresis_exponent
    return power_bouc_wen_rate(rate, hysteresis, *shape)


def motor_derivative(state: State, rate: Scalar, p: Any) -> State:
    """Return the rates of the motor: the balances behind equations 1, 2, 20 and 21 with errata M1 to M22.

    Parameters
    ----------
    state : tuple of float or Expression
        As named in `STATES`, in SI.
    rate : float or Expression
        Rate of the drive voltage [V/s]; the voltage acts only through its rate.

    Returns
    -------
    tuple of float or Expression
        Rates of the states, per second.
    """
    pressures, flows, openings = state[PRESSURES], state[FLOWS], state[OPENINGS]
    side_a, side_b, velocity, position = state[SIDE_A:]
    drops = _drops(pressures, fed_pressure(p.spool, side_a, side_b))
    yielded = _hysteresis_rate(rate, state[HYSTERESIS], p)
    driven = p.volume_a_volt * (rate - yielded)
    chambers = [
        (into - out + polarity * share * driven) / compliance
        for into, out, polarity, share, compliance in zip(
            flows[:-1], flows[1:], POLARITY, p.polarisation, _compliances(pressures, p), strict=True
        )
    ]
    ports = [
        (drop - p.valve_resistance * q - drag * q * absolute(q)) / p.inertance
        for drop, q, drag in zip(drops, flows, _drags(openings, p), strict=True)
    ]
    valves = [(target - s) / p.valve_lag for target, s in zip(_targets(drops, p), openings, strict=True)]
    leaked = p.crossport_leakage * (side_a - side_b)
    into_a, into_b = _side_inflows(flows[-1], velocity, leaked, p)
    open_a, open_b = tank_openings(p.spool)
    compliance = _side_compliance(p)
    return (
        *chambers,
        yielded,
        *ports,
        *valves,
        (into_a - return_flow(side_a, p.land_conductance * open_a)) / compliance,
        (into_b - return_flow(side_b, p.land_conductance * open_b)) / compliance,
        _force(side_a, side_b, velocity, position, p) / p.moving_mass,
        velocity,
    )


def motor_step(state: State, voltages: tuple[Scalar, Scalar], flat: Any, h: Scalar) -> State:
    """Return the state after a leapfrog step of `motor_derivative`: flows, openings and speed are half a step earlier.

    Pressures drive flows and flows drive pressures at staggered times, so the scheme is second-order and adds no energy
    loss of its own. Losses are treated as in `port_flow_after`, because a shut port is stiffer than any step. No
    pressure falls below the least pressure.

    Parameters
    ----------
    state : tuple of Expression
        As named in `STATES`, in SI.
    voltages : tuple of Expression
        Drive of the first diaphragm at the start and end of the step [V].
    flat : namespace of Expression
        The motor, with the names of `MotorRow`.
    h : Expression
        Step [s].

    Returns
    -------
    tuple of Expression
        The next state.
    """
    p = reassemble_rows(flat)
    pressures, flows, openings = state[PRESSURES], state[FLOWS], state[OPENINGS]
    hysteresis = state[HYSTERESIS]
    side_a, side_b, velocity, position = state[SIDE_A:]
    drops = _drops(pressures, fed_pressure(p.spool, side_a, side_b))
    held = 0.5 * h / p.valve_lag
    opened = [
        ((1.0 - held) * s + 2.0 * held * target) / (1.0 + held)
        for s, target in zip(openings, _targets(drops, p), strict=True)
    ]
    midway = tuple(0.5 * (before + after) for before, after in zip(openings, opened, strict=True))
    passed = [
        port_flow_after(q, drop, drag, p.valve_resistance, p.inertance, h)
        for q, drop, drag in zip(flows, drops, _drags(midway, p), strict=True)
    ]
    swing = voltages[1] - voltages[0]
    yielded = _hysteresis_rate(swing, hysteresis + 0.5 * _hysteresis_rate(swing, hysteresis, p), p)
    driven = p.volume_a_volt * (swing - yielded)
    displaced = [
        h * (into - out) + polarity * share * driven
        for into, out, polarity, share in zip(passed[:-1], passed[1:], POLARITY, p.polarisation, strict=True)
    ]
    stuck = tanh(velocity / p.friction_speed)
    resistance = p.viscous_friction + p.coulomb_friction / p.friction_speed * (1.0 - stuck * stuck)
    force = _force(side_a, side_b, velocity, position, p)
    late = late_share(h * resistance / p.moving_mass)
    speed = velocity + h * force / (p.moving_mass + late * h * resistance)
    leaked = p.crossport_leakage * (side_a - side_b)
    into_a, into_b = _side_inflows(passed[-1], speed, leaked, p)
    open_a, open_b = tank_openings(p.spool)
    compliance = _side_compliance(p)
    lowest = p.least_pressure - p.supply_pressure
    return (
        *_chambers_after(pressures, displaced, p),
        hysteresis + yielded,
        *passed,
        *opened,
        maximum(pressure_after_return(side_a, into_a, compliance, p.land_conductance * open_a, h), lowest),
        maximum(pressure_after_return(side_b, into_b, compliance, p.land_conductance * open_b, h), lowest),
        speed,
        position + h * speed,
    )


def _chambers_after(pressures: State, displaced: list[Scalar], p: Any) -> list[Scalar]:
    """Return the chamber pressures after volumes were pressed in; stiffness is evaluated at the midpoint."""
    lowest = p.least_pressure - p.supply_pressure
    stiff = p.diaphragm_compliance + p.chamber_volume / p.bulk_modulus
    after: list[Scalar] = []
    for pressure, volume, compliance in zip(pressures, displaced, _compliances(pressures, p), strict=True):
        ahead = volume / compliance
        softening = (1.0 + 1.0 / p.gas_exponent) * (compliance - stiff) / (p.supply_pressure + pressure)
        after.append(maximum(pressure + volume / (compliance - 0.5 * softening * ahead), lowest))
    return after


def at_rest(p: Any) -> Array:
    """Return the undriven state at tank pressure, with valves shut (section 2).

    Returns
    -------
    ndarray, shape (28,)
        As named in `STATES`, in SI.

    Examples
    --------
    >>> at_rest(DiaphragmMotorParameters()).shape
    (28,)
    """
    state = np.zeros(len(STATES))
    state[OPENINGS] = p.valve_leak
    return state


def deflections(states: Array, voltage: Array, p: Any) -> Array:
    """Return the deflections of the diaphragms' centres into their chambers (equation 16, errata M16).

    Parameters
    ----------
    states : ndarray, shape (n, 28)
        As named in `STATES`.
    voltage : ndarray, shape (n,)
        Drive of the first diaphragm [V].

    Returns
    -------
    ndarray, shape (n, 7)
        Deflections [m].
    """
    acting = (voltage - states[:, HYSTERESIS])[:, None] * (np.array(POLARITY) * np.array(p.polarisation))
    return centre_deflection(acting, states[:, PRESSURES], p.deflection_a_volt, p.deflection_a_pascal)
