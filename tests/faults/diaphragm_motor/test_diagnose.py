"""Faults of the diaphragm motor, named from its logs."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimation.diaphragm_motor.signature import logged_signature
from faults.diaphragm_motor.diagnose import (
    LEAST_SEPARATION,
    MotorDiagnosis,
    _converted_to_model,
    diagnose_motor,
    separations,
)
from faults.diaphragm_motor.faults import HEALTHY, MOTOR_FAULTS, motor_with_fault
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import BENCH_SENSORS, ELECTRODES, SAMPLE_TIME, motor_drive, simulate_motor
from plant.errors import LogError
from plant.log.record import Record

MOTOR = DiaphragmMotorParameters(load_force=10.0)
SINGLE = {
    "valve_1_leak": 0.05,
    "valve_4_leak": 0.05,
    "valve_5_leak": 1.0,
    "valve_6_blocked": 0.5,
    "diaphragm_4_depolarised": 1.0,
    "diaphragm_2_depolarised": 0.2,
    "electrode_4_gain": -0.2,
    "chamber_4_gas": 0.02,
    "gas_everywhere": 0.02,
    "cylinder_leakage": 2e-12,
    "clogged_ports": 0.3,
    "slow_valves": 0.5,
}
QUICK = ("valve_1_leak", "diaphragm_2_depolarised", "electrode_4_gain", "cylinder_leakage")
OTHER = replace(
    MOTOR,
    inertance=0.97 * MOTOR.inertance,
    diaphragm_compliance=1.03 * MOTOR.diaphragm_compliance,
    sensor_gain=(0.97, 1.02, 1.0, 0.98, 1.03, 1.0, 0.99),
)


def log_of(p: DiaphragmMotorParameters, seed: int = 1, swing: float = 200.0) -> Record:
    drive = motor_drive(480.0, swing, 0.2, SAMPLE_TIME)
    return simulate_motor(p, drive, SAMPLE_TIME, sensors=BENCH_SENSORS, rng=np.random.default_rng(seed))


def diagnosed(name: str, severity: float, seed: int = 1) -> MotorDiagnosis:
    return diagnose_motor(log_of(motor_with_fault(MOTOR, name, severity), seed), MOTOR)


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in SINGLE]
)
def test_every_single_fault_is_named_with_its_severity(name: str) -> None:
    found = diagnosed(name, SINGLE[name])
    assert [match.name for match in found.group] == [name]
    assert found.best.interval[0] <= SINGLE[name] <= found.best.interval[1]
    assert not found.unknown


def test_a_healthy_motor_is_healthy() -> None:
    found = diagnose_motor(log_of(MOTOR), MOTOR)
    assert (found.best.name, found.unknown, found.lookalikes) == (HEALTHY, False, ())
    assert found.best.probability > 0.9


def test_odds_of_a_fault_are_prior_times_likelihood_times_the_share_of_severities_left() -> None:
    found = diagnose_motor(log_of(MOTOR), MOTOR)
    share = {match.name: match for match in found.matches}
    assert (share[HEALTHY].severity, share[HEALTHY].interval) == (0.0, (0.0, 0.0))
    kinds = [fault.kind for fault in MOTOR_FAULTS.values()]
    told = 0
    for name, fault in MOTOR_FAULTS.items():
        match, healthy = share[name], share[HEALTHY]
        reach = fault.severities[-1] - fault.severities[0]
        left = min(1.0, math.sqrt(2.0 * math.pi) * match.deviation / reach)
        prior = 0.5 / len(set(kinds)) / kinds.count(fault.kind) / 0.5
        if match.probability > 1e-12:
            odds = prior * left * math.exp(-0.5 * (match.chi_square - healthy.chi_square))
            assert match.probability / healthy.probability == pytest.approx(odds, rel=1e-6)
            told += left < 1.0
    assert told > 3


@pytest.mark.parametrize("name", ["friction", pytest.param("load", marks=pytest.mark.slow)])
def test_friction_and_load_are_named_together(name: str) -> None:
    found = diagnosed(name, 8.0)
    assert {match.name for match in found.group} == {"friction", "load"}
    assert all(abs(match.severity - 8.0) < 3.0 * match.deviation for match in found.group)


@pytest.mark.parametrize(
    ("name", "severity", "other"),
    [
        ("soft_clamp", 0.2, "gas_everywhere"),
        pytest.param("gas_everywhere", 0.02, "soft_clamp", marks=pytest.mark.slow),
        ("clogged_ports", 0.3, "load"),
    ],
)
def test_faults_with_similar_signatures_are_reported_as_lookalikes(name: str, severity: float, other: str) -> None:
    found = diagnosed(name, severity)
    assert found.best.name == name
    assert other in found.lookalikes
    assert "valve_4_leak" not in found.lookalikes


@pytest.mark.slow
def test_only_friction_and_load_are_indistinguishable() -> None:
    apart = separations(MOTOR, 480.0, 200.0, {**SINGLE, "friction": 8.0, "load": 8.0, "soft_clamp": 0.2})
    close = {
        (first, other) for first, others in apart.items() for other, far in others.items() if far < LEAST_SEPARATION
    }
    assert close == {("friction", "load"), ("load", "friction")}


@pytest.mark.slow
def test_two_faults_at_once_are_unknown() -> None:
    both = motor_with_fault(motor_with_fault(MOTOR, "valve_2_leak", 0.3), "diaphragm_6_depolarised", 0.5)
    assert diagnose_motor(log_of(both), MOTOR).unknown


def test_a_fault_of_another_motor_is_unknown_without_a_healthy_run_of_that_motor() -> None:
    faulty = log_of(motor_with_fault(OTHER, "chamber_3_gas", 0.02))
    assert diagnose_motor(faulty, MOTOR).unknown
    found = diagnose_motor(faulty, MOTOR, calibration=logged_signature(log_of(OTHER, 2)))
    assert (found.best.name, found.unknown) == ("chamber_3_gas", False)


@pytest.mark.slow
def test_a_healthy_run_under_another_drive_is_refused() -> None:
    calibration = logged_signature(log_of(MOTOR, swing=150.0))
    with pytest.raises(LogError, match="the healthy run must be under the log's drive"):
        diagnose_motor(log_of(MOTOR), MOTOR, calibration=calibration)


@pytest.mark.slow
def test_95_percent_of_faults_are_named_on_motors_within_tolerance() -> None:
    from benchmarks.plants.diaphragm_faults import isolation_shares

    share, unknown, *_ = isolation_shares(4, 1.0, calibrated=False)
    assert share >= 0.95
    assert unknown <= 0.05


def test_a_healthy_run_under_another_drive_or_of_a_faulty_motor_is_refused() -> None:
    seen = logged_signature(log_of(MOTOR))
    for swing in (180.0, 220.0):
        with pytest.raises(LogError, match="the healthy run must be under the log's drive"):
            _converted_to_model(seen, logged_signature(log_of(MOTOR, swing=swing)), MOTOR)
    dead = replace(seen, values=np.where(np.arange(len(seen.values)) % 7 == 3, 0.01, seen.values))
    with pytest.raises(LogError, match="it is not of a healthy motor"):
        _converted_to_model(seen, dead, MOTOR)


@pytest.mark.parametrize(
    ("name", "severity"), [(HEALTHY, 0.0), pytest.param("valve_4_leak", 0.3, marks=pytest.mark.slow)]
)
def test_a_channel_of_the_wrong_sign_or_name_is_refused_with_what_to_write(name: str, severity: float) -> None:
    log = log_of(MOTOR if name == HEALTHY else motor_with_fault(MOTOR, name, severity))
    first, third = log["electrode_1_v"], log["electrode_3_v"]
    for made, said in (
        (log.replace(electrode_1_v=-first), "electrode_1_v has the opposite sign: say so"),
        (log.replace(electrode_1_v=third, electrode_3_v=first), "electrode_1_v and electrode_3_v are swapped: say so"),
    ):
        with pytest.raises(LogError, match=said):
            diagnose_motor(made, MOTOR)


@pytest.mark.parametrize("delay", [4e-5, pytest.param(-1e-4, marks=pytest.mark.slow)])
def test_the_delay_of_all_electrodes_is_named_and_a_healthy_run_takes_it_out(delay: float) -> None:
    log = log_of(motor_with_fault(MOTOR, "valve_4_leak", 0.3))
    time = log.sample_time * np.arange(len(log))

    def late(one: Record) -> Record:
        return one.replace(**{name: np.interp(time - delay, time, one[name]) for name in ELECTRODES})

    found = diagnose_motor(late(log), MOTOR)
    assert found.unknown
    assert found.delay == pytest.approx(delay, abs=2e-6)
    calibrated = diagnose_motor(late(log), MOTOR, calibration=logged_signature(late(log_of(MOTOR, 2))))
    assert (calibrated.best.name, calibrated.unknown, calibrated.delay) == ("valve_4_leak", False, None)
