"""The frequency of a sinusoidal drive is found to a small part of a spectral line, whatever its duration."""

import numpy as np
import pytest

from estimation.diaphragm_motor.signature import logged_signature, steady_drive
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import BENCH_SENSORS, SAMPLE_TIME, motor_drive, simulate_motor
from plant.errors import LogError


@pytest.mark.parametrize("seconds", [0.2, 2.0, 10.0])
@pytest.mark.parametrize("off", [0.0, 0.25, 0.45])
def test_frequency_and_swing_of_a_drive_between_spectral_lines_are_found(seconds: float, off: float) -> None:
    T = 1e-3
    size = round(seconds / T)
    frequency = (round(33.0 * seconds) + off) / seconds
    voltage = 5.0 + 60.0 * np.sin(2.0 * np.pi * frequency * T * np.arange(size) + 0.4)
    voltage += 0.01 * np.random.default_rng(0).standard_normal(size)
    found = steady_drive(voltage, T)
    # standard deviation of a sine's frequency in white noise: sqrt(6) s / (pi a T sqrt(n)), with its length T
    deviation = np.sqrt(6.0) * 0.01 / (np.pi * 60.0 * seconds * np.sqrt(size))
    assert found.frequency == pytest.approx(frequency, abs=6.0 * deviation)
    assert found.peak_to_peak == pytest.approx(120.0, rel=1e-3)


def test_a_position_clipped_at_the_end_of_its_range_is_refused() -> None:
    drive = motor_drive(480.0, 200.0, 0.25, SAMPLE_TIME)
    log = simulate_motor(
        DiaphragmMotorParameters(), drive, SAMPLE_TIME, sensors=BENCH_SENSORS, rng=np.random.default_rng(1)
    )
    logged_signature(log)
    end = 0.8 * float(log["position_m"].max())
    with pytest.raises(LogError, match="position_m holds one value"):
        logged_signature(log.replace(position_m=np.minimum(log["position_m"], end)))
