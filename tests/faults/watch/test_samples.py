import numpy as np
import pytest

from faults.watch.samples import watched_samples
from plant.errors import LogError


def test_velocity_replaces_position_and_two_pressures_their_difference() -> None:
    channels = {
        "motor_speed_rad_s": np.ones(3),
        "velocity_m_s": np.array([1.0, np.nan, 2.0]),
        "pressure_a_pa": np.full(3, 5.0),
        "pressure_b_pa": np.full(3, 2.0),
    }
    samples, pressure = watched_samples(channels, 0.5, travelled=1.0)
    assert pressure
    np.testing.assert_array_equal(samples[:, 1], [1.5, np.nan, 2.5])
    np.testing.assert_array_equal(samples[:, 2], 3.0)


def test_a_log_without_motion_is_refused() -> None:
    with pytest.raises(LogError, match="position_m or velocity_m_s"):
        watched_samples({"motor_speed_rad_s": np.zeros(3)}, 1e-3)


def test_without_both_pressures_there_is_no_difference_and_position_is_unchanged() -> None:
    channels = {"motor_speed_rad_s": np.ones(3), "position_m": np.arange(3.0), "pressure_a_pa": np.full(3, 5.0)}
    samples, pressure = watched_samples(channels, 0.5)
    assert not pressure
    np.testing.assert_array_equal(samples, np.column_stack([np.ones(3), np.arange(3.0), np.zeros(3)]))
