"""White innovations pass; structure in the drive's band is found, named and sized; too small ones are no objection."""

import numpy as np
import pytest
from scipy.stats import chi2
from statsmodels.stats.diagnostic import acorr_ljungbox

from estimation.filters.run import Estimate
from estimation.models.model import ProcessModel
from estimation.trust.whiteness import (
    LAGS,
    SEGMENTS,
    SETTLING,
    Whiteness,
    _autocorrelations,
    _coherent_share,
    _ljung_box,
    quantum,
    whiteness,
)
from plant.arrays import Array
from plant.log.record import Record

SAMPLES, SAMPLE_TIME, FREQUENCY = 10_000, 1e-3, 5.0
CHANNELS = ("position_m", "velocity_m_s")
TIME = SAMPLE_TIME * np.arange(SAMPLES)
DRIVE = np.sign(np.sin(2.0 * np.pi * FREQUENCY * TIME + 1e-6))


def judged(
    model: ProcessModel, residuals: Array, variance: float = 1.0, position: Array | None = None, mean: float = 0.0
) -> list[Whiteness]:
    moving = np.cumsum(np.ones(SAMPLES)) * np.pi if position is None else position
    record = Record(
        SAMPLE_TIME, {"motor_speed_rad_s": 100.0 * DRIVE + mean, "position_m": moving, "velocity_m_s": moving**1.01}
    )
    estimate = Estimate(
        model, CHANNELS, TIME, np.zeros((SAMPLES, 3)), np.ones((SAMPLES, 3)), None, {}, 0.0,
        residuals, np.full(residuals.shape, variance),
    )  # fmt: skip
    return list(whiteness(estimate, record))


def white(seed: int) -> Array:
    return np.random.default_rng(seed).standard_normal((SAMPLES, 2))


def test_white_innovations_are_objected_to_less_than_once_in_a_hundred_logs(linear: ProcessModel) -> None:
    objections = sum(any(channel.exceeded for channel in judged(linear, white(seed))) for seed in range(200))
    assert objections <= 2


def test_correlated_innovations_smaller_than_predicted_are_no_objection(linear: ProcessModel) -> None:
    coloured = np.cumsum(white(0), axis=0) * 1e-3
    for channel in judged(linear, coloured + 0.3 * white(1)):
        assert not channel.exceeded
        assert channel.ljung_box < 0.05 or abs(channel.autocorrelation) > 0.02


def test_a_tone_of_the_drive_is_found_with_its_frequency_and_share(linear: ProcessModel) -> None:
    residuals = white(2)
    residuals[:, 0] += 0.2 * np.sin(2.0 * np.pi * FREQUENCY * TIME)
    position, velocity = judged(linear, residuals)
    assert position.exceeded
    assert not velocity.exceeded
    assert position.frequency == pytest.approx(FREQUENCY, abs=1.0)
    assert position.driven
    assert position.excess == pytest.approx(1.0 + 0.2**2 / 4.0 * SAMPLES * 0.8 / 8.0, rel=0.4)
    assert position.with_drive == pytest.approx(0.2**2 / 2.0, rel=0.5)
    assert velocity.with_drive < 0.005


def test_the_mean_of_the_drive_has_no_effect(linear: ProcessModel) -> None:
    residuals = white(2)
    residuals[:, 0] += 0.2 * np.sin(2.0 * np.pi * FREQUENCY * TIME) + 0.1
    about_zero, about_a_mean = (judged(linear, residuals, mean=mean) for mean in (0.0, 1e3))
    for one, other in zip(about_zero, about_a_mean, strict=True):
        assert other.excess == pytest.approx(one.excess)
        assert other.threshold == pytest.approx(one.threshold)
        assert (other.driven, other.frequency) == (one.driven, one.frequency)
        assert other.with_drive == pytest.approx(one.with_drive, abs=1e-6)


def test_a_tone_at_another_frequency_is_not_attributed_to_the_drive(linear: ProcessModel) -> None:
    residuals = white(3)
    residuals[:, 1] += 0.3 * np.sin(2.0 * np.pi * 17.0 * TIME)
    _, velocity = judged(linear, residuals)
    assert velocity.exceeded
    assert not velocity.driven


@pytest.mark.parametrize(("missed", "exceeded"), [(0.0, False), (0.8, True)])  # in quantisation steps
def test_a_beat_of_rounding_with_the_sample_rate_is_no_misfit(
    linear: ProcessModel, missed: float, exceeded: bool
) -> None:
    step = 12.0**0.5  # its rounding has a variance of 1
    true = np.cumsum(np.where(np.arange(SAMPLES) < 1000, 0.3, 40.043))  # in quantisation steps
    residuals = white(9)
    residuals[:, 0] = step * (np.round(true) - true + missed * np.sin(2.0 * np.pi * 17.0 * TIME))
    found = judged(linear, residuals, position=step * np.round(true))[0]
    assert found.exceeded is exceeded


def test_a_tone_far_above_the_drives_band_is_no_objection(linear: ProcessModel) -> None:
    residuals = white(4)
    residuals[:, 0] += 0.5 * np.sin(2.0 * np.pi * 480.0 * TIME)
    assert not judged(linear, residuals)[0].exceeded


def test_a_constant_offset_of_innovations_is_an_objection_at_frequency_zero(linear: ProcessModel) -> None:
    residuals = white(5)
    residuals[:, 0] += 0.1
    assert judged(linear, residuals)[0].exceeded
    assert judged(linear, residuals)[0].frequency == 0.0


def test_channels_with_common_innovations_are_reported_as_correlated(linear: ProcessModel) -> None:
    residuals = white(6)
    residuals[:, 1] = 0.8 * residuals[:, 0] + 0.6 * residuals[:, 1]
    assert [channel.crosses for channel in judged(linear, residuals)] == pytest.approx([0.8, 0.8], abs=0.02)
    assert abs(judged(linear, white(6))[0].crosses) < 0.05


def test_missing_samples_lower_the_count_and_cause_no_objection(linear: ProcessModel) -> None:
    residuals = white(7)
    residuals[np.random.default_rng(8).random(SAMPLES) < 0.4, 0] = np.nan
    position, velocity = judged(linear, residuals)
    assert position.count == pytest.approx(0.48 * SAMPLES, rel=0.03)
    assert velocity.count == 0.8 * SAMPLES
    assert not position.exceeded


def test_a_pattern_within_the_quantum_of_a_stuck_sensor_is_no_objection(linear: ProcessModel) -> None:
    residuals = white(9)
    residuals[:, 0] += 0.2 * np.sin(2.0 * np.pi * FREQUENCY * TIME)
    coarse = np.round(0.3 * DRIVE + 0.3)
    assert quantum(coarse) == 1.0
    assert not judged(linear, residuals, position=coarse)[0].exceeded


def test_a_channel_that_never_moves_has_no_excess(linear: ProcessModel) -> None:
    residuals = white(10)
    residuals[:, 0] += 5.0
    assert quantum(np.zeros(5)) == float("inf")
    assert judged(linear, residuals, position=np.zeros(SAMPLES))[0].excess == 0.0


@pytest.mark.parametrize(("repeats", "coarse"), [(2, False), (4, True)])
def test_a_channel_that_repeats_a_value_once_in_a_thousand_samples_is_quantised(repeats: int, coarse: bool) -> None:
    values = np.cumsum(np.where(np.arange(3000) < repeats, 0.0, 0.5))
    assert quantum(values) == (0.5 if coarse else 0.0)


def test_noise_has_no_quantum() -> None:
    assert quantum(np.random.default_rng(0).standard_normal(1000)) == 0.0


def test_a_log_of_few_samples_or_without_innovations_is_not_judged(linear: ProcessModel) -> None:
    assert judged(linear, np.empty((0, 2))) == []
    assert judged(linear, white(0)[:200]) == []


@pytest.mark.parametrize("memory", [0.0, 0.05, 0.1])
def test_the_ljung_box_test_equals_that_of_statsmodels(memory: float) -> None:
    values = np.random.default_rng(7).standard_normal(2000)
    values[1:] += memory * values[:-1]
    values -= values.mean()
    wanted = acorr_ljungbox(values, lags=[LAGS])["lb_pvalue"].iloc[0]
    assert _ljung_box(_autocorrelations(values), len(values)) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize(("driven", "share"), [(0.0, 0.0), (1.0, 0.5), (2.0, 0.8), (1e3, 1.0)])
def test_the_share_that_the_drive_explains_is_unbiased(driven: float, share: float) -> None:
    rng = np.random.default_rng(7)
    found: list[float] = []
    for _ in range(20):
        push, own = rng.standard_normal((2, SEGMENTS * 250))
        found.append(_coherent_share(driven * push + own, push, 250))
    assert np.mean(found) == pytest.approx(share, abs=0.02)


def test_quantisation_that_follows_the_drive_is_subtracted_from_the_excess(linear: ProcessModel) -> None:
    length, first = (SAMPLES - int(SETTLING * SAMPLES)) // SEGMENTS, int(SETTLING * SAMPLES)
    frequency = 8.0 / (length * SAMPLE_TIME)
    push, quantum = np.sin(2.0 * np.pi * frequency * TIME), 1e-5
    residuals = white(12)
    residuals[:, 0] += 0.8 * push

    def excess(position: Array) -> tuple[float, float]:
        log = Record(SAMPLE_TIME, {"motor_speed_rad_s": push, "position_m": position, "velocity_m_s": TIME})
        estimate = Estimate(
            linear, CHANNELS, TIME, np.zeros((SAMPLES, 3)), np.ones((SAMPLES, 3)), None, {}, 0.0,
            residuals * quantum, np.full(residuals.shape, quantum**2),
        )  # fmt: skip
        repeated = float(np.mean(np.diff(position) == 0.0))
        return whiteness(estimate, log)[0].excess, repeated

    smooth, stepped = 6e-5 * push + 1e-9 * TIME, quantum * np.round(6e-5 * push / quantum)
    (fine, never), (coarse, often) = excess(smooth), excess(stepped)
    assert never < 0.01 < 0.3 < often
    # the drive is a single line, which is length / 2 times as high as white noise of the same variance
    driven = np.abs(np.fft.rfft(push[first:][: SEGMENTS * length].reshape(SEGMENTS, length), axis=1)) ** 2
    share = float(np.max(np.mean(driven, axis=0)) / np.sum(np.mean(driven, axis=0)))
    assert fine - coarse == pytest.approx(share * often / 12.0 * length / 2.0, rel=0.02)


def test_without_a_drive_only_the_lowest_tenth_of_frequencies_is_judged(linear: ProcessModel) -> None:
    still = np.zeros(SAMPLES)
    record = Record(SAMPLE_TIME, {"motor_speed_rad_s": still, "position_m": TIME, "velocity_m_s": TIME})

    def at(frequency: float) -> Whiteness:
        residuals = white(11)
        residuals[:, 0] += 0.5 * np.sin(2.0 * np.pi * frequency * TIME)
        estimate = Estimate(
            linear, CHANNELS, TIME, np.zeros((SAMPLES, 3)), np.ones((SAMPLES, 3)), None, {}, 0.0,
            residuals, np.ones(residuals.shape),
        )  # fmt: skip
        return whiteness(estimate, record)[0]

    assert at(40.0).exceeded
    assert not at(60.0).exceeded
    band, channels = 50, 2  # a tenth of 501 frequencies
    assert at(40.0).threshold == pytest.approx(chi2.isf(1e-3 / (band * channels), 2 * SEGMENTS) / (2 * SEGMENTS))
    assert not at(40.0).driven
    assert at(40.0).with_drive == 0.0


def test_zero_innovations_have_no_excess_and_no_correlation(linear: ProcessModel) -> None:
    residuals = white(12)
    residuals[:, 0] = 0.0
    position, velocity = judged(linear, residuals)
    assert (position.excess, position.autocorrelation, position.crosses, position.with_drive) == (0.0, 0.0, 0.0, 0.0)
    assert velocity.crosses == 0.0
