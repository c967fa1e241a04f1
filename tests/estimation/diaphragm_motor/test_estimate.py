"""Leakage, load and gas of the diaphragm motor, and what cannot be determined."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.diaphragm_motor.card import flow_change, motor_card
from estimation.diaphragm_motor.estimate import MotorEstimate, estimate_motor
from estimation.diaphragm_motor.signature import (
    TOLERANCE,
    logged_signature,
    modelled_signature,
    steady_drive,
    tolerance,
)
from estimation.trust.card import sentences
from plant.diaphragm_motor.flow import pump_alone
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters, with_changed_value
from plant.diaphragm_motor.run import BENCH_SENSORS, SAMPLE_TIME, Schedule, motor_drive, simulate_motor
from plant.errors import LogError
from plant.log.record import Record

MOTOR = DiaphragmMotorParameters()


def log_of(
    p: DiaphragmMotorParameters | Schedule, seconds: float = 0.3, seed: int = 1, frequency: float = 480.0
) -> Record:
    drive = motor_drive(frequency, 200.0, seconds, SAMPLE_TIME)
    return simulate_motor(p, drive, SAMPLE_TIME, sensors=BENCH_SENSORS, rng=np.random.default_rng(seed))


def estimated(seconds: float = 0.3, **values: float) -> MotorEstimate:
    return estimate_motor(log_of(replace(MOTOR, **values), seconds), MOTOR)


@pytest.mark.parametrize("frequency", [480.0, pytest.param(437.3, marks=pytest.mark.slow)])
def test_the_signature_of_a_log_agrees_with_that_of_the_model(frequency: float) -> None:
    seen = logged_signature(log_of(MOTOR, frequency=frequency))
    assert seen.drive.frequency == pytest.approx(frequency, rel=1e-9)
    assert seen.drive.peak_to_peak == pytest.approx(200.0, rel=1e-9)
    off = seen.values - modelled_signature(MOTOR, frequency, 200.0)
    assert np.all(np.abs(off) < 0.5 * np.sqrt(np.diag(tolerance(MOTOR, frequency, 200.0))))


@pytest.mark.slow
def test_the_covariance_of_a_signature_agrees_with_its_scatter() -> None:
    logs = [logged_signature(log_of(MOTOR, 0.2, seed)) for seed in range(40)]
    scatter = np.var([one.values for one in logs], axis=0, ddof=1) / np.diag(logs[0].covariance)
    assert 0.8 < float(np.mean(scatter)) < 1.25


def test_the_velocitys_deviation_agrees_with_its_scatter_under_position_noise() -> None:
    log, rng = log_of(MOTOR, 0.2), np.random.default_rng(2)
    noise = [1e-5 * rng.standard_normal(len(log)) for _ in range(30)]
    seen = [logged_signature(log.replace(position_m=log["position_m"] + one)) for one in noise]
    said = float(np.sqrt(seen[0].covariance[-1, -1]))
    assert 0.7 < np.std([one.values[-1] for one in seen], ddof=1) / said < 1.4


def test_one_parameter_off_by_its_tolerance_shifts_the_signature_by_under_one_deviation() -> None:
    covariance = tolerance(MOTOR, 480.0, 200.0)
    base = modelled_signature(MOTOR, 480.0, 200.0)
    for name, share in TOLERANCE.items():
        moved = replace(MOTOR, **{name: (1.0 + share) * getattr(MOTOR, name)})
        off = modelled_signature(moved, 480.0, 200.0) - base
        assert 0.3 < np.sqrt(off @ np.linalg.solve(covariance, off)) < 1.0, name


@pytest.mark.parametrize(
    ("load", "leakage"),
    [
        (10.0, 2e-12),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in ((10.0, 5e-12), (20.0, 2e-12), (20.0, 5e-12))),
    ],
)
def test_leakage_and_load_are_found_without_pressure_or_flow(load: float, leakage: float) -> None:
    found = estimated(load_force=load, crossport_leakage=leakage)
    assert found.values["crossport_leakage"] == pytest.approx(leakage, rel=0.15, abs=0.0)
    assert found.values["load_force"] == pytest.approx(load, abs=1.0)
    assert found.track.alarm_time is not None
    assert found.pattern_holds


@pytest.mark.parametrize(("before", "after"), [(5.0, 15.0), pytest.param(20.0, 0.0, marks=pytest.mark.slow)])
def test_a_load_step_is_followed_and_raises_no_alarm(before: float, after: float) -> None:
    steps = ((0.0, replace(MOTOR, load_force=before)), (0.27, replace(MOTOR, load_force=after)))
    found = estimate_motor(log_of(steps, 0.6), MOTOR)
    assert found.track.alarm_time is None
    assert found.track.held.any()
    assert found.track.load[0] == pytest.approx(before, abs=1.0)
    assert found.values["load_force"] == pytest.approx(after, abs=1.0)


@pytest.mark.slow
def test_a_sudden_leak_raises_an_alarm_within_a_quarter_second() -> None:
    tight = replace(MOTOR, load_force=15.0)
    found = estimate_motor(log_of(((0.0, tight), (0.3, replace(tight, crossport_leakage=4e-12))), 0.7), MOTOR)
    assert found.track.alarm_time is not None
    assert 0.3 < found.track.alarm_time < 0.55


@pytest.mark.slow
def test_gas_in_every_chamber_is_estimated() -> None:
    gassy = replace(MOTOR, load_force=10.0, gas_fraction=(0.01,) * 7)
    found = estimate_motor(log_of(gassy), MOTOR)
    assert found.values["gas_fraction"] == pytest.approx(0.01, rel=0.2)
    assert found.pattern_holds
    assert found.values["load_force"] == pytest.approx(10.0, abs=1.0)


def test_a_faulty_pump_breaks_the_pattern_of_its_electrodes() -> None:
    leaking = replace(MOTOR, load_force=10.0, valve_leak=with_changed_value(MOTOR.valve_leak, 4, 0.2))
    assert not estimate_motor(log_of(leaking), MOTOR).pattern_holds


@pytest.mark.slow
def test_a_healthy_run_sets_the_gains_and_narrows_the_interval() -> None:
    gains = replace(MOTOR, load_force=10.0, sensor_gain=(1.0, 1.0, 1.0, 0.98, 1.0, 1.0, 1.0))
    leaking = log_of(replace(gains, crossport_leakage=2e-12), seed=2)
    plain = estimate_motor(leaking, replace(MOTOR, load_force=10.0))
    found = estimate_motor(leaking, replace(MOTOR, load_force=10.0), calibration=logged_signature(log_of(gains)))
    assert abs(plain.values["crossport_leakage"] - 2e-12) > 0.5e-12
    assert found.values["crossport_leakage"] == pytest.approx(2e-12, rel=0.15)
    assert found.deviations["crossport_leakage"] < 0.5 * plain.deviations["crossport_leakage"]


def test_bulk_modulus_is_not_observable() -> None:
    card = motor_card(replace(MOTOR, load_force=10.0), 480.0, 200.0)
    assert card.relative_std["bulk_modulus"] > 0.9
    assert card.relative_std["gas_fraction"] < 0.5
    assert "bulk modulus (95 %)" in sentences(card)[0]
    for factor in (0.5, 2.0):
        assert 0.0 < abs(flow_change(pump_alone(MOTOR), 480.0, 200.0, factor)) < 1e-3


def test_a_drive_other_than_a_steady_sine_within_the_voltage_limit_is_refused() -> None:
    time = SAMPLE_TIME * np.arange(5000)
    with pytest.raises(LogError, match="must be a steady sine"):
        steady_drive(100.0 * np.sin(2.0 * np.pi * (400.0 + 500.0 * time) * time), SAMPLE_TIME)
    with pytest.raises(LogError, match="got no swing"):
        steady_drive(np.zeros(5000), SAMPLE_TIME)
    with pytest.raises(LogError, match="the diaphragms take 150 V"):
        steady_drive(200.0 * np.sin(2.0 * np.pi * 400.0 * time), SAMPLE_TIME)


def test_a_log_with_a_missing_channel_too_few_cycles_or_missing_samples_is_refused() -> None:
    log = log_of(MOTOR, 0.2)
    with pytest.raises(LogError, match="electrode_3_v is needed"):
        logged_signature(log.replace(electrode_3_v=None))
    with pytest.raises(LogError, match=r"20 cycles of 480 Hz are needed after the first 0\.1 s, got 9"):
        logged_signature(log_of(MOTOR, 0.12))
    with pytest.raises(LogError, match=r"longer than the 0\.1 s"):
        logged_signature(log_of(MOTOR, 0.08))
    position = log["position_m"].copy()
    position[7000] = np.nan
    with pytest.raises(LogError, match="position_m must be whole, got 1"):
        estimate_motor(log.replace(position_m=position), MOTOR)
