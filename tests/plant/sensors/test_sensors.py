import json
from dataclasses import replace

import numpy as np
import pytest

from plant.errors import LogError, RigError
from plant.log.record import Record
from plant.sensors.sensors import (
    BENCH,
    IDEAL,
    PAPER,
    SENSORS,
    Sensors,
    differentiated,
    drop_samples,
    measure,
    noise_variances,
)
from plant.units import notes

TIME = 1e-3 * np.arange(20_000)
TRUTH = Record(
    1e-3,
    {
        "motor_speed_rad_s": 125.66 * np.sin(TIME),
        "position_m": 0.04 * np.sin(TIME),
        "velocity_m_s": 0.04 * np.cos(TIME),
        "differential_pressure_pa": 4e5 * np.cos(TIME),
    },
    {"condition": "normal"},
    start_time=2.0,
)
CHANNELS = tuple(TRUTH)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_ideal_sensors_change_nothing() -> None:
    measured = measure(TRUTH, IDEAL, rng())
    for name in CHANNELS:
        np.testing.assert_array_equal(measured[name], TRUTH[name])


@pytest.mark.parametrize("name", [name for name, sensors in SENSORS.items() if not sensors.velocity_from_position])
def test_sensor_errors_have_the_variances_given_to_the_filters(name: str) -> None:
    sensors = SENSORS[name]
    measured, told = measure(TRUTH, sensors, rng(), keep_truth=True), noise_variances(sensors)
    assert set(told) == set(measure(TRUTH, sensors, rng()))
    for channel, variance in told.items():
        error = measured[channel] - measured[f"true_{channel}"]
        assert np.mean(error**2) == pytest.approx(variance, rel=0.05, abs=0.0)
        assert abs(np.mean(error)) <= 4.0 * np.sqrt(variance / len(TRUTH))


def test_the_papers_sensors_have_the_variances_of_r_in_equation_7_7() -> None:
    told = noise_variances(PAPER)
    assert told["position_m"] == pytest.approx(1e-12, rel=1e-12, abs=0.0)
    assert told["velocity_m_s"] == pytest.approx(1e-4, rel=1e-12)
    assert "differential_pressure_pa" not in told


def test_position_and_pressure_come_in_whole_quanta() -> None:
    measured = measure(TRUTH, BENCH, rng())
    for channel, quantum in (("position_m", 1e-6), ("differential_pressure_pa", 500.0)):
        steps = measured[channel] / quantum
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "touched"),
    [
        ({"speed_noise": 0.0}, "motor_speed_rad_s"),
        ({"position_noise": 1e-5}, "position_m"),
        ({"velocity_noise": 0.0}, "velocity_m_s"),
        ({"velocity_from_position": True}, "velocity_m_s"),
        ({"pressure_noise": 0.0}, "differential_pressure_pa"),
        ({"pressure": False}, "differential_pressure_pa"),
    ],
)
def test_changing_one_sensor_leaves_the_noise_of_the_others(changes: dict[str, float], touched: str) -> None:
    before = measure(TRUTH, BENCH, rng())
    after = measure(TRUTH, replace(BENCH, **changes), rng())
    assert touched not in after or not np.array_equal(after[touched], before[touched])
    for channel in set(CHANNELS) - {touched}:
        np.testing.assert_array_equal(after[channel], before[channel])


def test_channels_carry_unrelated_noise() -> None:
    noisy = replace(BENCH, position_noise=1e-4)
    measured = measure(TRUTH, noisy, rng())
    errors = np.array([measured[name] - TRUTH[name] for name in CHANNELS])
    correlation = np.corrcoef(errors) - np.eye(len(CHANNELS))
    assert np.max(np.abs(correlation)) < 5.0 / np.sqrt(len(TRUTH))


def test_the_same_seed_measures_the_same_and_another_does_not() -> None:
    first, again, other = (
        measure(TRUTH, BENCH, rng(1)),
        measure(TRUTH, BENCH, rng(1)),
        measure(TRUTH, BENCH, rng(2)),
    )
    np.testing.assert_array_equal(first["velocity_m_s"], again["velocity_m_s"])
    assert not np.array_equal(first["velocity_m_s"], other["velocity_m_s"])


def test_truth_is_kept_only_when_asked_for() -> None:
    assert tuple(measure(TRUTH, BENCH, rng())) == CHANNELS
    kept = measure(TRUTH, BENCH, rng(), keep_truth=True)
    np.testing.assert_array_equal(kept["true_position_m"], TRUTH["position_m"])
    np.testing.assert_array_equal(kept["position_m"], measure(TRUTH, BENCH, rng())["position_m"])


def test_a_measurement_keeps_the_clock_and_says_which_sensors_made_it() -> None:
    measured = measure(TRUTH, BENCH, rng())
    assert (measured.sample_time, measured.start_time) == (1e-3, 2.0)
    said = json.loads(json.dumps(dict(measured.metadata)))
    assert said["condition"] == "normal"
    assert said["sensors"]["pressure_quantum"] == 500.0


def test_a_missing_true_channel_is_named() -> None:
    with pytest.raises(LogError, match="differential_pressure_pa"):
        measure(TRUTH.replace(differential_pressure_pa=None), BENCH, rng())
    measure(TRUTH.replace(differential_pressure_pa=None), PAPER, rng())


def test_differentiated_velocity_is_exact_on_a_ramp_and_not_delayed() -> None:
    np.testing.assert_allclose(differentiated(0.03 * TIME, 1e-3, 5e-3), 0.03, rtol=1e-9)
    accelerating = differentiated(0.5 * TIME**2, 1e-3, 0.01)
    np.testing.assert_allclose(accelerating[5:-5], TIME[5:-5], rtol=1e-7)


def test_differentiated_velocity_has_the_variance_of_two_positions_over_the_window() -> None:
    encoder = replace(BENCH, velocity_from_position=True, position_noise=5e-6, velocity_window=1e-2)
    error = measure(TRUTH, encoder, rng())["velocity_m_s"] - TRUTH["velocity_m_s"]
    assert np.var(error[10:-10]) == pytest.approx(noise_variances(encoder)["velocity_m_s"], rel=0.05)


def test_a_window_shorter_than_two_samples_is_refused() -> None:
    with pytest.raises(RigError, match=r"at least two sample times \(0\.002 s\), got 0\.001 s"):
        differentiated(np.zeros(10), 1e-3, 1e-3)
    with pytest.raises(RigError, match="at least 2 samples, got 1"):
        differentiated(np.zeros(1), 1e-3, 1e-2)


def test_dropped_samples_are_missing_in_every_sensor_at_once_and_not_in_the_truth() -> None:
    record = measure(TRUTH, BENCH, rng(), keep_truth=True)
    gappy = drop_samples(record, 0.05, rng(4))
    missing = np.isnan(gappy["position_m"])
    assert missing.sum() == 1000
    for channel in CHANNELS:
        np.testing.assert_array_equal(np.isnan(gappy[channel]), missing)
        assert not np.isnan(gappy[f"true_{channel}"]).any()
        assert not np.isnan(record[channel]).any()
    np.testing.assert_array_equal(gappy["velocity_m_s"][~missing], record["velocity_m_s"][~missing])


def test_only_the_named_channels_drop_out() -> None:
    gappy = drop_samples(TRUTH, 0.5, rng(), channels=["velocity_m_s"])
    assert [name for name in gappy if np.isnan(gappy[name]).any()] == ["velocity_m_s"]


@pytest.mark.parametrize("fraction", [-0.1, 1.1, np.nan])
def test_a_fraction_outside_zero_to_one_is_refused(fraction: float) -> None:
    with pytest.raises(RigError, match="between 0 and 1"):
        drop_samples(TRUTH, fraction, rng())


@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_an_invalid_noise_or_velocity_window_is_refused_by_name(value: float) -> None:
    with pytest.raises(RigError, match="velocity_noise must be finite and not negative"):
        Sensors(velocity_noise=value)
    with pytest.raises(RigError, match="velocity_window must be positive"):
        Sensors(velocity_window=0.0)


def test_sensor_fields_state_their_unit() -> None:
    assert notes(Sensors)["pressure_quantum"].unit == "Pa"
