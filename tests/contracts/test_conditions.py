"""The contract of every condition of `CONDITIONS`, on which the layers above rely."""

from itertools import combinations

import numpy as np
import pytest

from faults.conditions import CONDITIONS, LEVELS, Condition, find_condition, parameters_for
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.eha.steady_state import steady_state

RIG = EhaParameters()
EVERY_CONDITION = pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)


def test_conditions_are_registered_under_their_names() -> None:
    assert [condition.name for condition in CONDITIONS.values()] == list(CONDITIONS)
    assert all(find_condition(name) is condition for name, condition in CONDITIONS.items())


def test_every_combination_of_leakage_and_friction_levels_is_a_condition() -> None:
    pairs = {(condition.leakage, condition.friction) for condition in CONDITIONS.values()}
    assert pairs == {(leakage, friction) for leakage in LEVELS for friction in LEVELS}


@EVERY_CONDITION
def test_a_condition_changes_only_leakage_and_friction_parameters(condition: Condition) -> None:
    changed = {name for name, value in vars(parameters_for(condition)).items() if value != getattr(RIG, name)}
    leaking = {"leakage_coefficient", "flow_bias"} if condition.leakage != "none" else set[str]()
    rubbing = {"friction_quadratic", "friction_linear", "friction_coulomb"} if condition.friction != "none" else set()
    assert changed == leaking | rubbing


@EVERY_CONDITION
def test_the_piston_still_moves_at_the_lowest_voltage_of_the_validation_steps(condition: Condition) -> None:
    p = parameters_for(condition)
    velocity, pressure = steady_state(2.5 * p.motor_speed_per_volt, p)
    assert velocity > 0.0
    assert pressure < p.relief_pressure


@EVERY_CONDITION
def test_the_simulated_plant_settles_at_the_steady_state_of_the_balances(condition: Condition) -> None:
    p = parameters_for(condition)
    speed = 3.0 * p.motor_speed_per_volt
    record = simulate(LUMPED, np.full(6_001, speed), 1e-3, p)
    velocity, pressure = steady_state(speed, p)
    assert record["velocity_m_s"][-1] == pytest.approx(velocity, rel=1e-4)
    assert record["differential_pressure_pa"][-1] == pytest.approx(pressure, rel=1e-4)


@pytest.mark.parametrize(("one", "other"), list(combinations(CONDITIONS, 2)))
def test_steady_states_of_any_two_conditions_differ_by_more_than_the_sensor_errors(one: str, other: str) -> None:
    a, b = (np.array(steady_state(100.0, parameters_for(CONDITIONS[name]))) for name in (one, other))
    assert np.any(np.abs(a - b) > [1e-3, 5e3])
