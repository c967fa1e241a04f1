"""The piezo-stack electro-hydrostatic actuator: stack, pump chamber, two reeds, three lines, accumulator, cylinder.

Equations 1 to 22 of the piezo-stack paper with errata P1 to P13 and P16. The states track the mass of oil in six
places, expressed as its volume at atmospheric pressure. Pressure follows from `plant.components.oil`, whose stiffness
is equation 5. Thus no mass is lost, and the accumulator can be shut (errata P16).
"""

from types import SimpleNamespace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.functions import Scalar, sqrt, where
from plant.components.end_stop import end_stop_force
from plant.components.gas_compliance import compliant_oil_pressure
from plant.components.line import line_flow_rate
from plant.components.oil import oil_pressure, specific_volume
from plant.components.piezo_stack import lagged_force_rate, stack_force
from plant.components.reed_valve import contact_force, reed_flow
from plant.piezo_stack.hysteresis import hysteresis_rate
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.solvers.steps import State, rate_driven_step

StackValues: TypeAlias = PiezoStackParameters | SimpleNamespace
"""What the model reads: the parameters, or a namespace with the same names that holds expressions or arrays."""

STATES = (
    "stack_displacement_m",
    "stack_velocity_m_s",
    "linear_force_n",
    "hysteresis_m",
    "oil_chamber_m3",
    "outlet_reed_m",
    "outlet_reed_velocity_m_s",
    "inlet_reed_m",
    "inlet_reed_velocity_m_s",
    "oil_delivery_port_m3",
    "delivery_flow_m3_s",
    "oil_high_side_m3",
    "position_m",
    "velocity_m_s",
    "oil_low_side_m3",
    "return_flow_m3_s",
    "oil_accumulator_m3",
    "intake_flow_m3_s",
    "oil_intake_port_m3",
)
"""The states; oil is given as its volume at atmospheric pressure."""

OIL = tuple(i for i, name in enumerate(STATES) if name.startswith("oil_"))
"""Indices of the states that hold oil: their sum is constant."""

SOFT_CONTACT = 1e-6
"""Penetration depth over which a seat's damping rises [m], a sixth of how far a closing reed presses in."""

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""

END_STIFFNESS, END_DAMPING = 1e7, 20.0
"""Stiffness and damping of the cylinder's end stops [N/m], [s/m]; no run that counts reaches them."""


class StackPressures(NamedTuple):
    """Absolute pressures at the six places that hold oil.

    Parameters
    ----------
    chamber : float, ndarray or Expression
        Pump chamber, p_c [Pa].
    delivery : float, ndarray or Expression
        Pressure between outlet reed and delivery line, p_th [Pa].
    high, low : float, ndarray or Expression
        Pressures on the cylinder's two sides, p_ch and p_cl [Pa].
    accumulator : float, ndarray or Expression
        Pressure at the accumulator's port [Pa].
    intake : float, ndarray or Expression
        Pressure between intake line and inlet reed, p_tl [Pa].
    """

    chamber: Scalar
    delivery: Scalar
    high: Scalar
    low: Scalar
    accumulator: Scalar
    intake: Scalar


def volumes(displacement: Scalar, position: Scalar, p: StackValues) -> tuple[Scalar, Scalar, Scalar]:
    """Return the volumes of pump chamber, high side and low side: equation 8 with errata P6, 18 with errata P11.

    Parameters
    ----------
    displacement : float, ndarray or Expression
        Displacement of the pump's piston, x_p [m].
    position : float, ndarray or Expression
        Position of the cylinder's rod, from its start [m].

    Returns
    -------
    tuple of float, ndarray or Expression
        Volumes [m^3].
    """
    chamber = p.piston_area * (p.chamber_height - displacement) + p.dead_volume
    high = p.cylinder_area * (p.cylinder_start + position)
    low = p.cylinder_area * (p.cylinder_length - p.cylinder_start - position)
    return chamber, high, low


def stack_pressures(state: State, p: StackValues) -> StackPressures:
    """Return the pressures from the oil masses and piston positions: equation 5 with errata P4, P5 and P16.

    Parameters
    ----------
    state : tuple of float, ndarray or Expression
        As named in `STATES`, in SI.

    Returns
    -------
    StackPressures
        Absolute pressures [Pa].
    """
    oil = p.bulk_modulus, p.air_fraction, p.vapour_pressure
    chamber, high, low = volumes(state[0], state[12], p)
    compliance = p.accumulator_gas / (p.gas_exponent * p.bias_pressure)
    return StackPressures(
        oil_pressure(state[4], chamber, *oil),
        oil_pressure(state[9], p.port_volume, *oil),
        oil_pressure(state[11], high, *oil),
        oil_pressure(state[14], low, *oil),
        compliant_oil_pressure(state[16], p.accumulator_volume, compliance, p.bias_pressure, oil),
        oil_pressure(state[18], p.port_volume, *oil),
    )


def _reed_acceleration(
    drop: Scalar, opening: Scalar, velocity: Scalar, stiffness: Scalar, gap: Scalar, p: StackValues
) -> Scalar:
    """Equation 13 with seat and stop, errata P7."""
    depth = gap - opening
    seat = contact_force(depth, -velocity, p.seat_stiffness, p.seat_damping, SOFT_CONTACT)
    stop = contact_force(opening - p.reed_lift, velocity, p.seat_stiffness, p.seat_damping, SOFT_CONTACT)
    push = p.reed_area * drop - p.reed_damping * velocity - stiffness * opening
    return (push + seat - stop) / p.reed_mass


def _oil_flows(state: State, pressure: StackPressures, p: StackValues) -> State:
    """Return the oil flows through outlet reed, inlet reed, delivery, return and intake line, and both leaks.

    Each flow has the density of its upstream side.
    """
    x, _, _, _, n_c, x_out, _, x_in, _, n_th, q_h, n_ch, position, _, n_cl, q_1, _, q_2, n_tl = state
    chamber, high, low = volumes(x, position, p)
    filled = n_c / chamber
    density_th, density_tl = n_th / p.port_volume, n_tl / p.port_volume
    density_high, density_low = n_ch / high, n_cl / low
    density_acc = 1.0 / specific_volume(pressure.accumulator, p.bulk_modulus, p.air_fraction, p.vapour_pressure)

    lost = p.chamber_leakage * (pressure.chamber - pressure.accumulator)
    crossed = p.crossport_leakage * (pressure.high - pressure.low)

    def past_reed(drop: Scalar, opening: Scalar, before: Scalar, behind: Scalar) -> Scalar:
        reed = p.reed_perimeter, p.discharge_coefficient, p.density, p.laminar_drop
        return reed_flow(drop, opening, *reed) * where(drop > 0.0, before, behind)

    return (
        past_reed(pressure.chamber - pressure.delivery, x_out, filled, density_th),
        past_reed(pressure.intake - pressure.chamber, x_in, density_tl, filled),
        q_h * where(q_h > 0.0, density_th, density_high),
        q_1 * where(q_1 > 0.0, density_low, density_acc),
        q_2 * where(q_2 > 0.0, density_acc, density_tl),
        lost * where(lost > 0.0, filled, density_acc),
        crossed * where(crossed > 0.0, density_high, density_low),
    )


def _rod_acceleration(pressure: StackPressures, position: Scalar, speed: Scalar, p: StackValues) -> Scalar:
    """Equation 22 with errata P13."""
    lifted = p.carriage_mass + p.load_mass
    smoothed = sqrt(speed * speed + p.friction_speed * p.friction_speed)
    friction = p.viscous_friction * speed + p.coulomb_friction * speed / smoothed
    middle, reach = 0.5 * p.cylinder_length - p.cylinder_start, 0.5 * p.cylinder_length - p.end_clearance
    stopped = end_stop_force(position - middle, speed, reach, END_STIFFNESS, END_DAMPING)
    return ((pressure.high - pressure.low) * p.cylinder_area - friction - lifted * GRAVITY + stopped) / lifted


def stack_derivative(state: State, voltage: Scalar, rate: Scalar, p: StackValues) -> State:
    """Return the rates of the actuator: equations 1 to 3, 8, 11, 13 to 15, 17 to 22 with errata P1 to P13 and P16.

    Parameters
    ----------
    state : tuple of float or Expression
        As named in `STATES`, in SI.
    voltage : float or Expression
        Drive u [V].
    rate : float or Expression
        Rate of the drive [V/s].

    Returns
    -------
    tuple of float or Expression
        Rates of the states, per second.
    """
    x, v, driven, h, _, x_out, v_out, x_in, v_in, _, q_h, _, position, speed, _, q_1, _, q_2, _ = state
    pressure = stack_pressures(state, p)
    out, into, delivered, returned, drawn, lost, crossed = _oil_flows(state, pressure, p)
    pushed = stack_force(driven, h, x, v, p.stack_stiffness, p.stack_damping)
    held = p.head_stiffness * x + p.head_damping * v + pressure.chamber * p.piston_area
    out_drop, in_drop = pressure.chamber - pressure.delivery, pressure.intake - pressure.chamber

    def along_line(drop: Scalar, flow: Scalar, length: Scalar) -> Scalar:
        return line_flow_rate(drop, flow, length, p.line_area, p.density, p.viscosity, p.minor_losses)

    return (
        v,
        (pushed - held) / (p.stack_mass + p.head_mass),
        lagged_force_rate(driven, voltage, p.free_stroke_a_volt * p.stack_stiffness, p.stack_lag),
        hysteresis_rate(rate, h, p),
        into - out - lost,
        v_out,
        _reed_acceleration(out_drop, x_out, v_out, p.outlet_reed_stiffness, p.outlet_reed_gap, p),
        v_in,
        _reed_acceleration(in_drop, x_in, v_in, p.inlet_reed_stiffness, p.inlet_reed_gap, p),
        out - delivered,
        along_line(pressure.delivery - pressure.high, q_h, p.delivery_length),
        delivered - crossed,
        speed,
        _rod_acceleration(pressure, position, speed, p),
        crossed - returned,
        along_line(pressure.low - pressure.accumulator, q_1, p.return_length),
        returned - drawn + lost,
        along_line(pressure.accumulator - pressure.intake, q_2, p.intake_length),
        drawn - into,
    )


stack_step = rate_driven_step(stack_derivative)
"""The state after a classical Runge-Kutta step of `stack_derivative`, equations 1 to 22, with a linear drive."""


def at_bias(p: StackValues, voltage: float = 0.0) -> NDArray[np.float64]:
    """Return the state at rest at the bias pressure, which compresses the stack (equation 3, errata P3).

    Parameters
    ----------
    voltage : float
        Initial drive [V]; the stack has settled to it, without hysteresis.

    Returns
    -------
    ndarray, shape (19,)
        As named in `STATES`, in SI.

    Examples
    --------
    >>> round(1e6 * float(at_bias(PiezoStackParameters())[0]), 2)
    -17.61
    """
    driven = p.free_stroke_a_volt * p.stack_stiffness * voltage
    x = (driven - p.bias_pressure * p.piston_area) / (p.stack_stiffness + p.head_stiffness)
    chamber, high, low = volumes(x, 0.0, p)
    density = 1.0 / specific_volume(p.bias_pressure, p.bulk_modulus, p.air_fraction, p.vapour_pressure)
    state = np.zeros(len(STATES))
    state[0], state[2] = x, driven
    state[list(OIL)] = density * np.array([chamber, p.port_volume, high, low, p.accumulator_volume, p.port_volume])
    return state
