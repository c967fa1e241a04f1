"""Noise of a driving channel in an output that follows it and leaks."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.arrays import Array
from estimation.fits.greybox.leaked_noise import LeakedNoise, encoder_noise, white_noise

STEP, SAMPLES = 1e-6, 25
RNG = np.random.default_rng(0)


def spread(errors: Array, lost: float, samples: int, every: int = 1) -> float:
    """Return the deviation of means of a leaking output that follows errors, over that of white noise."""
    kept = math.exp(-lost)
    output = lfilter([(1.0 - kept) / lost], [1.0, -kept], np.diff(errors))[40 * samples :]
    there = output[: len(output) // samples * samples].reshape(-1, samples)[:, ::every]
    return float(np.std(there.mean(axis=1)) * there.shape[1] ** 0.5 / np.std(errors))


@pytest.mark.parametrize("samples", [1, 5])
@pytest.mark.parametrize("lost", [0.03, 0.3, 1.0, 4.0])
def test_the_predicted_deviation_of_means_of_leaking_white_noise_is_right(lost: float, samples: int) -> None:
    told, _ = white_noise(samples).remaining_noise(lost)
    assert spread(RNG.standard_normal(200_000), lost, samples) == pytest.approx(told, rel=0.03)


@pytest.mark.parametrize("every", [2, 3, 6])
@pytest.mark.parametrize("lost", [0.03, 0.13, 1.0])
def test_leakage_removes_less_noise_from_the_means_of_a_thinned_output(lost: float, every: int) -> None:
    """For a thinned pressure of a small chamber 55 % of the encoder's noise was predicted, and 90 % remain."""
    told, _ = white_noise(24, every).remaining_noise(lost)
    assert spread(RNG.standard_normal(400_000), lost, 24, every) == pytest.approx(told, rel=0.04)
    assert told > 1.05 * white_noise(24).remaining_noise(lost)[0]


def read(per_sample: float, blur: float) -> tuple[Array, Array, LeakedNoise]:
    """Return an encoder's errors, the piston's course to and fro at one speed, and the noise that is found.

    The pump tells a course that is 30 % too long, as of a leaking actuator.
    """
    turns = np.convolve(np.repeat(np.resize([1.0, -1.0], 80), 250), np.full(20, 0.05), "same")
    course = np.cumsum(turns) * per_sample * STEP + 0.02 * STEP * np.cumsum(RNG.standard_normal(len(turns)))
    position = STEP * np.round((course + blur * STEP * RNG.standard_normal(len(course))) / STEP)
    variance = STEP**2 / 12.0 + (blur * STEP) ** 2
    return position - course, course, encoder_noise(position, 1.3 * course, variance, 1, SAMPLES)


@pytest.mark.parametrize("lost", [0.1, 0.3, 1.0])
def test_encoder_errors_are_correlated_at_a_steady_speed(lost: float) -> None:
    """At 8.99 steps per sample each error is nearly the one before; white noise would be half as large or less."""
    errors, _, told = read(8.99, 0.0)
    found = spread(errors, lost, SAMPLES)
    assert told.remaining_noise(lost)[0] == pytest.approx(found, rel=0.3)
    assert white_noise(SAMPLES).remaining_noise(lost)[0] < 0.85 * found


def test_errors_of_an_encoder_with_a_flickering_reading_are_white() -> None:
    errors, _, told = read(8.99, 0.6)
    assert told.remaining_noise(0.3)[0] == pytest.approx(spread(errors, 0.3, SAMPLES), rel=0.08)
    assert told.remaining_noise(0.3)[0] == pytest.approx(white_noise(SAMPLES).remaining_noise(0.3)[0], rel=0.05)


def test_uncorrelated_errors_count_as_white_noise_in_means_of_samples() -> None:
    """If errors are not correlated between samples, a mean of five is lost like one sample of white noise."""
    _, course, _ = read(8.99, 0.6)
    position = course + STEP * RNG.standard_normal(len(course))
    of_means = encoder_noise(position, course, STEP**2, 5, SAMPLES // 5)
    assert of_means.remaining_noise(0.3) == pytest.approx(white_noise(SAMPLES // 5).remaining_noise(0.3), rel=1e-3)


@pytest.mark.parametrize("told", [white_noise(5), read(8.99, 0.0)[2]], ids=["white", "alike"])
@pytest.mark.parametrize("lost", [1e-5, 0.2, 3.0, 600.0, 1e6])
def test_the_slope_of_leaked_noise_is_that_of_its_logarithm(lost: float, told: LeakedNoise) -> None:
    above, below = (math.log(told.remaining_noise(lost * factor)[0]) for factor in (1.001, 1.0 / 1.001))
    assert told.remaining_noise(lost)[1] == pytest.approx((above - below) / (2.0 * math.log(1.001)), abs=1e-4)


def test_all_noise_is_kept_without_leakage() -> None:
    assert white_noise(5).remaining_noise(0.0) == pytest.approx((1.0, 0.0), abs=1e-5)


def test_encoder_noise_in_a_short_or_resting_log_is_taken_as_white() -> None:
    for position in (np.zeros(5000), STEP * np.arange(20.0)):
        told = encoder_noise(position, position, STEP**2, 1, SAMPLES)
        assert told.remaining_noise(0.3) == white_noise(SAMPLES).remaining_noise(0.3)


def test_missing_samples_do_not_hide_the_correlation_of_encoder_errors() -> None:
    """A straight line across a gap has steps that are not the encoder's, so its noise was taken for white."""
    errors, course, told = read(8.99, 0.0)
    position = course + errors
    position[5000:5050] = np.nan
    holed = encoder_noise(position, 2.0 * course, STEP**2 / 12.0, 1, SAMPLES)
    assert holed.remaining_noise(0.3)[0] == pytest.approx(told.remaining_noise(0.3)[0], rel=0.05)
