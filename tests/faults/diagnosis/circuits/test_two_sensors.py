"""Velocity and the slope of position agree within their noise and a twentieth; otherwise one sensor is wrong."""

import numpy as np
import pytest

from faults.diagnosis.circuits.blocks import blocks_of
from faults.diagnosis.circuits.two_sensors import _filtered_noise, sensor_disagreements
from plant.log.record import Record


def with_two_sensors(gain: float, noise: float) -> Record:
    """Return a log whose velocity sensor reads ``gain`` times the slope of the encoder, with noise."""
    time = 1e-3 * np.arange(3001)
    rng = np.random.default_rng(3)
    velocity = 0.05 * np.sin(2.0 * np.pi * time)
    position = 0.05 / (2.0 * np.pi) * (1.0 - np.cos(2.0 * np.pi * time))
    channels = {
        "motor_speed_rad_s": 100.0 * np.sin(2.0 * np.pi * time),
        "position_m": position,
        "velocity_m_s": gain * velocity + rng.normal(0.0, noise, len(time)),
    }
    return Record(1e-3, channels)


@pytest.mark.parametrize(("gain", "differs"), [(1.0, False), (1.03, False), (1.08, True), (0.9, True), (-1.0, True)])
def test_velocity_and_the_encoders_slope_may_differ_by_five_percent(gain: float, differs: bool) -> None:
    record = with_two_sensors(gain, 1e-6)
    assert bool(sensor_disagreements(record, blocks_of(record))) == differs


@pytest.mark.parametrize(("gain", "noise", "differs"), [(1.0, 0.05, False), (1.2, 1e-3, True)])
def test_noise_of_a_velocity_sensor_excuses_only_differences_of_its_size(
    gain: float, noise: float, differs: bool
) -> None:
    record = with_two_sensors(gain, noise)
    assert bool(sensor_disagreements(record, blocks_of(record))) == differs


@pytest.mark.parametrize(("gain", "differs"), [(1.0, False), (0.7, True)])
def test_filtered_noise_alone_does_not_make_the_sensors_disagree(gain: float, differs: bool) -> None:
    """The steps of such noise between samples are small: they show a tenth of its size in the mean over a block."""
    noise = 0.02 * np.random.default_rng(8).standard_normal(3020)
    for _ in range(4):
        noise = np.convolve(noise, np.full(6, 1.0 / 6.0), "same")
    record = with_two_sensors(gain, 1e-6)
    wandering = record.replace(velocity_m_s=record["velocity_m_s"] + noise[: len(record)])
    assert bool(sensor_disagreements(wandering, blocks_of(wandering))) == differs


@pytest.mark.parametrize(("gain", "differs"), [(1.0, False), (6.0, True)])
def test_an_encoder_of_few_counts_in_a_fast_log_is_not_wrong(gain: float, differs: bool) -> None:
    """A mean over a millisecond is as wrong as one sample while the reading stays; before, it counted as a tenth."""
    time = 1e-4 * np.arange(30_001)
    velocity = gain * 4e-3 * np.sin(2.0 * np.pi * time)
    path = 4e-3 / (2.0 * np.pi) * (1.0 - np.cos(2.0 * np.pi * time))
    channels = {
        "motor_speed_rad_s": 100.0 * np.sin(2.0 * np.pi * time),
        "position_m": 5e-5 * np.round(path / 5e-5),
        "velocity_m_s": velocity + np.random.default_rng(4).normal(0.0, 1e-4, len(time)),
    }
    record = Record(1e-4, channels)
    assert bool(sensor_disagreements(record, blocks_of(record))) == differs


def test_a_single_sensor_cannot_disagree() -> None:
    record = with_two_sensors(2.0, 1e-6).replace(position_m=None)
    assert not sensor_disagreements(record, blocks_of(record))


def test_sensors_without_common_samples_do_not_disagree() -> None:
    record = with_two_sensors(2.0, 1e-6)
    early = np.where(np.arange(len(record)) < 60, record["velocity_m_s"], np.nan)
    apart = record.replace(velocity_m_s=early)
    assert not sensor_disagreements(apart, blocks_of(apart))


def test_the_noise_of_a_velocity_in_every_other_row_excuses_a_difference() -> None:
    record = with_two_sensors(1.0, 0.05)
    slow = record.replace(velocity_m_s=np.where(np.arange(len(record)) % 2, np.nan, record["velocity_m_s"]))
    assert not sensor_disagreements(slow, blocks_of(slow))


@pytest.mark.parametrize("rows", [1, 20])
def test_a_coarse_log_of_fast_motion_does_not_make_sound_sensors_disagree(rows: int) -> None:
    """A coarse log does not show how velocity changes between two samples, although that moves the piston."""
    rng, time = np.random.default_rng(2), 1e-3 * np.arange(12_001)
    steps = 0.04 * np.repeat(rng.choice([-1.0, 1.0], 1 + len(time) // 150), 150)[: len(time)]
    velocity = np.convolve(steps, 0.1 * np.exp(-0.1 * np.arange(100)))[: len(time)]  # a lag of 10 ms
    position = np.concatenate(([0.0], np.cumsum(velocity[:-1]) * 1e-3))
    channels = {"motor_speed_rad_s": 2e3 * velocity, "position_m": position, "velocity_m_s": velocity}
    record = Record(rows * 1e-3, {name: values[::rows] for name, values in channels.items()})
    assert not sensor_disagreements(record, blocks_of(record))
    wrong = record.replace(velocity_m_s=-record["velocity_m_s"])
    assert sensor_disagreements(wrong, blocks_of(wrong))


def test_filtered_noise_is_told_from_a_wrong_gain_and_a_lag() -> None:
    rng, time = np.random.default_rng(6), 0.01 * np.arange(2000)
    velocity = 0.05 * np.sin(2.0 * np.pi * time)
    noise = 1e-3 * rng.standard_normal(len(time))
    assert _filtered_noise(noise + 0.2 * velocity + 0.5 * np.gradient(velocity), velocity) == pytest.approx(
        1e-3, rel=0.1
    )


def test_fast_changes_within_a_block_do_not_make_sound_sensors_disagree() -> None:
    """Means of samples are half a sample early: at 20 Hz, a sound sensor differed from the encoder by 6 %."""
    time = 1e-3 * np.arange(3001)
    turned = 2.0 * np.pi * 20.0 * time
    channels = {
        "motor_speed_rad_s": 100.0 * np.cos(turned),
        "position_m": 0.05 / (40.0 * np.pi) * np.sin(turned),
        "velocity_m_s": 0.05 * np.cos(turned),
    }
    record = Record(1e-3, channels)
    assert not sensor_disagreements(record, blocks_of(record))
    wrong = record.replace(velocity_m_s=1.08 * record["velocity_m_s"])
    assert sensor_disagreements(wrong, blocks_of(wrong))
