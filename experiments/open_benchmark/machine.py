"""The actuator that the open benchmark runs: what its equations in `oil`, `flows`, `friction` and `equations` need, SI.

These files share no model with `plant/` and `estimation/`: pressures are the states and densities follow, friction is a
row of spring-loaded blocks, check valves are orifices that crack open, and the motor has a current limit.
"""

from typing import NamedTuple

from plant.eha.model import EhaParameters
from plant.units import si

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

    displacement: float = si(5.57e-7, "m^3/rad", "pump displacement", "Table 2")
    efficiency: float = si(1.0, "1", "share of the displacement that a turn delivers", "judged")
    flow_bias: float = si(2.413e-6, "m^3/s", "flow bias Q_b, lost from what is delivered", "Table 3")
    teeth: float = si(12.0, "1", "teeth of the pump", "judged")
    ripple: float = si(0.01, "1", "amplitude of the teeth in the flow", "judged")
    motor_lag: float = si(4e-3, "s", "lag of the speed controller", "judged")
    acceleration: float = si(3e4, "rad/s^2", "at the current limit, unloaded", "judged")
    rotor_inertia: float = si(8e-4, "kg m^2", "of motor and pump", "judged")
    speed_limit: float = si(251.4, "rad/s", "highest speed asked for", "section 4")
    loop_gain: float = si(0.0, "rad/(s m)", "speed asked for a metre of position error; 0 is an open loop", "judged")
    area_a: float = si(1.52e-3, "m^2", "piston area that pushes forward", "Table 2")
    area_b: float = si(1.52e-3, "m^2", "piston area that pushes back", "Table 2")
    volume_a: float = si(2.16e-3, "m^3", "chamber A, piston in the middle", "Table 2, errata E2")
    volume_b: float = si(2.16e-3, "m^3", "chamber B, piston in the middle", "Table 2, errata E2")
    stroke: float = si(0.5, "m", "from stop to stop", "judged")
    stop_stiffness: float = si(2e7, "N/m", "of an end stop", "judged")
    stop_damping: float = si(2e4, "N s/m", "of an end stop", "judged")
    mass: float = si(7.376, "kg", "moving mass", "section 5")
    spring: float = si(0.0, "N/m", "load: towards the middle", "judged")
    load: float = si(0.0, "N", "load: against forward motion", "judged")
    leakage: float = si(4.784e-12, "m^3/(s Pa)", "lumped L_t: across, and half of the drain", "Table 3")
    turbulent: float = si(0.0, "1", "share of the leakage across that is turbulent at turbulent_pressure", "judged")
    turbulent_pressure: float = si(5e5, "Pa", "where the turbulent share is stated", "judged")
    drain: float = si(1e-13, "m^3/(s Pa)", "of each chamber to the case", "judged")
    relief: float = si(3.4475e6, "Pa", "difference of pressures that opens the relief valves", "sections 2, 3")
    relief_slope: float = si(1e-8, "m^3/(s Pa)", "relief flow a pascal above", "judged")
    supply: float = si(2.758e5, "Pa", "accumulator at the start, absolute", "section 2")
    supply_gas: float = si(2e-3, "m^3", "gas of the accumulator at the start", "judged")
    check_a: float = si(7e-7, "m^3/(s Pa^0.5)", "make-up of chamber A, as an orifice", "judged")
    check_b: float = si(7e-7, "m^3/(s Pa^0.5)", "make-up of chamber B", "judged")
    crack_a: float = si(1e4, "Pa", "drop that cracks the make-up valve of chamber A", "judged")
    crack_b: float = si(1e4, "Pa", "of chamber B", "judged")
    seat_leak_a: float = si(0.0, "m^3/(s Pa)", "past the shut make-up valve of chamber A", "judged")
    seat_leak_b: float = si(0.0, "m^3/(s Pa)", "of chamber B", "judged")
    pilot: float = si(0.0, "1", "how many pascals a pascal in the other chamber opens a make-up valve by", "judged")
    bulk_modulus: float = si(2.07e8, "Pa", "of the oil without free air, at atmospheric pressure", "section 7")
    stiffening: float = si(
        -1.0, "1", "slope of bulk modulus in pressure, not 0; -1: the secant modulus is constant", "judged"
    )
    polytropic: float = si(1.3, "1", "exponent of entrained air", "judged")
    vapour: float = si(2e3, "Pa", "vapour pressure, absolute", "judged")
    quadratic: float = si(6.589e4, "N s^2/m^2", "friction a_1", "Table 4")
    linear: float = si(2.144e3, "N s/m", "friction a_2", "Table 4")
    coulomb: float = si(436.0, "N", "friction a_3", "Table 4")
    presliding: float = si(3e-5, "m", "mean stretch at which the blocks slip", "judged")


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
