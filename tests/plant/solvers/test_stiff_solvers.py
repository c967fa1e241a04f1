"""Scipy's stiff solvers agree with each other, and the Jacobians that they are given are right."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.peers.stiff_solvers import Method, reference_trajectory
from plant.eha.circuit import circuit_derivative, circuit_scales
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import sine
from plant.eha.simulate import CIRCUIT
from plant.solvers.steps import parameter_row
from tests.plant.solvers.compiled_rates import rates_and_slopes

PAPER = CircuitParameters()
ROW = parameter_row(PAPER)
SCALES = circuit_scales(PAPER)
START = CIRCUIT.start(ROW)
DRIVE = sine(0.02, 1e-4, PAPER.rated_speed, 50.0)


@pytest.mark.parametrize("method", ["Radau", "BDF"])
def test_stiff_solvers_agree_with_lsoda(method: Method) -> None:
    one, other = (
        reference_trajectory(
            circuit_derivative, START, DRIVE, PAPER, 1e-4, scale=SCALES, relative_tolerance=1e-9, method=which
        )
        for which in ("LSODA", method)
    )
    assert np.max(np.abs(one - other) / SCALES) < 1e-5


def test_compiled_rates_equal_those_of_the_plain_function() -> None:
    state = START + np.array([50.0, 0.5, 1e-3, 0.02, 2e-6, -2e-6, 1e-6])
    rates, _ = rates_and_slopes(circuit_derivative, 7, CircuitParameters)
    plain = np.array(circuit_derivative(tuple(state), 60.0, PAPER), dtype=np.float64)  # type: ignore[arg-type]
    np.testing.assert_allclose(rates(state, 60.0, ROW), plain, rtol=1e-12)


def test_analytic_derivatives_equal_numerical_ones() -> None:
    state = START + np.array([50.0, 0.5, 1e-3, 0.02, 2e-6, -2e-6, 1e-6])
    rates, slopes = rates_and_slopes(circuit_derivative, 7, CircuitParameters)
    found = slopes(state, 60.0, ROW)
    for j in range(7):
        step = np.zeros(7)
        step[j] = 1e-5 * SCALES[j]
        numerical = (rates(state + step, 60.0, ROW) - rates(state - step, 60.0, ROW)) / (2.0 * step[j])
        np.testing.assert_allclose(found[:, j], numerical, rtol=1e-5, atol=1e-5 * float(np.max(np.abs(numerical))))


def test_a_solver_that_fails_raises_an_error() -> None:
    hopeless = replace(PAPER, end_stop_stiffness=1e40, stroke=1e-6)
    drive = np.full(200, PAPER.rated_speed)
    with np.errstate(all="ignore"), pytest.raises(RuntimeError, match="scipy's Radau stopped"):
        reference_trajectory(circuit_derivative, START, drive, hopeless, 1e-4, scale=SCALES, method="Radau")
