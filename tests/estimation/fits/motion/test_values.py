"""With an actuator's own values the motion form follows its log; with others it does not."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.motion.values import share_at
from plant.eha.circuit_parameters import circuit_of
from tests.estimation.fits.short_logs import PAPER, WORN, log

CIRCUIT = circuit_of(WORN)
VALUES = {
    "bulk_modulus": CIRCUIT.bulk_modulus,
    "leakage_coefficient": CIRCUIT.leakage_coefficient,
    "flow_bias": CIRCUIT.flow_bias,
    "makeup_conductance": CIRCUIT.makeup_conductance,
    "friction_quadratic": CIRCUIT.friction_quadratic,
    "friction_linear": CIRCUIT.friction_linear,
    "friction_coulomb": CIRCUIT.friction_coulomb,
    "case_leakage": CIRCUIT.pump_case_leakage,
    "bristle_stiffness": CIRCUIT.friction_coulomb / CIRCUIT.presliding_displacement,
}


def share(**others: float) -> float:
    return share_at(log().replace(differential_pressure_pa=None), PAPER, VALUES | others, 1e-4)


def test_the_actuators_own_values_leave_little_of_the_motion_unexplained() -> None:
    assert share() < 0.03


@pytest.mark.parametrize("name", ["leakage_coefficient", "friction_coulomb"])
def test_values_of_another_actuator_leave_several_times_as_much_unexplained(name: str) -> None:
    assert share(**{name: 4.0 * VALUES[name]}) > 3.0 * share()


def test_a_model_that_diverges_leaves_an_infinite_share_unexplained(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FreedProblem, "residuals_of", lambda *_: [np.array([[1.0, np.nan, np.inf]])])
    assert share() == np.inf


def test_rig_values_of_fitted_parameters_are_ignored() -> None:
    record = log().replace(differential_pressure_pa=None)
    other = replace(PAPER, leakage_coefficient=1e-10, friction_coulomb=1e4)
    assert share_at(record, other, VALUES, 1e-4) == pytest.approx(share())
