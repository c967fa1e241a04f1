"""The iterated smoother is the smoother if the model is linear, and otherwise finds what a filter loses."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.filters.efficiency import Case, run_case
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.eha.by_filter import chosen_method
from estimation.engine.contract import FilterProblem
from estimation.filters import iterated_smoother as module
from estimation.filters.iterated_smoother import iterated_smoother
from estimation.filters.run import Estimate, filter_problem, run_filter
from estimation.filters.smoother import smoother
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import BULK_MODULUS, FORMS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

MOTION = ("position_m", "velocity_m_s")
MINOR = parameters_for(CONDITIONS["minor_leakage"])


def linear_task(linear: ProcessModel) -> FilterProblem:
    rng = np.random.default_rng(4)
    samples = 150
    seen = {name: np.where(rng.random(samples) < 0.2, np.nan, rng.normal(size=samples)) for name in MOTION}
    record = Record(0.01, {"motor_speed_rad_s": rng.normal(size=samples), **seen})
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 0.0, 1.0]))
    task = filter_problem(linear, prior, record, EhaParameters(), variances={"position_m": 1e-2, "velocity_m_s": 0.1})
    return replace(task, substeps=1)  # the iterated smoother pushes once a sample, the smoother once a step


@pytest.fixture(scope="module")
def sticking_log() -> Record:
    drive = make_drive("steps", 3.0, 1e-3, MINOR, np.random.default_rng(2))
    return simulate(LUMPED, drive, 1e-3, MINOR, sensors=BENCH, rng=np.random.default_rng(2))


def smoothed(record: Record, guess: float, robust: str = "none") -> Estimate:
    form = FORMS["pressure"]
    prior = first_belief(form, record, guess, 3e8)
    stiffness = MINOR.bulk_modulus / MINOR.chamber_volume
    unseen = {"differential_pressure_pa": (stiffness * MINOR.pump_displacement * BENCH.speed_noise) ** 2 * 1e-3}
    noise = {state.name: 0.0 for state in form.states} | unseen  # the effect of noise of the measured motor speed
    return run_filter(iterated_smoother, form, prior, record, MINOR, channels=MOTION, noise=noise, robust=robust)


def test_on_a_linear_model_the_iterated_smoother_equals_the_smoother(linear: ProcessModel) -> None:
    task = linear_task(linear)
    ours, theirs = iterated_smoother(task), smoother(task)
    np.testing.assert_allclose(ours.track, theirs.track, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(ours.track_variance, theirs.track_variance, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(ours.covariance, theirs.covariance, rtol=1e-9, atol=1e-15)
    np.testing.assert_array_equal(ours.count, theirs.count)


def test_the_result_does_not_depend_on_the_initial_guess_of_bulk_modulus(sticking_log: Record) -> None:
    low, middle, high = (smoothed(sticking_log, guess).track(BULK_MODULUS) for guess in (2e7, 3e8, 1e9))
    std = middle[1][-1]
    assert abs(middle[0][-1] - MINOR.bulk_modulus) < 4.0 * std
    assert abs(low[0][-1] - middle[0][-1]) < 0.2 * std
    assert abs(high[0][-1] - middle[0][-1]) < 0.2 * std


def test_gross_outliers_do_not_affect_a_robust_smoother(sticking_log: Record) -> None:
    rng = np.random.default_rng(0)
    spoilt = sticking_log["position_m"] + np.where(rng.random(len(sticking_log)) < 0.01, 0.005, 0.0)
    log = sticking_log.replace(position_m=spoilt)
    trusting, doubting = (smoothed(log, 3e8, robust).track(BULK_MODULUS) for robust in ("none", "student-t"))
    clean = smoothed(sticking_log, 3e8).track(BULK_MODULUS)
    assert abs(doubting[0][-1] - clean[0][-1]) < 3.0 * clean[1][-1]
    assert abs(trusting[0][-1] - clean[0][-1]) > 30.0 * clean[1][-1]


@pytest.mark.slow
def test_the_iterated_smoother_is_the_default_with_tuned_noise_and_without_pressure(sticking_log: Record) -> None:
    blind = sticking_log.replace(differential_pressure_pa=None)
    found = estimate_bulk_modulus(blind, MINOR, form="pressure", tuned=True)
    assert found.method == "iterated-smoother"
    low, high = found.interval or (0.0, 0.0)
    assert low < MINOR.bulk_modulus < high
    form = FORMS["pressure"]
    assert chosen_method(blind, form, False) == chosen_method(sticking_log, form, True) == "ekf"


def test_a_log_too_long_for_memory_is_refused(linear: ProcessModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LONGEST", 149)
    with pytest.raises(HydrostateError, match="at most 149 samples, got 150"):
        iterated_smoother(linear_task(linear))


@pytest.mark.slow
def test_the_iterated_smoother_finds_the_bulk_modulus_that_the_filter_loses_while_the_piston_sticks() -> None:
    filtered, found = (run_case(Case("steps", "major_leakage", 5, way, False)) for way in ("stated", "smoothed"))
    assert abs(float(filtered["z"])) > 100.0  # pyright: ignore[reportArgumentType]
    assert abs(float(found["z"])) < 3.5  # pyright: ignore[reportArgumentType]
    assert float(found["std_percent"]) == pytest.approx(float(found["bound_percent"]), rel=0.05)  # pyright: ignore[reportArgumentType]
