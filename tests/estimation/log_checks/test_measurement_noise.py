"""The noise of a channel is read from the log, whatever the motion beneath it (errata E11)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimation.log_checks.measurement_noise import (
    SMALLEST_VARIANCE,
    excited_noise_variance,
    measurement_variances,
    noise_behind_motion,
    position_variance,
)
from estimation.log_checks.outliers import without_gross_outliers
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.eha.drives import make_drive
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, drop_samples, noise_variances

NOISY = ("velocity_m_s", "differential_pressure_pa")


def variance_of(channel: str, values: np.ndarray) -> float:
    return measurement_variances(Record(1e-3, {channel: values}), [channel])[channel]


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_the_bench_noise_is_found_while_the_piston_moves(condition: Condition) -> None:
    p = parameters_for(condition)
    rng = np.random.default_rng(1)
    drive = make_drive("steps", 10.0, 1e-3, p, rng)
    record = simulate(LUMPED, drive, 1e-3, p, sensors=BENCH, rng=rng)
    found, true = measurement_variances(record, NOISY), noise_variances(BENCH)
    for channel in NOISY:
        assert found[channel] == pytest.approx(true[channel], rel=0.1)


@given(st.floats(1e-3, 1e3))
def test_the_estimate_scales_with_the_unit(factor: float) -> None:
    noise = np.random.default_rng(2).normal(0.0, 1e-2, 2_000)
    assert variance_of("velocity_m_s", factor * noise) == pytest.approx(
        factor**2 * variance_of("velocity_m_s", noise), rel=1e-9
    )


def test_a_few_jumps_and_a_trend_do_not_change_the_variance() -> None:
    rng = np.random.default_rng(3)
    noise = rng.normal(0.0, 1e-3, 20_000)
    jumps = np.cumsum(np.where(rng.random(20_000) < 1e-3, 0.1, 0.0))
    assert variance_of("velocity_m_s", noise + jumps + np.linspace(0.0, 5.0, 20_000)) == pytest.approx(1e-6, rel=0.05)


def test_missing_samples_do_not_change_the_variance() -> None:
    record = Record(1e-3, {"velocity_m_s": np.random.default_rng(4).normal(0.0, 1e-3, 20_000)})
    gappy = drop_samples(record, 0.05, np.random.default_rng(5))
    assert variance_of("velocity_m_s", gappy["velocity_m_s"]) == pytest.approx(1e-6, rel=0.05)


@pytest.mark.parametrize("channel", SMALLEST_VARIANCE)
@pytest.mark.parametrize("values", [np.zeros(100), np.full(100, 3.0), np.full(100, np.nan), np.arange(2.0)])
def test_a_silent_channel_gets_the_smallest_variance_and_not_zero(channel: str, values: np.ndarray) -> None:
    assert variance_of(channel, values) == SMALLEST_VARIANCE[channel]


def test_a_coarse_converter_has_its_quantisation_noise_though_most_samples_repeat() -> None:
    pressure = 4e5 * np.sin(2.0 * np.pi * np.arange(10_000) / 5_000.0)
    quantised = 1e4 * np.round(pressure / 1e4)
    assert variance_of("differential_pressure_pa", quantised) == pytest.approx(1e8 / 12.0, rel=1e-9)


@pytest.mark.parametrize("step", [0.1, 0.3, 0.5, 0.7, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0])
def test_noise_is_found_through_a_converters_rounding(step: float) -> None:
    rng = np.random.default_rng(6)
    noisy = 300.0 * np.sin(np.arange(40_000) * 1.3e-3) + rng.normal(0.0, 1.0, 40_000)
    held = np.sqrt(1.0 + step**2 / 12.0)  # a converter that rounds adds noise of its own
    found = np.sqrt(variance_of("velocity_m_s", step * np.round(noisy / step)))
    assert found / held == pytest.approx(1.0, abs=0.04 if step <= 2.5 else 0.13)


def test_a_ramp_with_a_spike_in_every_tenth_sample_has_the_smallest_variance() -> None:
    rare = np.zeros(5_000)
    rare[::10] = 1.0
    assert variance_of("velocity_m_s", rare + 1e-4 * np.arange(5_000)) == SMALLEST_VARIANCE["velocity_m_s"]


def test_a_noiseless_ramp_is_not_taken_for_quantised() -> None:
    assert variance_of("position_m", 4e-5 * np.arange(1_000)) == SMALLEST_VARIANCE["position_m"]


def test_the_noise_of_a_slow_sensor_is_that_of_its_own_samples() -> None:
    noise = np.random.default_rng(2).normal(0.0, 5e3, 2_000)
    slow = np.full(20_000, np.nan)
    slow[7::10] = noise
    assert variance_of("differential_pressure_pa", slow) == variance_of("differential_pressure_pa", noise)
    steps = np.round(np.linspace(0.0, 1e-3, 2_000) / 1e-6) * 1e-6
    slow[7::10] = steps
    assert position_variance(slow) == position_variance(steps)


def test_position_noise_of_about_a_quantum_is_not_taken_for_the_quantum_alone() -> None:
    rng = np.random.default_rng(3)
    moved = 0.02 * np.sin(2.0 * np.pi * 5.0 * 1e-3 * np.arange(20_000)) + rng.normal(0.0, 5e-5, 20_000)
    variance = position_variance(np.round(moved / 5e-5) * 5e-5)
    assert variance == pytest.approx(5e-5**2 * (1.0 + 1.0 / 12.0), rel=0.1)


@pytest.mark.parametrize("position", [np.zeros(100), np.full(100, np.nan), np.arange(3.0)])
def test_a_still_missing_or_very_short_position_has_the_smallest_variance(position: np.ndarray) -> None:
    assert position_variance(position) == SMALLEST_VARIANCE["position_m"]


def test_the_variance_is_measured_anew_for_each_log() -> None:
    noise = np.random.default_rng(2).normal(0.0, 1e-3, 2000)
    one, other = (
        measurement_variances(Record(1e-3, {"velocity_m_s": k * noise}), ["velocity_m_s"]) for k in (1.0, 2.0)
    )
    assert other["velocity_m_s"] == pytest.approx(4.0 * one["velocity_m_s"], rel=1e-9)
    assert position_variance(2.0 * noise) == pytest.approx(4.0 * position_variance(noise), rel=1e-9)


def test_impacts_of_a_binary_drive_are_not_taken_for_noise() -> None:
    rng = np.random.default_rng(3)
    blows = np.zeros(15_000)
    blows[::20] = rng.choice((-1.0, 1.0), 750)
    time = 1e-3 * np.arange(200)
    rung = np.exp(-40.0 * time) * np.sin(2.0 * np.pi * 60.0 * time)
    struck = 1e5 * np.convolve(blows, rung)[:15_000] + rng.normal(0.0, 5e3, 15_000)
    assert 0.9 * 25e6 < excited_noise_variance(struck) < 1.2 * 25e6  # seven of twenty differences include a blow
    channel = "differential_pressure_pa"
    assert measurement_variances(Record(1e-3, {channel: struck}), [channel])[channel] > 1.5 * 25e6
    assert excited_noise_variance(np.where(np.arange(15_000) % 40 == 7, np.nan, struck)) == pytest.approx(25e6, rel=0.3)


@pytest.mark.parametrize("steps", [1.0, 2.0, 2.4, 3.0])
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.5])
def test_noise_of_a_coarse_converter_is_found_at_any_rest_position_between_its_steps(
    steps: float, phase: float
) -> None:
    rng, step = np.random.default_rng(5), steps * 5e3
    rests = 5.0 * step * np.repeat(rng.integers(-3, 4, 40), 500) + phase * step  # a drive of steps
    read = step * np.rint((rests + rng.normal(0.0, 5e3, len(rests))) / step)
    true = np.std(read - rests)
    assert variance_of("differential_pressure_pa", read) ** 0.5 == pytest.approx(true, rel=0.13)
    assert excited_noise_variance(read) ** 0.5 == pytest.approx(true, rel=0.13)


def test_a_converter_that_flickers_between_two_levels_has_no_gross_outliers() -> None:
    rng, channel = np.random.default_rng(6), "differential_pressure_pa"
    pressure = 2e4 * np.rint((2e5 * np.sin(1e-2 * np.arange(10_000)) + rng.normal(0.0, 2e3, 10_000)) / 2e4)
    cleaned, said = without_gross_outliers(Record(1e-3, {channel: pressure}), [channel])
    assert not said
    assert not np.isnan(cleaned[channel]).any()


@pytest.mark.parametrize("values", [np.zeros(100), np.arange(5.0), np.full(100, np.nan)])
def test_a_channel_without_noise_has_an_infinite_struck_variance(values: np.ndarray) -> None:
    assert excited_noise_variance(values) == np.inf


def test_the_variance_of_white_noise_scatters_little_more_than_that_of_all_differences() -> None:
    """By the median alone it scattered by 2.9 over the root of the samples, and sound logs of 2 s were refused."""
    rng, samples = np.random.default_rng(4), 1000
    found = [variance_of("velocity_m_s", noise) for noise in rng.normal(size=(400, samples))]
    assert np.mean(found) == pytest.approx(1.0, abs=0.015)
    assert np.std(found) * samples**0.5 < 2.4


@pytest.mark.parametrize(("share", "largest"), [(0.2, 1.8), (0.4, 2.4)])
def test_differences_that_are_not_normal_leave_the_variance_to_their_median(share: float, largest: float) -> None:
    """Where the signal is ten times as loud for part of a log, the mean square of differences is far off."""
    rng = np.random.default_rng(5)
    loud = np.where(np.arange(4000) < share * 4000, 3.0, 1.0) * rng.normal(size=4000)
    assert variance_of("velocity_m_s", loud) < largest


@pytest.mark.parametrize(("ringing", "lower"), [(0.0, False), (3.0, False), (30.0, True)])
def test_sixth_differences_tell_the_noise_only_where_they_are_lower_by_more_than_chance(
    ringing: float, lower: float
) -> None:
    rng = np.random.default_rng(6)
    for _ in range(20):
        values = ringing * np.sin(2.0 * np.pi * 0.05 * np.arange(2000)) + rng.normal(size=2000)
        variance = variance_of("velocity_m_s", values)
        found = noise_behind_motion(values, variance)
        assert found == (excited_noise_variance(values) if lower else variance)
