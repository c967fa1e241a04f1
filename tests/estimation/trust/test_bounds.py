"""The Cramér-Rao bound predicts what a drive and its sensors can determine."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.filters.ekf import ekf
from estimation.filters.run import run_filter
from estimation.log_checks.first_belief import first_belief
from estimation.models.augment import augmented, augmented_prior
from estimation.models.eha_forms import BULK_MODULUS, PRESSURE_FORM
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from estimation.trust import bounds
from estimation.trust.bounds import at_bulk_modulus, bulk_modulus_bound, posterior_bound
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError, LogError
from plant.log.record import Record
from plant.sensors.sensors import BENCH, Sensors, noise_variances
from tests.kernels import functions_of, text_of

MOTION = ("position_m", "velocity_m_s")
ALL = (*MOTION, "differential_pressure_pa")
EVERY_CONDITION = pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
NO_PROCESS_NOISE = dict.fromkeys(ALL, 0.0)


def driven(drive: str, p: EhaParameters, duration: float = 10.0) -> Record:
    return simulate(LUMPED, make_drive(drive, duration, 1e-3, p, np.random.default_rng(0)), 1e-3, p)


def relative_bound(
    record: Record,
    p: EhaParameters,
    channels: tuple[str, ...],
    sensors: Sensors = BENCH,
    noise: dict[str, float] | None = None,
) -> float:
    prior = first_belief(PRESSURE_FORM, record, p.bulk_modulus, 3e8)
    variances = dict(noise_variances(sensors))
    std = bulk_modulus_bound(PRESSURE_FORM, prior, record, p, channels=channels, variances=variances, noise=noise)
    return std / p.bulk_modulus


@EVERY_CONDITION
def test_steps_with_pressure_bound_bulk_modulus_to_one_percent(condition: Condition) -> None:
    p = parameters_for(condition)
    assert relative_bound(driven("steps", p), p, ALL) < 0.01


@EVERY_CONDITION
def test_the_papers_sine_without_pressure_has_a_bound_over_three_percent(condition: Condition) -> None:
    p = parameters_for(condition)
    assert relative_bound(driven("sine", p), p, MOTION) > 0.03  # errata E13


def test_a_longer_log_and_a_further_sensor_lower_the_bound() -> None:
    p = EhaParameters()
    record = driven("steps", p)
    assert relative_bound(record, p, ALL) < relative_bound(record.slice(0, 3_000), p, ALL)
    assert relative_bound(record, p, ALL) < relative_bound(record, p, MOTION)


def test_without_a_drive_the_bound_is_the_prior() -> None:
    p = EhaParameters()
    still = Record(1e-3, {"motor_speed_rad_s": np.zeros(500), "position_m": np.zeros(500)})
    assert relative_bound(still, p, MOTION) == pytest.approx(3e8 / p.bulk_modulus, rel=1e-6)


def test_the_measured_channels_do_not_enter_the_bound() -> None:
    p = EhaParameters()
    record = driven("steps", p, 4.0)
    spoilt = record.replace(velocity_m_s=np.full(len(record), 7.0), differential_pressure_pa=None)
    assert relative_bound(record, p, ALL) == relative_bound(spoilt, p, ALL)


def test_a_model_whose_run_diverges_has_an_infinite_bound() -> None:
    p = EhaParameters()
    fast = Record(1e-3, {"motor_speed_rad_s": np.full(10, 1e300), "position_m": np.zeros(10)})
    with np.errstate(all="ignore"):
        assert relative_bound(fast, p, MOTION) == np.inf


def test_the_bound_of_a_linear_model_is_the_kalman_filters_covariance(linear: ProcessModel) -> None:
    rng = np.random.default_rng(0)
    names = ("motor_speed_rad_s", "position_m", "velocity_m_s")
    record = Record(1e-4, dict(zip(names, rng.standard_normal((3, 300)), strict=True)))
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-2, 1.0]))
    variances = {"position_m": 1e-6, "velocity_m_s": 1e-4}
    bound = posterior_bound(linear, prior, record, EhaParameters(), variances=variances)
    filtered = run_filter(ekf, linear, prior, record, EhaParameters(), variances=variances)
    assert bound.belief is not None
    assert filtered.belief is not None
    np.testing.assert_allclose(bound.belief.covariance, filtered.belief.covariance, rtol=1e-9)
    np.testing.assert_allclose(bound.track("force_n"), filtered.track("force_n")[1], rtol=1e-9)
    np.testing.assert_allclose(bound.time, filtered.time)


def test_parameters_as_states_have_bounds_and_raise_that_of_bulk_modulus() -> None:
    p = EhaParameters()
    record, variances = driven("steps", p), dict(noise_variances(BENCH))
    variances = {channel: variances[channel] for channel in ALL}
    prior = first_belief(PRESSURE_FORM, record, p.bulk_modulus, 3e8)
    model = augmented(PRESSURE_FORM, ["leakage_coefficient", "friction_coulomb"])
    alone = posterior_bound(PRESSURE_FORM, prior, record, p, variances=variances)
    unsure, sure = (
        posterior_bound(model, augmented_prior(model, prior, p, spread), record, p, variances=variances)
        for spread in (1.0, 1e-9)
    )
    assert unsure.track("leakage_coefficient")[-1] < 0.1 * p.leakage_coefficient
    assert unsure.track(BULK_MODULUS)[-1] > alone.track(BULK_MODULUS)[-1]
    np.testing.assert_allclose(sure.track(BULK_MODULUS), alone.track(BULK_MODULUS), rtol=1e-4)


def test_bounds_of_constants_fall_along_the_run() -> None:
    p = EhaParameters()
    record, variances = driven("prbs", p), {"position_m": 1e-12, "velocity_m_s": 1e-6}
    prior = first_belief(PRESSURE_FORM, record, p.bulk_modulus, 3e8)
    track = posterior_bound(PRESSURE_FORM, prior, record, p, variances=variances).track(BULK_MODULUS)
    assert np.all(np.diff(track) <= 1e-9 * track[0])
    assert track[-1] < 0.03 * track[0]


def test_a_channel_of_infinite_variance_gives_the_bound_without_it() -> None:
    p = EhaParameters()
    record, prior = driven("steps", p, 4.0), first_belief(PRESSURE_FORM, driven("steps", p, 4.0), p.bulk_modulus, 3e8)
    motion = {"position_m": 1e-12, "velocity_m_s": 1e-6}
    without = posterior_bound(PRESSURE_FORM, prior, record, p, variances=motion)
    infinite = posterior_bound(
        PRESSURE_FORM, prior, record, p, variances={**motion, "differential_pressure_pa": np.inf}
    )
    np.testing.assert_allclose(infinite.std, without.std, rtol=1e-9)


def test_a_bound_without_drive_or_with_a_noiseless_sensor_is_refused() -> None:
    p, still = EhaParameters(), Record(1e-3, {"position_m": np.zeros(5)})
    prior = first_belief(PRESSURE_FORM, still, p.bulk_modulus, 3e8)
    with pytest.raises(LogError, match="pressure form needs motor_speed_rad_s; the log has no motor_speed_rad_s"):
        posterior_bound(PRESSURE_FORM, prior, still, p, variances={"position_m": 1e-12})
    with pytest.raises(HydrostateError, match=r"the variance of position_m must be positive, got 0\.0"):
        posterior_bound(PRESSURE_FORM, prior, driven("steps", p, 1.0), p, variances={"position_m": 0.0})


def test_at_bulk_modulus_changes_only_the_bulk_modulus() -> None:
    assert at_bulk_modulus(EhaParameters(), 1e8) == EhaParameters(bulk_modulus=1e8)


@pytest.mark.slow
@pytest.mark.parametrize("channels", [ALL, MOTION], ids=["with pressure", "motion alone"])
@EVERY_CONDITION
def test_no_estimate_is_better_than_the_bound_without_process_noise(
    condition: Condition, channels: tuple[str, ...]
) -> None:
    p = parameters_for(condition)
    sensors = replace(BENCH, speed_noise=0.0, position_noise=1e-6, position_quantum=0.0, pressure_quantum=0.0)
    drive = driven("steps", p)["motor_speed_rad_s"]
    errors: list[float] = []
    for seed in range(12):
        record = simulate(LUMPED, drive, 1e-3, p, sensors=sensors, rng=np.random.default_rng(seed))
        log = record.replace(**dict.fromkeys(set(ALL) - set(channels)))
        found = estimate_bulk_modulus(log, p, form="pressure", start=2.2e8)
        assert found.value is not None
        errors.append(found.value / p.bulk_modulus - 1.0)
    bound = relative_bound(driven("steps", p), p, channels, sensors, NO_PROCESS_NOISE)
    assert np.sqrt(np.mean(np.square(errors))) > bound


def test_the_recursion_in_plain_python_gives_the_same_result_as_its_kernel(
    linear: ProcessModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = Record(1e-3, {"motor_speed_rad_s": np.linspace(0.0, 1.0, 6)})
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-3, 1.0]))
    given = (linear, prior, drive, EhaParameters())
    variances = {"position_m": 1e-4, "velocity_m_s": 1e-2}
    compiled = posterior_bound(*given, variances=variances)
    kernel = functions_of(text_of(monkeypatch, bounds, lambda: bounds._compile.__wrapped__(linear, tuple(variances))))
    monkeypatch.setattr(bounds, "_compile", lambda *_: kernel)
    plain = posterior_bound(*given, variances=variances)
    np.testing.assert_array_equal(plain.std, compiled.std)
    np.testing.assert_array_equal(plain.mean, compiled.mean)
