from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant.eha.drive_limits import check_drive
from plant.eha.drives import DRIVES, chirp, make_drive, multisine, nine_steps, prbs, sine
from plant.eha.model import EhaParameters
from plant.errors import DriveError

RIG = EhaParameters()
SEEDS = st.integers(0, 2**32 - 1)


def test_the_papers_sine_is_1200_rpm_at_10_hz() -> None:
    speed = make_drive("sine", 1.0, 1e-4, RIG, np.random.default_rng(0))
    spectrum = np.abs(np.fft.rfft(speed)) / len(speed) * 2.0
    assert np.argmax(spectrum) == 10
    assert spectrum[10] == pytest.approx(1200.0 * 2.0 * np.pi / 60.0, rel=1e-12)


def test_a_chirp_sweeps_from_its_lowest_to_its_highest_frequency() -> None:
    sample_time = 1e-4
    speed = chirp(10.0, sample_time, 100.0, lowest=1.0, highest=21.0)
    rises = np.flatnonzero((speed[:-1] < 0.0) & (speed[1:] >= 0.0)) * sample_time
    frequency = 1.0 / np.diff(rises)
    middle = 0.5 * (rises[1:] + rises[:-1])
    np.testing.assert_allclose(frequency, 1.0 + 2.0 * middle, rtol=0.05)
    assert np.max(np.abs(speed)) == pytest.approx(100.0, rel=1e-3)


@given(seed=SEEDS)
@settings(max_examples=20, deadline=None)
def test_prbs_is_binary_with_zero_mean_and_switches_only_on_its_clock(seed: int) -> None:
    speed = prbs(10.0, 1e-3, RIG.rated_speed, 0.05, np.random.default_rng(seed))
    assert set(np.abs(speed)) == {RIG.rated_speed}
    assert abs(speed.sum()) < 1e-9 * np.abs(speed).sum()
    assert np.all((np.flatnonzero(np.diff(speed)) + 1) % 50 == 0)


def test_prbs_has_flat_power_up_to_25_hz_when_held_10_ms_and_a_hole_there_when_held_200_ms() -> None:
    def power_near_25_hz(hold_time: float) -> float:
        speed = prbs(60.0, 1e-3, 1.0, hold_time, np.random.default_rng(1))
        power = np.abs(np.fft.rfft(speed)) ** 2
        frequency = np.fft.rfftfreq(len(speed), 1e-3)
        return float(power[(frequency > 24.0) & (frequency < 26.0)].mean())

    assert power_near_25_hz(0.01) > 5.0 * power_near_25_hz(0.2)


@pytest.mark.parametrize("hold_time", [1e-4, 0.0, np.inf])
def test_a_hold_time_below_the_sample_time_or_infinite_is_refused(hold_time: float) -> None:
    with pytest.raises(DriveError, match="hold_time"):
        prbs(1.0, 1e-3, 1.0, hold_time, np.random.default_rng(0))


@given(seed=SEEDS)
@settings(max_examples=50, deadline=None)
def test_nine_steps_alternate_from_positive_between_their_voltages_and_fit_the_stroke(seed: int) -> None:
    speed = nine_steps(10.0, 1e-3, RIG, np.random.default_rng(seed))
    switches = np.flatnonzero(np.diff(speed)) + 1
    assert len(switches) == 8
    assert set(np.diff(np.concatenate(([0], switches, [len(speed)])))) <= {1111, 1112}
    levels = speed[np.concatenate(([0], switches))] / RIG.motor_speed_per_volt
    assert levels[0] > 0.0
    assert all(a * b < 0.0 for a, b in pairwise(levels))
    assert np.all((np.abs(levels) >= 2.5) & (np.abs(levels) <= 4.0))
    check_drive(speed, 1e-3, RIG)


def test_even_the_worst_nine_steps_over_ten_seconds_fit_the_stroke() -> None:
    worst = RIG.motor_speed_per_volt * np.repeat([4.0, -2.5] * 4 + [4.0], 1112)
    check_drive(worst, 1e-3, RIG)


def test_nine_steps_need_nine_samples_and_bounds_in_order() -> None:
    with pytest.raises(DriveError, match="at least 9 samples, got 5"):
        nine_steps(5e-3, 1e-3, RIG, np.random.default_rng(0))
    with pytest.raises(DriveError, match="lowest_volts must not exceed highest_volts 2 V, got 3 V"):
        nine_steps(1.0, 1e-3, RIG, np.random.default_rng(0), lowest_volts=3.0, highest_volts=2.0)


@given(seed=SEEDS)
@settings(max_examples=20, deadline=None)
def test_a_multisine_has_equal_lines_in_its_band_and_nothing_else(seed: int) -> None:
    speed = multisine(4.0, 1e-3, 100.0, np.random.default_rng(seed), lowest=1.0, highest=20.0, period=2.0)
    lines = np.abs(np.fft.rfft(speed))
    inside = np.zeros(len(lines), dtype=bool)
    inside[4:81:2] = True
    np.testing.assert_allclose(lines[inside], lines[4], rtol=1e-9)
    assert np.max(lines[~inside]) < 1e-9 * lines[4]
    assert np.max(np.abs(speed)) == pytest.approx(100.0, rel=1e-12)


def test_schroeder_phases_keep_the_crest_factor_of_a_multisine_below_two() -> None:
    speed = multisine(2.0, 1e-3, 100.0, np.random.default_rng(3))
    assert np.max(np.abs(speed)) / np.sqrt(np.mean(speed**2)) < 2.0


def test_a_band_between_two_lines_of_a_multisine_is_refused() -> None:
    with pytest.raises(DriveError, match="multiple of 1/period 1 Hz"):
        multisine(2.0, 1e-3, 1.0, np.random.default_rng(0), lowest=1.2, highest=1.8, period=1.0)


@pytest.mark.parametrize("name", DRIVES)
def test_every_drive_is_within_limits_finite_and_of_the_asked_length(name: str) -> None:
    speed = make_drive(name, 10.0, 1e-3, RIG, np.random.default_rng(5))
    assert speed.shape == (10_000,)
    assert speed.dtype == np.float64
    assert np.max(np.abs(speed)) <= RIG.rated_speed * (1.0 + 1e-12)
    assert np.max(np.abs(speed)) > 0.6 * RIG.rated_speed


@pytest.mark.parametrize("name", DRIVES)
def test_every_drive_is_a_function_of_its_seed(name: str) -> None:
    first, again = (make_drive(name, 2.0, 1e-3, RIG, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    other = make_drive(name, 2.0, 1e-3, RIG, np.random.default_rng(6))
    assert np.array_equal(first, other) == (name in {"sine", "chirp"})


def test_an_unknown_drive_is_refused_with_the_known_ones() -> None:
    with pytest.raises(DriveError, match="one of sine, prbs, steps, chirp, multisine, got 'square'"):
        make_drive("square", 1.0, 1e-3, RIG, np.random.default_rng(0))


def test_a_drive_that_a_short_actuator_cannot_follow_is_refused() -> None:
    with pytest.raises(DriveError, match=r"stroke, the actuator has 0\.02 m"):
        make_drive("steps", 10.0, 1e-3, replace(RIG, stroke=0.02), np.random.default_rng(0))


def test_a_sine_above_half_the_sampling_frequency_is_refused() -> None:
    with pytest.raises(DriveError, match="frequency must be below half the sampling frequency 5 Hz"):
        sine(1.0, 0.1, 1.0, frequency=5.0)
