"""Values of the components' laws on both sides of every corner, kept in `numbers.json`."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from plant.components.accumulator import gas_pressure
from plant.components.bouc_wen import asymmetric_bouc_wen_rate, bouc_wen_rate, power_bouc_wen_rate
from plant.components.check_valve import check_valve_flow, make_up_flow
from plant.components.diaphragm import centre_deflection, chamber_compliance
from plant.components.directional_valve import fed_pressure, pressure_after_return, return_flow, tank_openings
from plant.components.end_stop import end_stop_force
from plant.components.flap_valve import late_share, opening_target, orifice_drag, port_flow_after
from plant.components.friction import quadratic_friction, sliding, velocity_under_friction
from plant.components.gas_compliance import compliant_oil_pressure
from plant.components.line import line_flow_rate, reynolds_number
from plant.components.oil import effective_bulk_modulus, oil_pressure, specific_volume
from plant.components.orifice import effective_area, laminar_orifice_flow, orifice_constant, orifice_friction
from plant.components.piezo_stack import lagged_force_rate, stack_force
from plant.components.piezoelectricity import (
    PoledCeramic,
    charge_matrix,
    compliance_matrix,
    electric_displacement,
    strain,
)
from plant.components.presliding import bristle_rate, presliding_friction
from plant.components.reed_valve import contact_force, reed_flow
from plant.components.valves import pumped_flow, relief_flow
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)


def each(law: Callable[..., Any], arguments: Mapping[str, tuple[Any, ...]]) -> dict[str, Any]:
    """Call a law with several sets of arguments, each named after its special feature."""
    return {name: law(*some) for name, some in arguments.items()}


@NUMBERS.case()
def flows_of_check_and_make_up_valves() -> dict[str, Any]:
    pressures = {"low chamber": (1e5, 3e6), "high chamber": (3e6, 1e5), "both full": (1e6, 9e5), "both low": (1e5, 9e4)}
    made_up = {name: (*pair, 2.8e5, 1e-9, 7e3, 0.3) for name, pair in pressures.items()}
    return {
        "check valve [m^3/s]": each(
            check_valve_flow, {"just open": (50.0, 1e-9, 7e3), "wide open": (3e5, 1e-9, 7e3), "shut": (-1.0, 1e-9, 7e3)}
        ),
        "make-up [m^3/s]": each(make_up_flow, made_up),
        "relief [m^3/s]": each(
            relief_flow, {"shut": (2e6, 3e6, 1e-8), "open": (4e6, 3e6, 1e-8), "open the other way": (-5e6, 3e6, 1e-8)}
        ),
        "pump [m^3/s]": each(
            pumped_flow,
            {"dead zone": (3.0, 5.6e-7, 2.4e-6), "forward": (90.0, 5.6e-7, 2.4e-6), "back": (-60.0, 5.6e-7, 2e-6)},
        ),
    }


@NUMBERS.case()
def flows_of_orifices_reeds_and_lines() -> dict[str, Any]:
    return {
        "laminar orifice [m^3/s]": each(
            laminar_orifice_flow,
            {"leak": (1e4, 2e-12, 4e-6), "throttle": (3e6, 4e-9, 4e-7), "back": (-2e6, 4e-9, 4e-7)},
        ),
        "constant of an orifice [m^3/(s Pa^0.5)]": orifice_constant(2.57e-3, 344750.0),
        "friction of an orifice [N s^2/m^2]": orifice_friction(850.0, 1.5e-3, 3e-5),
        "area of an orifice by its friction [m^2]": effective_area(850.0, 1.5e-3, 5.5e4),
        "reed [m^3/s]": each(
            reed_flow,
            {
                "forward": (2e5, 1e-4, 0.03, 0.6, 850.0, 500.0),
                "back": (-3e2, 5e-5, 0.03, 0.6, 850.0, 500.0),
                "pressed into its seat": (2e5, -1e-6, 0.03, 0.6, 850.0, 500.0),
            },
        ),
        "contact [N]": each(
            contact_force,
            {
                "apart": (-1e-6, 0.1, 1e5, 20.0, 1e-6),
                "closing": (3e-6, 0.1, 1e5, 20.0, 1e-6),
                "leaving": (1e-6, -0.1, 1e5, 20.0, 1e-6),
            },
        ),
        "rate of flow in a line [m^3/s^2]": each(
            line_flow_rate,
            {"forward": (3e4, 2e-5, 0.5, 3e-5, 850.0, 0.03, 1.5), "back": (3e4, -4e-5, 0.2, 5e-5, 870.0, 0.02, 2.5)},
        ),
        "Reynolds number": each(
            reynolds_number, {"forward": (2e-5, 3e-5, 850.0, 0.03), "back": (-5e-5, 3e-5, 850.0, 0.01)}
        ),
    }


@NUMBERS.case()
def state_of_oil_and_gas() -> dict[str, Any]:
    amounts = {"pressed": 1.003, "slack": 0.98, "at rest": 1.0}
    return {
        "oil pressure [Pa]": {
            name: [oil_pressure(amount, 1.0, 1.2e9, air, 2e3) for air in (0.0, 0.01)]
            for name, amount in amounts.items()
        },
        "specific volume": [
            specific_volume(pressure, 1.2e9, air, 2e3) for pressure in (5e4, 8e6) for air in (0.0, 0.02)
        ],
        "effective bulk modulus [Pa]": [
            effective_bulk_modulus(pressure, 1.2e9, air, 2e3) for pressure in (5e4, 8e6) for air in (0.0, 0.02)
        ],
        "oil beside a gas bag [Pa]": {
            name: [
                compliant_oil_pressure(amount * 1e-5, 1e-5, soft, 1e6, (1.2e9, air, 2e3))
                for soft in (0.0, 2e-11)
                for air in (0.0, 0.01)
            ]
            for name, amount in amounts.items()
        },
        "accumulator [Pa]": [gas_pressure(amount, 1e-3, 2.8e5, 2e-3) for amount in (0.4e-3, 1e-3, 2.2e-3)],
    }


@NUMBERS.case()
def friction_and_ends() -> dict[str, Any]:
    pushes = {"held": 30.0, "just held": -40.0, "forward": 100.0, "back": -300.0}
    bristles = ((0.02, 0.3), (-0.05, 0.8), (0.02, -0.9))
    laws = {"rising": (6e4, 2e3, 400.0), "falling": (6e4, -3e3, 400.0), "no Coulomb friction": (6e4, 2e3, 0.0)}
    return {
        "quadratic friction [N]": each(
            quadratic_friction, {"forward": (0.04, 1.0, 6e4, 2e3, 400.0), "back": (-0.03, -1.0, 6e4, 2e3, 400.0)}
        ),
        "velocity under friction [m/s]": {n: velocity_under_friction(p, 800.0, 6e4, 40.0) for n, p in pushes.items()},
        "velocity and root where nothing is quadratic": list(sliding(90.0, 500.0, 0.0, 40.0)),
        "rate of a bristle [1/s]": {
            name: [bristle_rate(v, z, linear, coulomb, 2e-5) for v, z in bristles]
            for name, (_, linear, coulomb) in laws.items()
        },
        "presliding friction [N]": {
            name: [presliding_friction(v, z, 700.0, law, 2e-5, 7.4, 0.2) for v, z in bristles]
            for name, law in laws.items()
        },
        "end of the stroke [N]": each(
            end_stop_force,
            {
                "within": (0.1, 0.2, 0.125, 1e8, 20.0),
                "driving in": (0.1252, 0.03, 0.125, 1e8, 20.0),
                "at the other end": (-0.1253, -0.02, 0.125, 1e8, 20.0),
                "leaving": (0.1251, -0.1, 0.125, 1e8, 20.0),
            },
        ),
    }


@NUMBERS.case()
def diaphragms_and_their_valves() -> dict[str, Any]:
    drops = {"shut": 100.0, "opening": 500.0, "wide open": 1e4}
    return {
        "compliance of a chamber [m^3/Pa]": [
            chamber_compliance(p, 1.2e-13, 3e-16, gas, 1.2, 1.5e5) for p in (5e4, 4e5) for gas in (0.0, 3e-10)
        ],
        "deflection of a centre [m]": centre_deflection(-70.0, 2e4, 8.4e-8, 5.2e-10),
        "pressure that the pump works against [Pa]": [fed_pressure(spool, 5e4, 1e4) for spool in (1.0, 0.0, -1.0)],
        "openings to tank": [list(tank_openings(spool)) for spool in (1.0, 0.0, -1.0)],
        "flow to tank [m^3/s]": [return_flow(pressure, 3e-8) for pressure in (2e3, -5e3, 0.0)],
        "pressure after a step [Pa]": [
            pressure_after_return(pressure, inflow, 4e-13, 3e-8, 1e-5)
            for pressure, inflow in ((2e4, 1e-6), (1e3, -3e-6))
        ],
        "opening that a flap seeks": {n: opening_target(drop, 0.01, 0.9, 200.0, 600.0) for n, drop in drops.items()},
        "drag of a flap [Pa s^2/m^6]": [orifice_drag(opening, 1.9e-6, 0.65, 998.0) for opening in (0.01, 0.8)],
        "flow through a port after a step [m^3/s]": [
            port_flow_after(flow, drop, 3e14, 6e8, 2.5e6, h)
            for flow, drop, h in ((2e-6, 3e3, 1e-5), (-3e-6, 5e2, 1e-3))
        ],
        "share that is late": [late_share(decay) for decay in (1e-3, 1.0, 50.0)],
    }


@NUMBERS.case()
def hysteresis_and_piezoelectricity() -> dict[str, Any]:
    signs = [(s * rate, t * h) for s, rate in ((1, 90.0), (-1, 60.0)) for t, h in ((1, 1e-6), (-1, 2e-6))]
    ceramic = PoledCeramic()
    stress, field = 1e6 * np.array([1.0, -2.0, 3.0, 0.5, -0.7, 1.3]), 1e5 * np.array([0.3, -0.4, 2.0])
    return {
        "stack's law on four signs [m/s]": [
            asymmetric_bouc_wen_rate(rate, h, 6e-8, 0.02, 0.003, -0.002, -0.004) for rate, h in signs
        ],
        "classical law on four signs [N/s]": [
            bouc_wen_rate(1e-4 * rate, 1e7 * h, 5e4, 1e3, 0.8, -1.1) for rate, h in signs
        ],
        "law with an exponent [V/s]": [
            power_bouc_wen_rate(rate, 1e7 * h, 0.3, 0.006, 0.002, n) for rate, h in signs for n in (1.0, 1.7)
        ],
        "law with an exponent and nothing to yield [V/s]": power_bouc_wen_rate(50.0, 0.0, 0.3, 0.006, 0.002, 1.5),
        "lagged force [N/s]": lagged_force_rate(300.0, 20.0, 49.0, 1e-4),
        "force of a stack [N]": stack_force(2000.0, 1e-6, 8e-6, -0.02, 1.48e8, 300.0),
        "compliance of the ceramic [1/Pa]": compliance_matrix(ceramic),
        "charges of the ceramic [m/V]": charge_matrix(ceramic),
        "strain": strain(stress, field, ceramic),
        "electric displacement [C/m^2]": electric_displacement(stress, field, ceramic),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
