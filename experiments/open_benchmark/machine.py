"""The actuator that the open benchmark runs: what its equations in `oil`, `flows`, `friction` and `run` need, SI.

These files share no model with `plant/` and `estimation/`: pressures are the states and densities follow, friction is a
row of spring-loaded blocks, check valves are orifices that crack open, and the motor has a current limit.
"""

from typing import NamedTuple

from plant.eha.model import EhaParameters

ATMOSPHERE = 101325.0
"""Absolute pressure at which oil and air are counted [Pa]."""

PRELOAD = 2e3
"""Pressure drop below which an orifice is laminar [Pa]."""

LIFT = 2e4
"""Pressure from where a check valve cracks to where it is wide open [Pa]."""


class Machine(NamedTuple):
    """One actuator, the paper's in the normal condition by default; chamber A drives it forward.

    Volumes are those of a chamber with the piston in the middle, twice the lumped plant's (errata E2).
    """

    displacement: float = 5.57e-7  # m^3/rad
    efficiency: float = 1.0  # share of the displacement that a turn delivers
    flow_bias: float = 2.413e-6  # lost from what is delivered [m^3/s]
    teeth: float = 12.0  # a turn
    ripple: float = 0.01  # amplitude, share of the flow
    motor_lag: float = 4e-3  # s
    acceleration: float = 3e4  # at the current limit, unloaded [rad/s^2]
    rotor_inertia: float = 8e-4  # kg m^2
    speed_limit: float = 251.4  # rad/s
    loop_gain: float = 0.0  # speed asked for a metre of position error; 0 is open loop [rad/(s m)]
    area_a: float = 1.52e-3  # m^2
    area_b: float = 1.52e-3
    volume_a: float = 2.16e-3  # m^3
    volume_b: float = 2.16e-3
    stroke: float = 0.5  # from stop to stop [m]
    stop_stiffness: float = 2e7  # N/m
    stop_damping: float = 2e4  # N s/m
    mass: float = 7.376  # kg
    spring: float = 0.0  # N/m
    load: float = 0.0  # against forward motion [N]
    leakage: float = 4.784e-12  # lumped L_t: across, and half of the drain [m^3/(s Pa)]
    turbulent: float = 0.0  # share of the leakage across that is turbulent at turbulent_pressure
    turbulent_pressure: float = 5e5  # Pa
    drain: float = 1e-13  # of each chamber to the case [m^3/(s Pa)]
    relief: float = 3.4475e6  # difference of pressures [Pa]
    relief_slope: float = 1e-8  # m^3/(s Pa)
    supply: float = 2.758e5  # accumulator, at the start, absolute [Pa]
    supply_gas: float = 2e-3  # m^3
    check_a: float = 7e-7  # m^3/(s Pa^0.5)
    check_b: float = 7e-7
    crack_a: float = 1e4  # Pa
    crack_b: float = 1e4
    seat_leak_a: float = 0.0  # past a check valve that is shut [m^3/(s Pa)]
    seat_leak_b: float = 0.0
    pilot: float = 0.0  # by how many pascals a pascal in the other chamber opens a check valve
    bulk_modulus: float = 2.07e8  # of the oil without free air, at atmospheric pressure [Pa]
    stiffening: float = -1.0  # slope of bulk modulus in pressure, not 0; -1: the secant modulus is constant
    polytropic: float = 1.3  # of entrained air
    vapour: float = 2e3  # Pa
    quadratic: float = 6.589e4  # N s^2/m^2
    linear: float = 2.144e3  # N s/m
    coulomb: float = 436.0  # N
    presliding: float = 3e-5  # mean stretch at which the blocks slip [m]


def machine_of(p: EhaParameters) -> Machine:
    """Return the machine of an actuator with equal chambers."""
    return Machine(
        displacement=p.pump_displacement,
        flow_bias=p.flow_bias,
        area_a=p.piston_area,
        area_b=p.piston_area,
        volume_a=2.0 * p.chamber_volume,
        volume_b=2.0 * p.chamber_volume,
        mass=p.moving_mass,
        leakage=p.leakage_coefficient,
        relief=p.relief_pressure,
        supply=p.accumulator_pressure,
        bulk_modulus=p.bulk_modulus,
        quadratic=p.friction_quadratic,
        linear=p.friction_linear,
        coulomb=p.friction_coulomb,
    )
