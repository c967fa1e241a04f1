"""The filter that processes a log again: correct for a linear model, and not more certain than the log allows."""

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem
from estimation.engine.linearised import compile_step
from estimation.filters.ekf import ekf
from estimation.filters.relinearised import relinearised
from estimation.filters.run import filter_problem
from estimation.models.chambers import CHAMBERS, CHAMBERS_BY_MASS, chamber_belief
from estimation.models.eha_forms import BULK_MODULUS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_row

RIG = EhaParameters()


@pytest.fixture(scope="module")
def task() -> FilterProblem:
    p, rng = CircuitParameters(), np.random.default_rng(3)
    record = simulate(CIRCUIT, make_drive("steps", 4.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    prior = chamber_belief(RIG, 0.0, 0.6 * RIG.bulk_modulus, 4.0, 2.0, 1e-9)
    return filter_problem(CHAMBERS_BY_MASS, prior, record, RIG)


def test_linearising_again_raises_the_likelihood_and_reduces_the_error_of_bulk_modulus(task: FilterProblem) -> None:
    first, place = ekf(task), CHAMBERS.index(BULK_MODULUS)
    again = relinearised(task, first.mean, first.covariance)
    truth = np.log(RIG.bulk_modulus / 1e8)
    assert again.log_likelihood > first.log_likelihood
    assert abs(again.mean[place] - truth) < abs(first.mean[place] - truth)
    assert abs(again.mean[place] - truth) < 3.0 * again.covariance[place, place] ** 0.5


@pytest.mark.parametrize("model", [CHAMBERS, CHAMBERS_BY_MASS], ids=lambda model: model.name)
def test_chambers_at_rest_stay_at_rest(model: ProcessModel) -> None:
    p = RIG
    constants = (2.07e8, 5e-12, 2.4e-6, 1e-9, 1e3, 0.0, 1e-5, p.relief_pressure, p.relief_conductance)
    state = np.array([p.accumulator_pressure, p.accumulator_pressure, *constants])
    scaled = model.to_filter(Gaussian(state, np.zeros((len(state), len(state))))).mean
    drives = np.array([0.0, 0.01])
    moved, _ = compile_step(model).step(scaled, drives, drives, parameter_row(p, model.parameters), 1e-3)
    np.testing.assert_allclose(moved, scaled, rtol=1e-12)
