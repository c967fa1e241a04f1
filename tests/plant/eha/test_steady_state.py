"""The states in which actuators settle, for one or for many at once."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from plant.eha.model import EhaParameters
from plant.eha.steady_state import steady_state

RIG = EhaParameters()
LEAKAGES = np.array([0.0, 4.8e-12, 6e-11, 4.8e-12, 0.0])
COULOMB = np.array([436.0, 436.0, 436.0, 6e3, 6e3])
"""Actuators with and without leakage; the last two have so much friction that the relief valve opens."""


def test_many_actuators_have_the_same_steady_states_as_each_alone() -> None:
    names = vars(SimpleNamespace(**{name: getattr(RIG, name) for name in RIG.__dataclass_fields__}))
    many = SimpleNamespace(**{**names, "leakage_coefficient": LEAKAGES, "friction_coulomb": COULOMB})
    alone = [
        steady_state(-60.0, replace(RIG, leakage_coefficient=leakage, friction_coulomb=coulomb))
        for leakage, coulomb in zip(LEAKAGES, COULOMB, strict=True)
    ]
    np.testing.assert_array_equal(np.array(steady_state(-60.0, many)).T, alone)


def test_flows_and_forces_balance_with_and_without_relief() -> None:
    for coulomb, opens in ((436.0, False), (6e3, True)):
        p = replace(RIG, friction_coulomb=coulomb)
        velocity, pressure = steady_state(p.rated_speed, p)
        relief = p.relief_conductance * max(0.0, pressure - p.relief_pressure)
        flow = p.pump_displacement * p.rated_speed - p.flow_bias - p.leakage_coefficient * pressure - relief
        rubbing = coulomb + p.friction_linear * velocity + p.friction_quadratic * velocity**2
        assert (relief > 0.0) is opens
        assert flow == pytest.approx(p.piston_area * velocity, rel=1e-9)
        assert pressure * p.piston_area == pytest.approx(rubbing, rel=1e-9) or velocity == 0.0


def test_a_stopped_pump_without_leakage_settles_at_rest() -> None:
    assert steady_state(0.0, replace(RIG, leakage_coefficient=0.0))[0] == 0.0
