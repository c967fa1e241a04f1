"""The whole circuit of Figures 1 and 2: two chambers, pump, accumulator, check valves, relief, throttles, seals.

Level 3, next to the reduced and the lumped plant. Oil is counted by mass, as its volume at atmospheric pressure, and
moves only between the chambers and the accumulator, so no scheme that conserves sums can lose any. Pressures follow
from the equation of state of `plant.components.oil`, and always exceed the vapour pressure.

Every flow has the density of its upstream side, the pump's that of its outlet, so that the steady state is that of
equations 5.7 and 5.8. Below atmospheric density at its inlet the pump fills only in proportion to that density.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.functions import Scalar, minimum, where
from plant.components.accumulator import gas_pressure
from plant.components.check_valve import make_up_flow
from plant.components.end_stop import end_stop_force
from plant.components.oil import ATMOSPHERE, oil_pressure
from plant.components.orifice import laminar_orifice_flow, orifice_constant
from plant.components.presliding import bristle_rate, presliding_friction
from plant.components.valves import pumped_flow, relief_flow
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.model import load_on_rod, piston_areas

CircuitValues: TypeAlias = CircuitParameters | SimpleNamespace
"""What the model reads: the parameters, or a namespace of the same names that holds expressions or arrays."""

CircuitState: TypeAlias = tuple[Scalar, Scalar, Scalar, Scalar, Scalar, Scalar, Scalar]

STATES = (
    "motor_speed_rad_s",
    "presliding",
    "position_m",
    "velocity_m_s",
    "oil_a_m3",
    "oil_b_m3",
    "oil_accumulator_m3",
)
"""The states; oil as its volume at atmospheric pressure, presliding as a fraction of the breakaway deflection."""


class Pressures(NamedTuple):
    """Absolute pressures.

    Parameters
    ----------
    a, b : float, ndarray or Expression
        In chambers A and B [Pa].
    supply : float, ndarray or Expression
        In the accumulator [Pa].
    """

    a: Scalar
    b: Scalar
    supply: Scalar


class OilFlows(NamedTuple):
    """Net flows of oil, as its volume at atmospheric pressure; they sum to zero.

    Parameters
    ----------
    a, b : float or Expression
        Into chambers A and B [m^3/s].
    supply : float or Expression
        Into the accumulator [m^3/s].
    """

    a: Scalar
    b: Scalar
    supply: Scalar


def chamber_volumes(position: Scalar, p: CircuitValues) -> tuple[Scalar, Scalar]:
    """Return the volumes of chambers A and B; in mid-stroke their mean is twice the lumped plant's (5.3, errata E2).

    Parameters
    ----------
    position : float, ndarray or Expression
        Piston position [m].
    p : CircuitParameters or namespace of Expression
        The circuit.

    Returns
    -------
    tuple of float, ndarray or Expression
        Volumes [m^3].
    """
    area_a, area_b = piston_areas(p)
    volume = 2.0 * p.chamber_volume
    return (
        volume * (1.0 + p.volume_difference) + area_a * position,
        volume * (1.0 - p.volume_difference) - area_b * position,
    )


def circuit_pressures(position: Scalar, oil: tuple[Scalar, Scalar, Scalar], p: CircuitValues) -> Pressures:
    """Return the pressures from the piston position and the oil in each volume.

    Parameters
    ----------
    position : float, ndarray or Expression
        Piston position [m].
    oil : tuple of float, ndarray or Expression
        Oil in chamber A, in chamber B and in the accumulator, as its volume at atmospheric pressure [m^3].
    p : CircuitParameters or namespace of Expression
        The circuit.

    Returns
    -------
    Pressures
        Absolute pressures [Pa].
    """
    volume_a, volume_b = chamber_volumes(position, p)
    oil_a, oil_b, held = oil
    return Pressures(
        oil_pressure(oil_a, volume_a, p.bulk_modulus, p.air_fraction, p.vapour_pressure),
        oil_pressure(oil_b, volume_b, p.bulk_modulus, p.air_fraction, p.vapour_pressure),
        gas_pressure(held, p.accumulator_oil, p.accumulator_pressure, p.accumulator_gas),
    )


def circuit_flows(speed: Scalar, densities: tuple[Scalar, Scalar], pressures: Pressures, p: CircuitValues) -> OilFlows:
    """Return the oil flows: equations 5.1 to 5.4 with errata E8 and E17, make-up, drain, relief and bypass.

    Parameters
    ----------
    speed : float or Expression
        Motor speed [rad/s].
    densities : tuple of float or Expression
        Oil divided by volume in chambers A and B [dimensionless].
    pressures : Pressures
        Absolute pressures [Pa].
    p : CircuitParameters or namespace of Expression
        The circuit.

    Returns
    -------
    OilFlows
        Net oil flow into each, as its volume at atmospheric pressure [m^3/s].
    """
    density_a, density_b = densities
    dp = pressures.a - pressures.b
    upstream = where(dp > 0.0, density_a, density_b)
    delivered = pumped_flow(speed, p.pump_displacement, p.flow_bias)
    outlet = where(delivered > 0.0, density_a, density_b)
    inlet = where(delivered > 0.0, density_b, density_a)
    pumped = delivered * outlet * minimum(inlet, 1.0)
    drain = p.pump_case_leakage + p.cylinder_drain_leakage
    inside = p.leakage_coefficient - p.pump_crossport_leakage - 0.5 * drain
    throttle = orifice_constant(p.throttle_rated_flow, p.throttle_rated_pressure)
    crossed = upstream * (
        laminar_orifice_flow(dp, inside, throttle)
        + (p.pump_crossport_leakage + p.bypass_conductance) * dp
        + relief_flow(dp, p.relief_pressure, p.relief_conductance)
    )
    # because of the drain's check valve, the case is at the accumulator's pressure or floats below it
    case = minimum(pressures.supply, 0.5 * (pressures.a + pressures.b))
    # a chamber below the case pressure takes in oil that the other one leaks, which has the upstream density
    drained_a = drain * (pressures.a - case) * where(pressures.a > case, density_a, upstream)
    drained_b = drain * (pressures.b - case) * where(pressures.b > case, density_b, upstream)
    made_up_a, made_up_b = (
        make_up_flow(chamber, other, pressures.supply, p.makeup_conductance, p.makeup_opening, p.pilot_share)
        for chamber, other in ((pressures.a, pressures.b), (pressures.b, pressures.a))
    )
    into_a = pumped - crossed - drained_a + made_up_a
    into_b = crossed - pumped - drained_b + made_up_b
    return OilFlows(into_a, into_b, drained_a + drained_b - made_up_a - made_up_b)


def circuit_derivative(state: CircuitState, command: Scalar, p: CircuitValues) -> CircuitState:
    """Return the rates of the circuit: flow balances 5.1 to 5.4, force balance 5.9, friction 5.10 with presliding.

    Parameters
    ----------
    state : tuple of float or Expression
        As named in `STATES`: motor speed [rad/s], presliding [dimensionless], position [m], velocity [m/s], and the
        oil in chamber A, chamber B and accumulator [m^3].
    command : float or Expression
        Commanded motor speed [rad/s].
    p : CircuitParameters or namespace of Expression
        The circuit.

    Returns
    -------
    tuple of float or Expression
        Rates of the states, each per second.
    """
    motor, bristle, x, v, oil_a, oil_b, held = state
    lagging = p.motor_lag > 0.0
    speed = where(lagging, motor, command)
    turning = (command - motor) / where(lagging, p.motor_lag, 1.0)
    pressures = circuit_pressures(x, (oil_a, oil_b, held), p)
    volume_a, volume_b = chamber_volumes(x, p)
    flows = circuit_flows(speed, (oil_a / volume_a, oil_b / volume_b), pressures, p)
    coefficients = p.friction_quadratic, p.friction_linear, p.friction_coulomb
    yielding = bristle_rate(v, bristle, p.friction_linear, p.friction_coulomb, p.presliding_displacement)
    friction = presliding_friction(
        v, bristle, yielding, coefficients, p.presliding_displacement, p.moving_mass, p.presliding_damping
    )
    stopped = end_stop_force(x, v, 0.5 * p.stroke, p.end_stop_stiffness, p.end_stop_damping)
    area_a, area_b = piston_areas(p)
    push = area_a * (pressures.a - ATMOSPHERE) - area_b * (pressures.b - ATMOSPHERE) - load_on_rod(x, p)
    return turning, yielding, v, (push - friction + stopped) / p.moving_mass, *flows


def observe_circuit(state: CircuitState, p: CircuitValues) -> Mapping[str, Scalar]:
    """Return the measurable channels, except motor speed.

    Parameters
    ----------
    state : tuple of float, ndarray of shape (n,), or Expression
        As named in `STATES` [SI].
    p : CircuitParameters or namespace of float, ndarray or Expression
        The circuit.

    Returns
    -------
    Mapping[str, float, ndarray or Expression]
        Position [m], velocity [m/s], and the pressures [Pa].
    """
    _, _, position, velocity, *oil = state
    pressures = circuit_pressures(position, (oil[0], oil[1], oil[2]), p)
    return {
        "position_m": position,
        "velocity_m_s": velocity,
        "differential_pressure_pa": pressures.a - pressures.b,
        "pressure_a_pa": pressures.a,
        "pressure_b_pa": pressures.b,
    }


def circuit_step_rate(p: SimpleNamespace) -> float:
    """Return the smallest number of steps per second at which the integrator follows the quadratic friction.

    A linearly-implicit step of ``M v' = F - a_1 v |v|`` overshoots through zero and grows once the step is several
    times ``M / (2 sqrt(a_1 F))``, for example if throttle B is almost shut. The relief valve bounds the force F
    (equations 5.9 and 5.10).

    Parameters
    ----------
    p : namespace of ndarray
        The circuit, each parameter of shape (1,) or (n,).

    Returns
    -------
    float
        Steps per second [1/s].
    """
    force = _FORCE_MARGIN * p.piston_area * p.relief_pressure
    damping = 2.0 * np.sqrt(p.friction_quadratic * force) / p.moving_mass
    return float(np.max(damping)) / _DAMPING_A_STEP


def circuit_scales(p: SimpleNamespace | CircuitParameters) -> NDArray[np.float64]:
    """Return the error scale of each state, for error-controlled solvers.

    The error in oil matters most: a small error in pressure makes a stuck piston oscillate on its seals.

    Parameters
    ----------
    p : CircuitParameters, or namespace of ndarray
        The circuit.

    Returns
    -------
    ndarray, shape (7,)
        As named in `STATES`, each in its SI unit: rated speed, the whole presliding, the piston's travel while oil is
        compressed up to the relief pressure, a third of its speed at rated flow, a sixtieth of the oil that a chamber
        takes up to that pressure. The fractions are judged by the error that remains for a given effort.

    Examples
    --------
    >>> circuit_scales(CircuitParameters())[[0, 3]].round(3).tolist()
    [125.664, 0.015]
    """
    rated = _RATED_VOLTS * p.motor_speed_per_volt
    squeezed = 2.0 * p.chamber_volume / p.bulk_modulus * p.relief_pressure
    sliding = p.pump_displacement * rated / p.piston_area
    oil = squeezed / 60.0
    sizes = rated, 1.0, squeezed / p.piston_area, sliding / 3.0, oil, oil, oil
    return np.array([size if isinstance(size, float) else float(np.mean(size)) for size in sizes])


_RATED_VOLTS = 4.0
"""Voltage of the rated speed in the paper's experiments [V]."""

_FORCE_MARGIN = 1.5
"""Largest force on the piston over the force at the relief setting: the valve's slope and a reversal raise it."""

_DAMPING_A_STEP = 1.5
"""Largest product of damping rate and step size for which the linearly-implicit step does not overshoot, found by
trial."""


def circuit_breaches(states: NDArray[np.float64]) -> Mapping[str, NDArray[np.bool_]]:
    """Return the samples at which a run is outside the model's validity, by reason.

    Parameters
    ----------
    states : ndarray, shape (n, 7)
        As named in `STATES`.

    Returns
    -------
    Mapping[str, ndarray]
        For each reason the samples at which it applies, shape (n,).
    """
    return {
        "a chamber ran out of oil": np.minimum(states[:, 4], states[:, 5]) <= 0.0,
        "the accumulator ran empty: accumulator_oil must be larger": states[:, 6] <= 0.0,
    }
