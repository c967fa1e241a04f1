"""filterpy, given the same model, agrees to 1e-9."""

import itertools

import numpy as np
import pytest

from estimation.filters.ekf import ekf
from estimation.filters.filterpy_bridge import filterpy_ekf
from estimation.filters.run import Estimate, available_channels, run_filter
from estimation.log_checks.first_belief import first_belief
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.eha_forms import FORMS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, REDUCED, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH, drop_samples
from tests.thinned import thinned

STEPS = 5_000


def logged(form: str, parameters: EhaParameters, sample_time: float = 1e-4, samples: int = STEPS) -> Record:
    """Return a bench log of the plant that the form describes, driven with 4 V at 4 Hz."""
    drive = sine(samples * sample_time, sample_time, parameters.rated_speed, 4.0)
    plant = {"acceleration": REDUCED, "pressure": LUMPED}[form]
    return simulate(plant, drive, sample_time, parameters, sensors=BENCH, rng=np.random.default_rng(2))


def both(form: str, record: Record, parameters: EhaParameters, start: float = 2e8) -> tuple[Estimate, Estimate]:
    model = FORMS[form]
    prior = first_belief(model, record, start, 3e8)
    channels = available_channels(model, record)
    variances = measurement_variances(record, channels)
    ours, theirs = (
        run_filter(method, model, prior, record, parameters, variances=variances, keep_innovations=True)
        for method in (ekf, filterpy_ekf)
    )
    return ours, theirs


def assert_equal(ours: Estimate, theirs: Estimate, tolerance: float = 1e-9) -> None:
    scale = np.array([state.scale for state in ours.model.states])
    np.testing.assert_allclose(theirs.mean / scale, ours.mean / scale, rtol=tolerance, atol=tolerance)
    np.testing.assert_allclose(theirs.belief.mean, ours.belief.mean, rtol=tolerance, atol=tolerance * np.min(scale))
    deviations = np.outer(ours.belief.std, ours.belief.std)
    np.testing.assert_allclose(
        theirs.belief.covariance / deviations, ours.belief.covariance / deviations, rtol=0.0, atol=tolerance
    )
    np.testing.assert_allclose(theirs.variance, ours.variance, rtol=tolerance)
    assert theirs.log_likelihood == pytest.approx(ours.log_likelihood, rel=tolerance)
    assert dict(theirs.nis) == pytest.approx(dict(ours.nis), rel=tolerance)


@pytest.mark.parametrize(
    ("form", "condition"),
    thinned(itertools.product(FORMS, CONDITIONS), [("pressure", "major_leakage_major_friction")]),
)
def test_both_engines_agree_over_5000_steps(form: str, condition: str) -> None:
    parameters = parameters_for(CONDITIONS[condition])
    ours, theirs = both(form, logged(form, parameters), parameters)
    assert_equal(ours, theirs)


def test_both_engines_agree_on_every_innovation_of_sequential_updates() -> None:
    record = drop_samples(logged("pressure", EhaParameters(), samples=400), 0.2, np.random.default_rng(1))
    speed = logged("pressure", EhaParameters(), samples=400)["motor_speed_rad_s"]
    ours, theirs = both("pressure", record.replace(motor_speed_rad_s=speed), EhaParameters())
    present = np.isfinite(ours.residuals)
    assert 0.75 < np.mean(present) < 0.85
    np.testing.assert_array_equal(np.isfinite(theirs.residuals), present)
    size = np.sqrt(ours.residual_variances[present])
    np.testing.assert_allclose(theirs.residuals[present] / size, ours.residuals[present] / size, atol=1e-8)
    np.testing.assert_allclose(theirs.residual_variances[present], ours.residual_variances[present], rtol=1e-9)
    assert_equal(ours, theirs)


def test_both_engines_agree_when_some_channels_of_a_sample_are_missing() -> None:
    record = logged("pressure", EhaParameters(), samples=400)
    rng = np.random.default_rng(3)
    gaps = {name: np.where(rng.random(400) < 0.3, np.nan, record[name]) for name in ("position_m", "velocity_m_s")}
    assert_equal(*both("pressure", record.replace(**gaps), EhaParameters()))


@pytest.mark.parametrize("form", FORMS)
def test_both_engines_sub_step_slow_logs_alike(form: str) -> None:
    record = logged(form, EhaParameters(), sample_time=1e-3, samples=500)
    assert_equal(*both(form, record, EhaParameters()))


def test_both_engines_hold_bulk_modulus_to_its_bounds() -> None:
    parameters = EhaParameters()
    ours, theirs = both("acceleration", logged("pressure", parameters, samples=3_000), parameters, start=0.0)
    assert np.min(ours.track("bulk_modulus_pa")[0]) == 0.0
    assert_equal(ours, theirs)


def test_both_engines_agree_on_a_linear_model(linear: ProcessModel) -> None:
    rng = np.random.default_rng(6)
    names = ("motor_speed_rad_s", "position_m", "velocity_m_s")
    record = Record(0.01, {name: rng.normal(size=200) for name in names})
    prior = Gaussian(np.zeros(3), np.eye(3))
    variances = {"position_m": 1e-4, "velocity_m_s": 1e-2}
    ours, theirs = (
        run_filter(method, linear, prior, record, EhaParameters(), variances=variances)
        for method in (ekf, filterpy_ekf)
    )
    assert_equal(ours, theirs)


def test_a_robust_update_is_refused(linear: ProcessModel) -> None:
    log = Record(1e-3, {"motor_speed_rad_s": np.zeros(5), "position_m": np.zeros(5)})
    prior = Gaussian(np.zeros(3), np.eye(3))
    with pytest.raises(HydrostateError, match="filterpy's filter has no robust update, got robust 'huber'"):
        run_filter(filterpy_ekf, linear, prior, log, EhaParameters(), variances={"position_m": 1.0}, robust="huber")
