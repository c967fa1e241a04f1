import numpy as np
import pytest

from estimation.identification.notes import IdentificationCode
from estimation.identification.signals.preprocess import FEWEST_SAMPLES, detrend, resample, zero_phase_filter
from plant.errors import HydrostateError, LogWarning

TIME = 1e-3 * np.arange(4_000)


def tone(frequency_hz: float, time: np.ndarray = TIME) -> np.ndarray:
    return np.sin(2.0 * np.pi * frequency_hz * time + 0.3)


def test_the_mean_of_the_present_samples_is_removed() -> None:
    np.testing.assert_array_equal(detrend([1.0, np.nan, 5.0]), [-2.0, np.nan, 2.0])


def test_slow_tones_pass_without_delay_and_fast_ones_do_not_pass() -> None:
    slow, fast = zero_phase_filter(tone(10.0), tone(100.0), 1e-3)
    middle = slice(500, -500)
    np.testing.assert_allclose(slow[middle], tone(10.0)[middle], atol=1e-4)
    assert np.abs(fast[middle]).max() < 1e-6


def test_two_passes_halve_the_amplitude_at_the_cutoff() -> None:
    at_cutoff, _ = zero_phase_filter(tone(30.0), tone(30.0), 1e-3)
    assert np.abs(at_cutoff[1_000:3_000]).max() == pytest.approx(0.5, rel=0.01)


def test_filtering_both_keeps_a_linear_relation() -> None:
    rng = np.random.default_rng(1)
    u = rng.standard_normal(4_000)
    y = np.convolve(u, [0.5, 0.3, 0.2])[:4_000]
    filtered_u, filtered_y = zero_phase_filter(u, y, 1e-3)
    expected = np.convolve(filtered_u, [0.5, 0.3, 0.2])[:4_000]
    middle = slice(500, -500)
    np.testing.assert_allclose(filtered_y[middle], expected[middle], atol=1e-6)


def test_filtering_the_output_only_leaves_the_input_and_warns() -> None:
    with pytest.warns(LogWarning) as caught:
        u, y = zero_phase_filter(tone(100.0), tone(100.0), 1e-3, filter_input=False)
    assert [(one.message.note.code, one.filename) for one in caught] == [
        (IdentificationCode.OUTPUT_ALONE_FILTERED, __file__)
    ]
    np.testing.assert_array_equal(u, tone(100.0))
    assert np.abs(y[500:-500]).max() < 1e-6


def test_gaps_stay_gaps_and_do_not_spread() -> None:
    y = tone(5.0)
    y[1_000:1_003] = np.nan
    filtered = zero_phase_filter(tone(5.0), y, 1e-3)[1]
    assert np.isnan(filtered).sum() == 3
    np.testing.assert_allclose(filtered[1_100:3_000], tone(5.0)[1_100:3_000], atol=1e-3)


@pytest.mark.parametrize(
    ("n", "cutoff_hz", "order", "message"),
    [
        (400, 500.0, 12, "Nyquist frequency 500 Hz, got 500.0"),
        (400, -1.0, 12, "between 0 and"),
        (400, 30.0, 0, "order must be at least 1"),
        (20, 30.0, 12, "needs more than 25 samples, got 20"),
    ],
)
def test_an_impossible_filter_is_refused(n: int, cutoff_hz: float, order: int, message: str) -> None:
    with pytest.raises(HydrostateError, match=message):
        zero_phase_filter(TIME[:n], TIME[:n], 1e-3, cutoff_hz=cutoff_hz, order=order)


@pytest.mark.parametrize("new", [1e-2, 2.5e-3, 7.3e-3, 1e-3 * np.pi, 4e-4])
def test_a_slow_tone_survives_resampling(new: float) -> None:
    coarse = resample(tone(3.0), 1e-3, new)
    time = new * np.arange(coarse.size)
    assert time[-1] <= TIME[-1] * (1.0 + 1e-12) < time[-1] + new
    middle = slice(coarse.size // 8, -coarse.size // 8)
    np.testing.assert_allclose(coarse[middle], tone(3.0, time)[middle], atol=1e-5)


def test_a_tone_above_the_new_nyquist_frequency_does_not_alias() -> None:
    coarse = resample(tone(95.0), 1e-3, 1e-2)
    assert np.abs(coarse[50:-50]).max() < 1e-4


def test_the_same_sample_time_returns_the_same_samples() -> None:
    np.testing.assert_array_equal(resample(tone(95.0), 1e-3, 1e-3), tone(95.0))


def test_missing_samples_stay_missing() -> None:
    x = tone(3.0)
    x[1_000:1_100] = np.nan
    coarse = resample(x, 1e-3, 1e-2)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(coarse)), np.arange(100, 110))


@pytest.mark.parametrize(("old", "new"), [(0.0, 1e-3), (1e-3, -1.0), (1e-3, np.nan)])
def test_impossible_sample_times_are_refused(old: float, new: float) -> None:
    with pytest.raises(HydrostateError, match="sample_time must be positive"):
        resample(TIME, old, new)


def test_too_few_samples_are_not_resampled() -> None:
    few = np.arange(FEWEST_SAMPLES - 1.0)
    with pytest.raises(HydrostateError, match=f"resampling needs {FEWEST_SAMPLES} samples or more, got {few.size}"):
        resample(few, 1e-3, 2e-3)
    np.testing.assert_array_equal(resample(few, 1e-3, 1e-3), few)
