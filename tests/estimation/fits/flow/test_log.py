"""Effect of encoder noise on a fit of the flow form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.eha.explanation_notes import total_delay
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import STIFFEST_OIL, _swept_share, flow_log, speed_gaps, with_random_walk, without_strays
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.problem import Problem
from estimation.log_checks.measurement_noise import noise_behind_motion
from estimation.models.flow import FLOW_FORM, STIFFNESS
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters, piston_areas
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

HEALTHY = EhaParameters()
NOISY = replace(BENCH, position_noise=3e-5, position_quantum=1e-5)
"""A position sensor such as many rigs have; the reference bench has an encoder of 1 um."""


def log(condition: str, seed: int, duration: float = 6.0) -> tuple[Record, float]:
    rng = np.random.default_rng(seed)
    p = circuit_of(parameters_for(CONDITIONS[condition]))
    record = simulate(CIRCUIT, make_drive("steps", duration, 1e-3, p, rng), 1e-3, p, sensors=NOISY, rng=rng)
    return record, p.bulk_modulus


def deviations(record: Record, true: float) -> float:
    fit = fit_flow(record, HEALTHY, 2e8)
    value, std = fit.parameters["bulk_modulus"]
    assert fit.reasons == ()
    assert fit.explanation is None
    assert value == pytest.approx(true, rel=0.015)
    return (value - true) / std


@pytest.mark.parametrize("condition", thinned(["normal", "major_leakage"], ["normal"]))
def test_position_noise_is_not_mistaken_for_soft_oil(condition: str, monkeypatch: pytest.MonkeyPatch) -> None:
    record, true = log(condition, 5, duration=4.0)
    assert abs(deviations(record, true)) < 3.0
    monkeypatch.setattr("estimation.fits.flow.log.FELT_NOISE", np.inf)  # as if all noise came from the pressure sensor
    value, std = fit_flow(record, HEALTHY, 2e8).parameters["bulk_modulus"]
    assert value < true - 5.0 * std


@pytest.mark.slow
def test_position_noise_is_not_mistaken_for_soft_oil_if_speeds_are_missing() -> None:
    record, true = log("minor_leakage", 6)
    speed = record["motor_speed_rad_s"].copy()
    for reversal in np.flatnonzero(np.abs(np.diff(speed)) > 30.0)[::5]:
        speed[reversal : reversal + 3] = np.nan
    assert flow_log(*_sound(record.replace(motor_speed_rad_s=speed))).gaps.size
    assert abs(deviations(record.replace(motor_speed_rad_s=speed), true)) < 3.0


def test_position_noise_is_included_if_it_is_significant_beside_pressure_noise() -> None:
    record, _ = log("normal", 7, duration=4.0)
    noisy = flow_log(*_sound(record))
    assert noisy.passes_on
    assert noisy.noise[0].passed_on == pytest.approx(
        HEALTHY.piston_area / HEALTHY.chamber_volume * np.hypot(3e-5, 1e-5 / 12.0**0.5), rel=0.1
    )
    rng = np.random.default_rng(8)
    drive = make_drive("steps", 4.0, 1e-3, HEALTHY, rng)
    quiet = flow_log(*_sound(simulate(CIRCUIT, drive, 1e-3, circuit_of(HEALTHY), sensors=BENCH, rng=rng)))
    assert not quiet.passes_on
    assert quiet.block < noisy.block


def lagging(values: np.ndarray, lag: float) -> np.ndarray:
    """Return the output of a sensor with a first-order lag [s] for samples 1 ms apart."""
    kept = np.exp(-1e-3 / lag)
    return lfilter([1.0 - kept], [1.0, -kept], values, zi=[kept * values[0]])[0]


@pytest.mark.parametrize("condition", ["normal", pytest.param("minor_friction", marks=pytest.mark.slow)])
def test_a_lagging_position_sensor_is_identified_and_bulk_modulus_is_right(condition: str) -> None:
    rng = np.random.default_rng(9)
    p = circuit_of(parameters_for(CONDITIONS[condition]))
    drive = make_drive("prbs", 1.2, 1e-3, p, rng)
    record = simulate(CIRCUIT, drive, 1e-3, p, sensors=BENCH, rng=rng)
    fit = fit_flow(record.replace(position_m=lagging(record["position_m"], 3e-3)), HEALTHY, 2e8)
    assert fit.reasons == ()
    assert fit.explanation is not None
    assert fit.explanation.names == ("position_late",)
    kept = np.exp(-1.0 / 3.0)  # share kept in each step of 1 ms: a slow signal is late by kept / (1 - kept) steps
    assert total_delay(fit.explanation, "position_m") == pytest.approx(1e-3 * kept / (1.0 - kept), abs=1e-4)
    value, std = fit.parameters["bulk_modulus"]
    assert value == pytest.approx(HEALTHY.bulk_modulus, abs=3.0 * std)


@pytest.mark.parametrize("kind", [Problem, FreedProblem.of])
def test_the_gradient_of_the_cost_includes_the_change_of_the_variance(kind: type[Problem]) -> None:
    record, true = log("normal", 7, duration=4.0)
    problem = kind(FLOW_FORM, flow_log(*_sound(record)))
    start = {
        "bulk_modulus": true,
        "leakage_coefficient": HEALTHY.leakage_coefficient,
        "flow_bias": HEALTHY.flow_bias,
        "makeup_conductance": 1e-9,
        "makeup_opening": 7e3,
        "case_leakage": 2.4e-13,
        "speed_lead": 1e-5,
        STIFFNESS: 0.0,
    }
    theta = problem.model.theta(start)
    for unknown, least in (("bulk_modulus", 0.05), ("leakage_coefficient", 0.0)):
        place = problem.model.unknowns.index(unknown)
        step = 1e-3 * np.eye(len(theta))[place]
        slope = (problem.at(theta + step).cost - problem.at(theta - step).cost) / 2e-3
        gradient = problem.at(theta).gradient[place]
        assert gradient == pytest.approx(slope, rel=0.01)
        held = gradient + problem.untilted(theta, problem.residuals(theta))[place]
        assert abs(held - gradient) > least * abs(gradient)  # the difference is large enough for this test


def test_passed_on_position_noise_scales_with_modulus_over_volume_and_decays_with_leakage() -> None:
    """Otherwise oil as stiff as steel, or twice the volume with twice the modulus, would explain any leaky actuator."""
    noise = flow_log(*_sound(log("normal", 7, duration=4.0)[0])).noise[0]

    def passed(modulus: float, volume: float = 1.0, leakage: float = 1e-10, case: float = 0.0) -> float:
        values = {"bulk_modulus": modulus, "leakage_coefficient": leakage, "case_leakage": case}
        return noise.passed_noise({**values, "chamber_volume": volume * HEALTHY.chamber_volume})[0]

    assert passed(2e8, leakage=0.0) == pytest.approx(2e8 * noise.passed_on)
    assert passed(4e8, 2.0) == pytest.approx(passed(2e8))
    assert passed(1e14) == pytest.approx(passed(1e12), rel=0.01)
    assert passed(1e14, leakage=0.0, case=1e-10) == pytest.approx(passed(1e14))
    assert passed(1e14, leakage=2e-10) == pytest.approx(0.5 * passed(1e14), rel=0.01)


def _sound(record: Record) -> tuple[Record, EhaParameters, dict[str, float], dict[str, float]]:
    sound, variances = without_strays(record)
    return sound, HEALTHY, {}, dict(variances)


@pytest.mark.parametrize("difference", [0.0, 0.2])
def test_the_swept_share_is_the_rms_slope_of_the_logarithms_of_chamber_volumes(difference: float) -> None:
    p = replace(HEALTHY, area_difference=difference)
    area_1, area_2 = piston_areas(p)
    position, step = 0.01 * np.sin(0.1 * np.arange(200)), 1e-7

    def squeezed(x: np.ndarray) -> np.ndarray:
        volume = 2.0 * p.chamber_volume
        return np.log(volume + area_1 * x) - np.log(volume - area_2 * x)

    slope = (squeezed(position + step) - squeezed(position - step)) / (2.0 * step)
    assert _swept_share(position, p) == pytest.approx(np.sqrt(np.mean(slope**2)), rel=1e-5)


def test_pump_flow_across_a_gap_is_that_of_piston_travel_and_oil_compression() -> None:
    p = circuit_of(HEALTHY)
    rng = np.random.default_rng(31)
    record = simulate(CIRCUIT, make_drive("prbs", 3.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    true = record["motor_speed_rad_s"]
    reversals = np.flatnonzero(np.abs(np.diff(true)) > 50.0)
    first = int(reversals[reversals > 500][0]) - 20
    gap = slice(first, first + 100)
    lost = {name: record[name].copy() for name in ("motor_speed_rad_s", "position_m", "differential_pressure_pa")}
    for values in lost.values():
        values[gap] = np.nan
    seen = flow_log(*_sound(record.replace(**lost)))
    assert len(seen.gaps) == 1
    turned = float(np.sum(true[gap])) * 1e-3
    line = float(np.sum(np.linspace(true[first - 1], true[first + 100], 102)[1:-1])) * 1e-3
    delivered = float(np.sum(seen.drives[gap, 0])) * 1e-3
    assert abs(delivered - turned) < 0.1 * abs(line - turned)


def test_speed_noise_accumulates_in_stiff_oil_that_hardly_leaks() -> None:
    record, true = log("normal", 7)
    seen = flow_log(*_sound(record))
    loud = seen.drives.copy()
    loud[:, 0] += np.random.default_rng(1).normal(0.0, 0.5, len(loud))
    seen = replace(seen, drives=loud, drive_std=(0.5, 0.0))
    found = {"bulk_modulus": 10.0 * true, "leakage_coefficient": HEALTHY.leakage_coefficient}
    stiff, stiffer = (
        with_random_walk(seen, HEALTHY, {**found, "bulk_modulus": times * true}).noise[0] for times in (10.0, 20.0)
    )
    kept = 10.0 * true / HEALTHY.chamber_volume * HEALTHY.pump_displacement
    noise = noise_behind_motion(seen.drives[:, 0], seen.drive_std[0] ** 2)
    assert stiff.walk == pytest.approx(kept**2 * noise * seen.sample_time)
    assert stiffer.walk == pytest.approx(4.0 * stiff.walk)
    assert (
        with_random_walk(seen, HEALTHY, {**found, "bulk_modulus": 1e3 * true}, stiffest=10.0 * true).noise[0] == stiff
    )
    steel = with_random_walk(seen, HEALTHY, {**found, "bulk_modulus": 1e3 * true}).noise[0]
    assert steel.walk == pytest.approx((STIFFEST_OIL / (10.0 * true)) ** 2 * stiff.walk)
    assert replace(stiff, walk=0.0) == seen.noise[0]
    assert with_random_walk(seen, HEALTHY, {**found, "leakage_coefficient": 1e4 * HEALTHY.leakage_coefficient}) is seen


def test_speeds_missing_at_an_end_of_a_log_are_uncertain_by_half_the_adjacent_slope() -> None:
    n, at = 30, 1e-3
    speed = 10.0 * np.arange(n, dtype=float)
    speed[:3] = speed[-3:] = np.nan
    gaps = speed_gaps(Record(at, {"motor_speed_rad_s": speed}), HEALTHY, 0.0)
    # a missing end is held, so half the slope of 10 rad/s per sample is uncertain over four intervals
    volume = 0.5 * (0.5 * 10.0 * 4) * 3 * at * HEALTHY.pump_displacement
    variance = (HEALTHY.bulk_modulus / HEALTHY.chamber_volume * volume) ** 2 / 4
    assert gaps.tolist() == [[0.0, 3.0, pytest.approx(variance)], [n - 3.0, n - 1.0, pytest.approx(variance)]]


def test_a_drain_is_doubted_as_far_as_leakage_reaches() -> None:
    """A worn pump of a tight actuator drains hundreds of times as much as a sound one; the paper's, twelve times."""
    record, _ = log("normal", 0, 1.0)
    variances = dict.fromkeys((*FLOW_FORM.drives, *FLOW_FORM.outputs), 1e-6)
    usual, tight = (
        flow_log(record, replace(HEALTHY, leakage_coefficient=share * HEALTHY.leakage_coefficient), {}, variances)
        for share in (1.0, 0.02)
    )
    assert usual.presumed["case_leakage"][1] == 1.0
    assert 2.0 < tight.presumed["case_leakage"][1] < 3.0
