"""The bank of interacting models: equal models act as one filter, different ones are separated, nothing underflows."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.filters.ckf import CKF
from estimation.filters.ekf import ekf
from estimation.filters.imm import bank_parameters, imm, log_transitions
from estimation.filters.methods import METHODS
from estimation.filters.run import filter_problem, run_filter
from estimation.filters.svsf import SVSF
from estimation.models.augment import augmented, augmented_prior
from estimation.models.eha_forms import FORMS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.compiled.functions import Scalar
from plant.eha.drives import make_drive, sine
from plant.eha.model import EhaParameters, EhaValues
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_row
from tests.estimation.filters.banks import Mode, run_imm

RIG = EhaParameters()
STEP, Q, R = 0.01, np.array([1e-8, 1e-4, 1e-2]), np.array([1e-4, 1e-2])
PRIOR = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-2, 1.0]))
VARIANCES = {"position_m": 1e-4, "velocity_m_s": 1e-2}


def _damped(state: tuple[Scalar, ...], speeds: tuple[Scalar, Scalar], p: EhaValues, h: Scalar) -> tuple[Scalar, ...]:
    """The step of the fixture's linear model, with its damping as a parameter."""
    x, v, force = state
    return x + h * v, v + h * (0.01 * (speeds[0] + speeds[1]) + force - p.friction_linear * v), force


@pytest.fixture(scope="module")
def damped(linear: ProcessModel) -> ProcessModel:
    return replace(linear, name="damped", step=_damped, longest_step=STEP)


def modes(model: ProcessModel, dampings: tuple[float, ...]) -> list[Mode]:
    return [Mode(f"damping {d}", model, unchecked(d)) for d in dampings]


def unchecked(damping: float) -> EhaParameters:
    """Return the rig with a damping that rig files do not allow: one that overflows makes a filter diverge at once."""
    rig = replace(RIG)
    object.__setattr__(rig, "friction_linear", damping)
    return rig


def noisy_record(samples: int = 120, missing: float = 0.2) -> Record:
    rng = np.random.default_rng(5)
    speed = 100.0 * rng.normal(size=samples)
    gaps = {
        name: np.where(rng.random(samples) < missing, np.nan, 2.0 * np.sqrt(variance) * rng.normal(size=samples))
        for name, variance in VARIANCES.items()
    }
    return Record(STEP, {"motor_speed_rad_s": speed, **gaps})


def textbook(record: Record, dampings: tuple[float, ...], dwell: float) -> tuple[Array, Array, Array, float]:
    """Return mean, covariance, probabilities and log-likelihood by section 11.6.6 of the book, in plain arithmetic."""
    count, H = len(dampings), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.25]])
    stay = 1.0 - STEP / dwell
    p = np.full((count, count), (1.0 - stay) / (count - 1)) + np.eye(count) * (stay - (1.0 - stay) / (count - 1))
    mu, x, P = np.full(count, 1.0 / count), np.tile(PRIOR.mean, (count, 1)), np.tile(PRIOR.covariance, (count, 1, 1))
    speed, total = record["motor_speed_rad_s"], 0.0
    for k in range(len(record)):
        if k:
            c = p.T @ mu
            w = p * mu[:, None] / c
            x0 = w.T @ x
            apart = x[:, None] - x0[None]  # deviation of each mode (first axis) from each mixed mean (second axis)
            P0 = np.einsum("ji,jab->iab", w, P) + np.einsum("ji,jia,jib->iab", w, apart, apart)
            mu = c
            for i, d in enumerate(dampings):
                F = np.array([[1.0, STEP, 0.0], [0.0, 1.0 - d * STEP, STEP], [0.0, 0.0, 1.0]])
                push = np.array([0.0, STEP * 0.01 * (speed[k - 1] + speed[k]), 0.0])
                x[i], P[i] = F @ x0[i] + push, F @ P0[i] @ F.T + np.diag(Q) * STEP
        y = np.array([record["position_m"][k], record["velocity_m_s"][k]])
        seen = np.isfinite(y)
        if np.any(seen):
            likelihoods = np.empty(count)
            for i in range(count):
                S = H[seen] @ P[i] @ H[seen].T + np.diag(R[seen])
                e = y[seen] - H[seen] @ x[i]
                K = P[i] @ H[seen].T @ np.linalg.inv(S)
                x[i], P[i] = x[i] + K @ e, P[i] - K @ S @ K.T
                likelihoods[i] = np.exp(-0.5 * e @ np.linalg.inv(S) @ e) / np.sqrt(np.linalg.det(2.0 * np.pi * S))
            total += np.log(mu @ likelihoods)
            mu = mu * likelihoods / (mu @ likelihoods)
    mean = mu @ x
    spread = sum(mu[i] * (P[i] + np.outer(x[i] - mean, x[i] - mean)) for i in range(count))
    return mean, np.asarray(spread), mu, float(total)


def test_the_bank_equals_the_textbook_imm_filter_with_missing_samples(damped: ProcessModel) -> None:
    dampings, record = (3.0, 5.0, 9.0), noisy_record()
    bank = run_imm(modes(damped, dampings), PRIOR, record, dwell_time=0.1, variances=VARIANCES)
    mean, covariance, probability, log_likelihood = textbook(record, dampings, 0.1)
    np.testing.assert_allclose(bank.estimate.belief.mean, mean, rtol=1e-9)
    np.testing.assert_allclose(bank.estimate.belief.covariance, covariance, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(bank.probability[-1], probability, rtol=1e-8)
    assert bank.estimate.log_likelihood == pytest.approx(log_likelihood, rel=1e-9)


def bench_log(parameters: EhaParameters, seconds: float = 0.2) -> Record:
    drive = sine(seconds, 1e-4, parameters.rated_speed, 5.0)
    return simulate(LUMPED, drive, 1e-4, parameters, sensors=BENCH, rng=np.random.default_rng(0))


def start(model: ProcessModel) -> Gaussian:
    third = {"acceleration": 10.0, "pressure": 1e5}[model.name]
    return Gaussian(np.array([0.0, 0.0, 0.0, 2e8]), np.diag([1e-5, 1e-3, third, 3e8]) ** 2)


@pytest.mark.slow
@pytest.mark.parametrize("model", FORMS.values(), ids=FORMS)
def test_a_bank_of_equal_models_equals_a_single_filter(model: ProcessModel) -> None:
    record = bench_log(RIG)
    one = run_filter(ekf, model, start(model), record, RIG, keep_innovations=True)
    bank = run_imm(
        [Mode(str(i), model, RIG) for i in range(3)], start(model), record, dwell_time=0.1, keep_innovations=True
    )
    np.testing.assert_allclose(bank.estimate.mean, one.mean, rtol=1e-12)
    np.testing.assert_allclose(bank.estimate.variance, one.variance, rtol=1e-12)
    np.testing.assert_allclose(bank.estimate.belief.covariance, one.belief.covariance, rtol=1e-12)
    deviations = np.sqrt(one.residual_variances)
    np.testing.assert_allclose(bank.estimate.residuals / deviations, one.residuals / deviations, atol=1e-12)
    assert bank.estimate.log_likelihood == pytest.approx(one.log_likelihood, rel=1e-12)
    assert dict(bank.estimate.nis) == pytest.approx(dict(one.nis), rel=1e-12)
    np.testing.assert_allclose(bank.probability, 1.0 / 3.0, rtol=1e-12)


def test_a_bank_of_different_filters_of_one_linear_model_equals_a_single_filter(damped: ProcessModel) -> None:
    record = noisy_record()
    kinds = [
        Mode("kalman", damped, RIG),
        Mode("cubature", damped, RIG, CKF),
        Mode("variable structure", damped, RIG, SVSF, {"gamma": 0.1, "boundary_layer": 1e12}),
    ]
    one = run_filter(ekf, damped, PRIOR, record, RIG, variances=VARIANCES)
    bank = run_imm(kinds, PRIOR, record, dwell_time=1.0, variances=VARIANCES)
    np.testing.assert_allclose(bank.estimate.belief.mean, one.belief.mean, rtol=1e-9)
    assert bank.estimate.log_likelihood == pytest.approx(one.log_likelihood, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("true", CONDITIONS)
def test_a_bank_of_nine_constant_conditions_finds_the_true_one(true: str) -> None:
    model = FORMS["pressure"]
    conditions = [Mode(name, model, parameters_for(condition)) for name, condition in CONDITIONS.items()]
    record = bench_log(parameters_for(CONDITIONS[true]), 1.0)
    bank = run_imm(conditions, start(model), record, dwell_time=np.inf)
    assert bank.probability[-1, bank.names.index(true)] > 0.99
    assert bank.estimate.settled("bulk_modulus_pa")[0] == pytest.approx(RIG.bulk_modulus, rel=0.01)


def test_the_bank_follows_a_change_of_mode(damped: ProcessModel) -> None:
    rng, state, samples = np.random.default_rng(3), np.zeros(3), 2000
    speed, measured = 500.0 * np.sign(np.sin(np.arange(samples) * STEP)), np.empty((samples, 2))
    for k in range(samples):
        if k:
            p = replace(RIG, friction_linear=3.0 if k < samples // 2 else 6.0)
            state = np.array(_damped(tuple(state), (speed[k - 1], speed[k]), p, STEP))
        measured[k] = [state[0], state[1] + 0.25 * state[2]] + np.sqrt(R) * rng.normal(size=2)
    channels = {"position_m": measured[:, 0], "velocity_m_s": measured[:, 1]}
    record = Record(STEP, {"motor_speed_rad_s": speed, **channels})
    bank = run_imm(modes(damped, (3.0, 6.0)), PRIOR, record, dwell_time=10.0, variances=VARIANCES)
    half = samples // 2
    assert np.mean(bank.probability[half // 2 : half, 0]) > 0.9
    assert np.mean(bank.probability[half + half // 4 :, 1]) > 0.9


def test_without_measurements_mode_probabilities_relax_at_the_rate_of_the_dwell_times(damped: ProcessModel) -> None:
    record = noisy_record(60, missing=1.1)
    bank = run_imm(
        modes(damped, (3.0, 5.0)), PRIOR, record, dwell_time=0.1, probabilities=(1.0, 0.0), variances=VARIANCES
    )
    k = np.arange(60)
    np.testing.assert_allclose(bank.probability[:, 0], 0.5 + 0.5 * (1.0 - 2.0 * STEP / 0.1) ** k, rtol=1e-12)
    assert bank.estimate.log_likelihood == pytest.approx(0.0, abs=1e-12)


def test_the_log_probability_of_a_very_improbable_mode_stays_finite(damped: ProcessModel) -> None:
    rng = np.random.default_rng(0)
    channels = {name: 1e-2 * rng.normal(size=4000) for name in VARIANCES}
    record = Record(STEP, {"motor_speed_rad_s": np.full(4000, 400.0), **channels})
    bank = run_imm(modes(damped, (3.0, 300.0)), PRIOR, record, dwell_time=np.inf, variances=VARIANCES)
    lowest = np.min(bank.log_probability)
    assert np.isfinite(lowest)
    assert lowest < -1e3
    np.testing.assert_allclose(np.sum(bank.probability, axis=1), 1.0, rtol=1e-12)


def test_a_diverging_mode_does_not_affect_the_bank(damped: ProcessModel) -> None:
    record = noisy_record(200, missing=0.0)
    bank = run_imm(modes(damped, (3.0, 1e200)), PRIOR, record, dwell_time=1.0, variances=VARIANCES)
    alone = run_filter(ekf, damped, PRIOR, record, replace(RIG, friction_linear=3.0), variances=VARIANCES)
    np.testing.assert_allclose(bank.estimate.belief.mean, alone.belief.mean, rtol=1e-9)
    assert bank.probability[-1, 0] == pytest.approx(1.0)


def test_a_bank_with_only_diverged_modes_has_no_belief(damped: ProcessModel) -> None:
    bank = run_imm(modes(damped, (1e200, 1e200)), PRIOR, noisy_record(50), dwell_time=1.0, variances=VARIANCES)
    assert bank.estimate.belief is None


def test_transition_probabilities_sum_to_one_and_an_infinite_dwell_time_forbids_transitions() -> None:
    np.testing.assert_allclose(np.sum(np.exp(log_transitions([0.5, 2.0, 0.03], 0.01)), axis=1), 1.0, rtol=1e-14)
    assert log_transitions([np.inf, 1.0], 0.01)[0].tolist() == [0.0, -np.inf]


def test_an_invalid_bank_is_refused(damped: ProcessModel) -> None:
    record, bank = noisy_record(10), modes(damped, (3.0, 5.0))
    other = Mode("other", FORMS["pressure"], RIG)
    for wrong, options, message in (
        ([], {"dwell_time": 1.0}, "at least one mode"),
        ([*bank, other], {"dwell_time": 1.0}, "same states"),
        (bank, {"dwell_time": 0.005}, r"longer than a sample \(0\.01 s\), got 0\.005 s"),
        (bank, {"dwell_time": [1.0]}, "2 modes need as many dwell times, got 1"),
        (bank, {"dwell_time": 1.0, "probabilities": (0.5, 0.4)}, r"sum to 1, got \[0\.5, 0\.4\]"),
    ):
        with pytest.raises(HydrostateError, match=message):
            run_imm(wrong, PRIOR, record, variances=VARIANCES, **options)


def test_the_imm_method_equals_one_filter_on_a_model_without_leakage_or_friction(linear: ProcessModel) -> None:
    record = noisy_record()
    one, bank = (run_filter(METHODS[m], linear, PRIOR, record, RIG, variances=VARIANCES) for m in ("ekf", "imm"))
    np.testing.assert_allclose(bank.mean, one.mean, rtol=1e-9, atol=1e-15)
    assert bank.log_likelihood == pytest.approx(one.log_likelihood, rel=1e-9)


def test_the_bank_of_the_imm_method_has_three_leakages_by_three_frictions_from_the_given_ones_up() -> None:
    problem = filter_problem(FORMS["pressure"], start(FORMS["pressure"]), bench_log(RIG, 0.01), RIG)
    rows = bank_parameters(problem)
    assert len(rows) == 9
    np.testing.assert_array_equal(rows[0], problem.parameters)
    for condition in CONDITIONS.values():
        told = parameter_row(parameters_for(condition))
        assert any(np.allclose(row, told, rtol=0.01) for row in rows)


def test_the_bank_of_the_imm_method_does_not_vary_parameters_that_the_model_estimates() -> None:
    wide = augmented(FORMS["pressure"], ("leakage_coefficient", "flow_bias"), {})
    prior = augmented_prior(wide, start(FORMS["pressure"]), RIG)
    rows = bank_parameters(filter_problem(wide, prior, bench_log(RIG, 0.01), RIG))
    assert len(rows) == 3
    assert len({row[list(asdict(RIG)).index("leakage_coefficient")] for row in rows}) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("true", "pressure"), [*((name, True) for name in CONDITIONS), *((name, False) for name in list(CONDITIONS)[::4])]
)
def test_the_imm_method_finds_bulk_modulus_without_the_condition_as_input(true: str, pressure: bool) -> None:
    p = parameters_for(CONDITIONS[true])
    drive = make_drive("steps", 3.0, 1e-4, p, np.random.default_rng(0))
    record = simulate(LUMPED, drive, 1e-4, p, sensors=BENCH, rng=np.random.default_rng(1))
    record = record if pressure else record.replace(differential_pressure_pa=None)
    found = estimate_bulk_modulus(record, RIG, form="pressure", method="imm")
    assert found.method == "imm"
    assert not found.gate.passed or found.value == pytest.approx(RIG.bulk_modulus, rel=0.01)
    assert found.gate.passed or not pressure


def test_the_imm_method_refuses_invalid_settings(linear: ProcessModel) -> None:
    problem = filter_problem(linear, PRIOR, noisy_record(10), RIG, variances=VARIANCES)
    for settings, message in (
        ({"dwell_time": 0.0}, r"dwell_time must be positive, got 0\.0"),
        ({"dwell_time": 0.005}, r"longer than a sample \(0\.01 s\), got 0\.005 s"),
        ({"gamma": 0.1}, "imm can be set dwell_time, got 'gamma'"),
    ):
        with pytest.raises(HydrostateError, match=message):
            imm(replace(problem, settings=settings))
