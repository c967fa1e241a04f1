"""The flow form on actuators unlike the paper's: small chambers, stiff oil, pumps that fill the chambers at once."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import flow_log, without_strays
from estimation.fits.flow.plain import FitStart, Logged, plain_fits
from estimation.fits.flow.search import flow_starts
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypothesis_search.fit_objections import objections
from estimation.models.completed_flow import balances_mass
from estimation.notes import EstimateCode
from faults.conditions import severity
from plant.eha.circuit_parameters import CircuitParameters, circuit_of
from plant.eha.drives import prbs
from plant.eha.model import PARAMETER_NAMES, EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

PAPER = EhaParameters()
STIFF = EhaParameters(
    pump_displacement=2.88e-7,
    piston_area=3.11e-4,
    chamber_volume=2.27e-5,
    moving_mass=2.7,
    bulk_modulus=9.68e8,
    leakage_coefficient=1.9e-13,
    flow_bias=1.81e-7,
    friction_quadratic=1420.0,
    friction_linear=85.6,
    friction_coulomb=137.0,
    relief_pressure=6e6,
    relief_conductance=3.28e-10,
    makeup_conductance=1.2e-9,
    accumulator_pressure=3.7e5,
    motor_speed_per_volt=24.2,
    motor_speed_limit=194.0,
)
"""A cylinder of 20 mm whose pump fills a chamber in 0.8 s, with stiff oil that hardly leaks."""

PUMPED_UP = CircuitParameters(
    pump_displacement=7.18e-7,
    piston_area=9.36e-4,
    chamber_volume=6.21e-5,
    moving_mass=1.89,
    bulk_modulus=2.93e8,
    leakage_coefficient=1.04e-13,
    flow_bias=1.38e-6,
    friction_quadratic=1750.0,
    friction_linear=561.0,
    friction_coulomb=174.0,
    relief_pressure=1.52e7,
    relief_conductance=2.32e-9,
    accumulator_pressure=2.72e5,
    makeup_conductance=4.92e-9,
    makeup_opening=4.17e3,
    area_difference=0.154,
    volume_difference=0.132,
    stroke=0.227,
    pump_crossport_leakage=4.9e-14,
    pump_case_leakage=1.1e-14,
    accumulator_gas=1.56e-4,
    accumulator_oil=1.56e-4,
    motor_lag=4e-3,
    motor_speed_per_volt=79.9,
    motor_speed_limit=639.0,
)
"""A single rod with plain check valves, which keep the oil that its rod displaces."""

SUBSTEPS, LAG = 5, 2e-3


def log(healthy: EhaParameters, leakage: float, sample_time: float, duration: float = 4.0, seed: int = 1) -> Record:
    """Return a log of a motor with a double lag behind a binary drive: its speed is not linear between samples."""
    rng = np.random.default_rng(seed)
    fine = sample_time / SUBSTEPS
    speed = prbs(duration, fine, healthy.rated_speed, 0.05, rng)
    share = np.exp(-fine / LAG)
    for _ in range(2):
        speed = lfilter([1.0 - share], [1.0, -share], speed)
    record = simulate(CIRCUIT, speed, fine, circuit_of(severity(leakage, 0.0, healthy)), sensors=BENCH, rng=rng)
    return Record(sample_time, {name: record[name][::SUBSTEPS] for name in record})


def seen(record: Record, p: EhaParameters) -> int:
    """Return how many samples of a log are averaged into one."""
    cleaned, variances = without_strays(record)
    return round(flow_log(cleaned, p, {}, variances).sample_time / record.sample_time)


def test_searches_begin_at_fault_sizes_scaled_to_the_rig() -> None:
    major = severity(2.0, 0.0, STIFF)
    assert major.leakage_coefficient > 20.0 * STIFF.leakage_coefficient
    worst = max(flow_starts(STIFF, 9e8), key=lambda start: start["leakage_coefficient"])
    assert worst["leakage_coefficient"] == pytest.approx(major.leakage_coefficient, rel=0.01, abs=0.0)
    assert worst["flow_bias"] == pytest.approx(major.flow_bias, rel=0.02)


def test_fewer_samples_are_averaged_if_stiff_chambers_show_the_corners_of_the_flow() -> None:
    assert seen(log(PAPER, 1.0, 2e-4), PAPER) == 3
    assert seen(log(STIFF, 1.0, 2e-4), STIFF) == 1


@pytest.mark.slow
def test_bulk_modulus_of_a_leaky_stiff_actuator_is_right() -> None:
    fit = fit_flow(log(STIFF, 2.0, 2e-4), STIFF, 1.2 * STIFF.bulk_modulus)
    value, std = fit.parameters["bulk_modulus"]
    assert fit.reasons == ()
    assert value == pytest.approx(STIFF.bulk_modulus, abs=3.0 * std)
    assert value == pytest.approx(STIFF.bulk_modulus, rel=0.01)


def test_overestimated_noise_is_no_objection_to_a_fit() -> None:
    record, variances = without_strays(log(PAPER, 1.0, 1e-3))
    fit: GreyBoxFit = plain_fits(Logged(record, variances), FitStart(PAPER, PAPER.bulk_modulus)).best
    assert objections(fit, noisy=False) == ()
    assert objections(replace(fit, chi_square=(0.5,), autocorrelation=(-0.4,)), noisy=False) == ()
    assert len(objections(replace(fit, chi_square=(0.5,), autocorrelation=(0.4,)), noisy=False)) == 1
    assert len(objections(replace(fit, chi_square=(1.2,), autocorrelation=(-0.4,)), noisy=False)) == 1


@pytest.mark.parametrize(("left", "small"), [(0.0, False), (0.21, True), (0.6, False), (1.0, False)])
def test_residuals_far_below_the_predicted_encoder_noise_are_an_objection_to_a_fit(left: float, *, small: bool) -> None:
    """Oil five times too stiff was accepted at a fifth of the noise, together with a pressure that seemed late."""
    record, variances = without_strays(log(PAPER, 1.0, 1e-3))
    fit = replace(plain_fits(Logged(record, variances), FitStart(PAPER, 2e8)).best, chi_square=(left,))
    fit = replace(fit, autocorrelation=(-0.1,))
    assert [note.code for note in objections(fit, noisy=True)] == [EstimateCode.PRESSURE_RESIDUALS_SMALL] * small
    assert objections(fit, noisy=False) == ()


@pytest.mark.slow
def test_a_single_rod_with_rising_mean_pressure_is_fitted_by_the_mass_balance() -> None:
    rng = np.random.default_rng(26)
    drive = prbs(5.0, 5e-4, 250.0, 0.05, rng)
    record = simulate(CIRCUIT, drive, 5e-4, PUMPED_UP, sensors=BENCH, rng=rng)
    healthy = EhaParameters(**{name: getattr(PUMPED_UP, name) for name in PARAMETER_NAMES})
    plain = plain_fits(Logged(*without_strays(record)), FitStart(healthy, healthy.bulk_modulus))
    assert balances_mass(plain.best.model)
    assert plain.best.chi_square[0] < 1.1  # a search that was stopped too early left 1.35
    assert plain.explains(plain.best)
    assert plain.best.values["bulk_modulus"] == pytest.approx(PUMPED_UP.bulk_modulus, rel=0.005)
