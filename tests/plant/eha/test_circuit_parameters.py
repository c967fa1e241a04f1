"""The circuit's parameters add up to the actuator's, and impossible ones are refused with a reason."""

from dataclasses import asdict, fields, replace

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from plant.eha.circuit_parameters import (
    CircuitParameters,
    circuit_of,
    circuit_values,
    longest_stroke,
    oil_demand,
)
from plant.eha.model import JUDGED_STROKE, EhaParameters
from plant.errors import RigError
from plant.solvers.steps import parameter_row
from plant.units import notes

PAPER = CircuitParameters()


def test_circuit_of_keeps_the_parameters_of_its_actuator() -> None:
    actuator = EhaParameters(bulk_modulus=1.5e8, piston_area=1.2e-3, leakage_coefficient=1e-12)
    circuit = circuit_of(actuator)
    judged = {"stroke": JUDGED_STROKE, "accumulator_gas": pytest.approx(1.38e-3)}
    assert {name: asdict(circuit)[name] for name in asdict(actuator)} == {**asdict(actuator), **judged}
    stated = circuit_of(replace(actuator, stroke=0.3, accumulator_gas=2e-4))
    assert (stated.stroke, stated.accumulator_gas) == (0.3, 2e-4)


def test_an_unknown_stroke_is_limited_by_the_chamber_volume() -> None:
    small = replace(EhaParameters(), chamber_volume=1e-4, piston_area=2e-3)
    assert circuit_of(small).stroke == longest_stroke(small) < circuit_of(EhaParameters()).stroke


def test_circuit_of_returns_a_circuit_unchanged() -> None:
    assert circuit_of(PAPER) is PAPER


@pytest.mark.parametrize("name", CONDITIONS)
def test_a_condition_of_a_circuit_equals_the_circuit_of_an_actuator_in_that_condition(name: str) -> None:
    changed = parameters_for(CONDITIONS[name], PAPER)
    assert isinstance(changed, CircuitParameters)
    assert circuit_of(parameters_for(CONDITIONS[name])) == changed


def test_the_parts_of_the_leakage_sum_to_the_lumped_one() -> None:
    drain = PAPER.pump_case_leakage + PAPER.cylinder_drain_leakage
    parts = PAPER.cylinder_leakage + PAPER.pump_crossport_leakage + 0.5 * drain
    assert parts == pytest.approx(PAPER.leakage_coefficient, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("leakage", [0.0, 1e-13, 4.784e-12, 1e-9])
@pytest.mark.parametrize("bulk_modulus", [2e7, 2.07e8, 1.6e9])
@pytest.mark.parametrize("volume", [3e-4, 1e-2])
def test_other_actuators_get_a_circuit_with_enough_oil_and_no_negative_leakage(
    leakage: float, bulk_modulus: float, volume: float
) -> None:
    actuator = EhaParameters(leakage_coefficient=leakage, bulk_modulus=bulk_modulus, chamber_volume=volume)
    circuit = circuit_of(actuator)
    assert circuit.cylinder_leakage >= 0.0
    assert circuit.accumulator_oil >= oil_demand(circuit)


def test_the_first_fields_are_the_actuators_in_order() -> None:
    names = [field.name for field in fields(EhaParameters)]
    assert [field.name for field in fields(CircuitParameters)][: len(names)] == names


def test_every_field_of_the_circuit_is_documented() -> None:
    assert list(notes(CircuitParameters)) == [field.name for field in fields(CircuitParameters)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"air_fraction": -0.1}, "air_fraction must not be negative, got -0.1"),
        ({"air_fraction": 0.6}, "air_fraction must be at most 0.5, got 0.6"),
        ({"motor_lag": float("nan")}, "motor_lag must be a finite number, got nan"),
        ({"presliding_displacement": 0.0}, "presliding_displacement must be positive, got 0.0"),
        ({"bypass_conductance": True}, "bypass_conductance must be a finite number, got True"),
        ({"pump_crossport_leakage": 1e-11}, "leakage_coefficient must cover"),
        ({"stroke": 6.0}, "stroke must leave room"),
        ({"friction_linear": -2e4}, "friction must oppose motion"),
        ({"vapour_pressure": 2e5}, "vapour_pressure must be below 101325 Pa"),
        ({"accumulator_oil": 1e-5}, "accumulator_oil must fill both chambers"),
        ({"bulk_modulus": 3e6}, "accumulator_oil must fill both chambers"),
        ({"bulk_modulus": -1.0}, "bulk_modulus must be positive"),
    ],
)
def test_impossible_circuit_parameters_are_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(RigError, match=message):
        replace(PAPER, **change)


@pytest.mark.parametrize("name", ["pump_case_leakage", "air_fraction", "motor_lag", "presliding_damping"])
def test_case_leakage_air_motor_lag_and_damping_may_be_zero(name: str) -> None:
    assert getattr(replace(PAPER, **{name: 0.0}), name) == 0.0


def test_air_increases_the_oil_demand_on_the_accumulator() -> None:
    demands = [oil_demand(replace(PAPER, air_fraction=air)) for air in (0.0, 0.05, 0.2)]
    assert np.all(np.diff(demands) > 0.0)


def test_circuit_values_gives_each_parameter_by_name_and_refuses_unknown_names() -> None:
    circuit = CircuitParameters()
    rows = np.stack([parameter_row(circuit), parameter_row(replace(circuit, flow_bias=1e-6))])
    values = circuit_values(rows)
    for place, field in enumerate(fields(circuit)):
        assert np.array_equal(getattr(values, field.name), rows[:, place], equal_nan=True)
    assert values.flow_bias.tolist() == [circuit.flow_bias, 1e-6]
    with pytest.raises(AttributeError, match="no parameter 'flow_bais'"):
        _ = values.flow_bais
