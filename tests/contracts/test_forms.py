"""The contract of every process model of `FORMS` and every filter of `METHODS`."""

from functools import cache

import numpy as np
import pytest

from estimation.engine.contract import Method
from estimation.engine.linearised import compile_step
from estimation.filters.methods import METHODS
from estimation.filters.run import Estimate, run_filter
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import BULK_MODULUS, FORMS
from estimation.models.model import ProcessModel
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import CHANNELS, Record
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_row
from tests.thinned import thinned

EVERY_FORM = pytest.mark.parametrize("model", FORMS.values(), ids=FORMS)
EVERY_METHOD = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
WITHOUT_CHANCE = pytest.mark.parametrize(  # test_particle tests what particles do instead
    "method",
    [method for name, method in METHODS.items() if name != "particle"],
    ids=[n for n in METHODS if n != "particle"],
)
ROUNDING = {METHODS["imm"]: 1e-9}
"""Tolerance of a log-likelihood that should be zero [dimensionless]: a bank's probabilities sum to one except for
rounding."""
RIG = EhaParameters()


@cache
def bench_log(parameters: EhaParameters = RIG, duration: float = 0.1) -> Record:
    """Return a log of 1000 samples, one whole period, or of a part of it."""
    drive = sine(duration, 1e-4, parameters.rated_speed, 10.0)
    return simulate(LUMPED, drive, 1e-4, parameters, sensors=BENCH, rng=np.random.default_rng(0))


def filtered(method: Method, model: ProcessModel, record: Record, parameters: EhaParameters = RIG) -> Estimate:
    return run_filter(method, model, first_belief(model, record, 2e8, 3e8), record, parameters)


def test_forms_are_registered_under_their_names() -> None:
    assert [model.name for model in FORMS.values()] == list(FORMS)


@EVERY_FORM
def test_every_state_has_a_unique_name_a_unit_a_scale_and_bounds(model: ProcessModel) -> None:
    assert len({state.name for state in model.states}) == model.width
    for state in model.states:
        assert state.scale > 0.0
        assert state.noise_density >= 0.0
        assert state.lower < state.upper
        assert CHANNELS.get(state.name, state.unit) == state.unit


@EVERY_FORM
def test_a_step_of_the_model_keeps_bulk_modulus_constant_and_its_bounds_are_physical(model: ProcessModel) -> None:
    state = model.states[model.index(BULK_MODULUS)]
    assert state.lower == 0.0
    assert state.upper > 2.07e9
    values = np.array([0.1 * variable.scale for variable in model.states])
    moved = model.step(tuple(values), (10.0, 12.0), RIG, 1e-4)
    assert moved[model.index(BULK_MODULUS)] == values[model.index(BULK_MODULUS)]


@EVERY_FORM
def test_predicted_channels_are_linear_in_the_state(model: ProcessModel) -> None:
    rng = np.random.default_rng(1)
    scale = np.array([state.scale for state in model.states])
    a, b = scale * rng.normal(size=(2, model.width))
    at_a, at_b, at_sum = (model.observe(tuple(state), RIG) for state in (a, b, a + b))
    assert {"position_m", "velocity_m_s"} <= set(at_a) <= set(CHANNELS)
    for channel, value in at_sum.items():
        assert value == pytest.approx(at_a[channel] + at_b[channel], rel=1e-12)


@EVERY_FORM
def test_the_compiled_step_holds_the_bounds(model: ProcessModel) -> None:
    scale = np.array([state.scale for state in model.states])
    state = np.zeros(model.width)
    state[model.index(BULK_MODULUS)] = -1.0
    moved, _ = compile_step(model).step(state, np.zeros(1), np.zeros(1), parameter_row(RIG), 1e-4)
    assert moved[model.index(BULK_MODULUS)] == 0.0
    assert np.all(np.isfinite(moved * scale))


@EVERY_FORM
@EVERY_METHOD
@pytest.mark.parametrize("condition", thinned(CONDITIONS, ["major_leakage_major_friction"]))
def test_the_covariance_stays_symmetric_and_positive(method: Method, model: ProcessModel, condition: str) -> None:
    parameters = parameters_for(CONDITIONS[condition])
    estimate = filtered(method, model, bench_log(parameters), parameters)
    covariance = estimate.belief.covariance
    assert np.all(estimate.variance > 0.0)
    correlation = covariance / np.outer(estimate.belief.std, estimate.belief.std)
    np.testing.assert_allclose(correlation, correlation.T, atol=1e-12)
    assert np.min(np.linalg.eigvalsh(correlation)) > -1e-9


@EVERY_FORM
@WITHOUT_CHANCE
def test_a_log_without_measurements_leaves_the_prior_of_bulk_modulus_unchanged(
    method: Method, model: ProcessModel
) -> None:
    record = bench_log()
    missing = {name: np.full(len(record), np.nan) for name in record if name != "motor_speed_rad_s"}
    estimate = filtered(method, model, record.replace(**missing))
    mean, std = estimate.track(BULK_MODULUS)
    assert mean[-1] == pytest.approx(2e8)
    assert std[-1] == pytest.approx(3e8)
    assert abs(estimate.log_likelihood) <= ROUNDING.get(method, 0.0)


@WITHOUT_CHANCE
def test_a_filter_that_diverges_returns_a_value_that_is_not_finite(method: Method) -> None:
    parameters = parameters_for(CONDITIONS["major_friction"])
    drive = sine(0.5, 1e-3, parameters.rated_speed, 2.0)
    record = simulate(LUMPED, drive, 1e-3, parameters, sensors=BENCH, rng=np.random.default_rng(0))
    estimate = filtered(method, FORMS["acceleration"], record, parameters)  # explicit Euler, step four times too long
    assert not np.isfinite(estimate.settled(BULK_MODULUS)[0])


@EVERY_FORM
@EVERY_METHOD
def test_a_filter_run_is_reproducible_and_does_not_change_its_prior(method: Method, model: ProcessModel) -> None:
    record = bench_log(duration=0.02)
    prior = first_belief(model, record, 2e8, 3e8)
    first, again = (run_filter(method, model, prior, record, RIG) for _ in range(2))
    np.testing.assert_array_equal(first.mean, again.mean)
    np.testing.assert_array_equal(first.belief.covariance, again.belief.covariance)
    np.testing.assert_array_equal(prior.covariance, first_belief(model, record, 2e8, 3e8).covariance)
