"""The actuator that the open benchmark simulates: parameters of `oil`, `flows`, `friction` and `equations`, SI.

These files share no model with `plant/` and `estimation/`: pressures are the states and determine the densities,
friction is a row of spring-loaded blocks, check valves are orifices that crack open, and the motor has a current limit.
"""

from typing import Annotated, NamedTuple

from plant.eha.model import EhaParameters
from plant.units import SI

ATMOSPHERE = 101325.0
"""Absolute pressure at which amounts of oil and air are measured [Pa]."""

PRELOAD = 2e3
"""Pressure drop below which an orifice is laminar [Pa]."""

LIFT = 2e4
"""Pressure range over which a check valve goes from cracked to fully open [Pa]."""


class Machine(NamedTuple):
    """One actuator, the paper's in the normal condition by default; chamber A drives it forward.

    Volumes are those of a chamber with the piston in the middle, twice the lumped plant's (errata E2).
    """

    displacement: Annotated[float, SI("m^3/rad", "pump displacement", "Table 2")] = 5.57e-7
    efficiency: Annotated[float, SI("1", "share of the displacement that a turn delivers", "judged")] = 1.0
    flow_bias: Annotated[float, SI("m^3/s", "flow bias Q_b, lost from what is delivered", "Table 3")] = 2.413e-6
    teeth: Annotated[float, SI("1", "teeth of the pump", "judged")] = 12.0
    ripple: Annotated[float, SI("1", "amplitude of the teeth in the flow", "judged")] = 0.01
    motor_lag: Annotated[float, SI("s", "lag of the speed controller", "judged")] = 4e-3
    acceleration: Annotated[float, SI("rad/s^2", "at the current limit, unloaded", "judged")] = 3e4
    rotor_inertia: Annotated[float, SI("kg m^2", "of motor and pump", "judged")] = 8e-4
    speed_limit: Annotated[float, SI("rad/s", "highest speed asked for", "section 4")] = 251.4
    loop_gain: Annotated[
        float, SI("rad/(s m)", "speed asked for a metre of position error; 0 is an open loop", "judged")
    ] = 0.0
    area_a: Annotated[float, SI("m^2", "piston area that pushes forward", "Table 2")] = 1.52e-3
    area_b: Annotated[float, SI("m^2", "piston area that pushes back", "Table 2")] = 1.52e-3
    volume_a: Annotated[float, SI("m^3", "chamber A, piston in the middle", "Table 2, errata E2")] = 2.16e-3
    volume_b: Annotated[float, SI("m^3", "chamber B, piston in the middle", "Table 2, errata E2")] = 2.16e-3
    stroke: Annotated[float, SI("m", "from stop to stop", "judged")] = 0.5
    stop_stiffness: Annotated[float, SI("N/m", "of an end stop", "judged")] = 2e7
    stop_damping: Annotated[float, SI("N s/m", "of an end stop", "judged")] = 2e4
    mass: Annotated[float, SI("kg", "moving mass", "section 5")] = 7.376
    spring: Annotated[float, SI("N/m", "load: towards the middle", "judged")] = 0.0
    load: Annotated[float, SI("N", "load: against forward motion", "judged")] = 0.0
    leakage: Annotated[float, SI("m^3/(s Pa)", "lumped L_t: across, and half of the drain", "Table 3")] = 4.784e-12
    turbulent: Annotated[
        float, SI("1", "share of the leakage across that is turbulent at turbulent_pressure", "judged")
    ] = 0.0
    turbulent_pressure: Annotated[float, SI("Pa", "where the turbulent share is stated", "judged")] = 5e5
    drain: Annotated[float, SI("m^3/(s Pa)", "of each chamber to the case", "judged")] = 1e-13
    relief: Annotated[float, SI("Pa", "difference of pressures that opens the relief valves", "sections 2, 3")] = (
        3.4475e6
    )
    relief_slope: Annotated[float, SI("m^3/(s Pa)", "relief flow a pascal above", "judged")] = 1e-8
    supply: Annotated[float, SI("Pa", "accumulator at the start, absolute", "section 2")] = 2.758e5
    supply_gas: Annotated[float, SI("m^3", "gas of the accumulator at the start", "judged")] = 2e-3
    check_a: Annotated[float, SI("m^3/(s Pa^0.5)", "make-up of chamber A, as an orifice", "judged")] = 7e-7
    check_b: Annotated[float, SI("m^3/(s Pa^0.5)", "make-up of chamber B", "judged")] = 7e-7
    crack_a: Annotated[float, SI("Pa", "drop that cracks the make-up valve of chamber A", "judged")] = 1e4
    crack_b: Annotated[float, SI("Pa", "of chamber B", "judged")] = 1e4
    seat_leak_a: Annotated[float, SI("m^3/(s Pa)", "past the shut make-up valve of chamber A", "judged")] = 0.0
    seat_leak_b: Annotated[float, SI("m^3/(s Pa)", "of chamber B", "judged")] = 0.0
    pilot: Annotated[
        float, SI("1", "how many pascals a pascal in the other chamber opens a make-up valve by", "judged")
    ] = 0.0
    bulk_modulus: Annotated[float, SI("Pa", "of the oil without free air, at atmospheric pressure", "section 7")] = (
        2.07e8
    )
    stiffening: Annotated[
        float, SI("1", "slope of bulk modulus in pressure, not 0; -1: the secant modulus is constant", "judged")
    ] = -1.0
    polytropic: Annotated[float, SI("1", "exponent of entrained air", "judged")] = 1.3
    vapour: Annotated[float, SI("Pa", "vapour pressure, absolute", "judged")] = 2e3
    quadratic: Annotated[float, SI("N s^2/m^2", "friction a_1", "Table 4")] = 6.589e4
    linear: Annotated[float, SI("N s/m", "friction a_2", "Table 4")] = 2.144e3
    coulomb: Annotated[float, SI("N", "friction a_3", "Table 4")] = 436.0
    presliding: Annotated[float, SI("m", "mean stretch at which the blocks slip", "judged")] = 3e-5


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
