"""Throttle voltages give the conditions of Table 1, and a physical fault changes only what it should."""

from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from faults.conditions import CONDITIONS, LEVELS, Condition, parameters_for
from faults.eha.inject import growing_fault
from faults.eha.physical import VOLTS_A, VOLTS_B, aerated, with_drifted_relief, with_throttles
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.errors import HydrostateError, RigError

PAPER = CircuitParameters()
VOLTS = st.floats(0.0, 10.0)


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_throttle_voltages_of_table_1_give_the_parameters_of_tables_3_and_4(condition: Condition) -> None:
    volts = VOLTS_A[LEVELS.index(condition.leakage)], VOLTS_B[LEVELS.index(condition.friction)]
    made, wanted = asdict(with_throttles(PAPER, *volts)), asdict(parameters_for(condition, PAPER))
    for name, value in wanted.items():
        assert made[name] == pytest.approx(value, rel=1e-12, abs=0.0), name


@given(VOLTS, VOLTS)
def test_opening_throttle_a_never_reduces_leakage(one: float, other: float) -> None:
    shut, opened = (with_throttles(PAPER, volts, 0.0) for volts in sorted((one, other), reverse=True))
    assert shut.leakage_coefficient <= opened.leakage_coefficient
    assert shut.flow_bias <= opened.flow_bias


@given(VOLTS, VOLTS)
def test_closing_throttle_b_never_reduces_friction(one: float, other: float) -> None:
    opened, shut = (with_throttles(PAPER, 10.0, volts) for volts in sorted((one, other)))
    assert opened.friction_quadratic <= shut.friction_quadratic


@given(VOLTS, VOLTS)
def test_friction_opposes_motion_at_every_voltage(a_volts: float, b_volts: float) -> None:
    p = with_throttles(PAPER, a_volts, b_volts)
    falling = max(-p.friction_linear, 0.0)
    assert falling**2 <= p.friction_quadratic * p.friction_coulomb


@pytest.mark.parametrize("volts", [-0.1, 10.1, float("nan")])
def test_a_voltage_out_of_range_is_refused(volts: float) -> None:
    with pytest.raises(RigError, match="throttle A takes 0 to 10 V"):
        with_throttles(PAPER, volts, 0.0)
    with pytest.raises(RigError, match="throttle B takes 0 to 10 V"):
        with_throttles(PAPER, 10.0, volts)


def test_a_relief_valve_that_drifts_down_opens_early() -> None:
    p = with_drifted_relief(with_throttles(PAPER, 10.0, 3.0), 0.5)
    record = simulate(CIRCUIT, np.full(8_000, p.rated_speed), 1e-4, p)
    assert record["differential_pressure_pa"][-1] == pytest.approx(0.5 * PAPER.relief_pressure, rel=0.02)


def test_air_that_comes_in_slowly_slows_the_build_up_of_pressure() -> None:
    drive = np.where(np.arange(40_000) // 1_000 % 2 == 0, 1.0, -1.0) * PAPER.rated_speed
    record = simulate(CIRCUIT, drive, 1e-4, growing_fault(PAPER, aerated(PAPER, 0.1), 0.5, 3.5))
    swing = np.abs(record["differential_pressure_pa"]).reshape(40, 1_000)[:, 60]
    assert np.mean(swing[-5:]) < 0.8 * np.mean(swing[2:5])


def test_faults_out_of_range_are_refused() -> None:
    with pytest.raises(HydrostateError, match="air fraction must be between 0 and"):
        aerated(PAPER, 0.7)
    with pytest.raises(HydrostateError, match="relief factor must be positive"):
        with_drifted_relief(PAPER, 0.0)
