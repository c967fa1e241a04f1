import numpy as np
import pytest

from estimation.fits.greybox.intersample_speed import straight_line_speed
from plant.arrays import Array

LAG, ACCELERATION, SAMPLE = 4e-3, 3e4, 1e-3


def motor(asked: float, time: Array) -> tuple[Array, Array]:
    """Return speed [rad/s] and angle [rad] of a motor that starts at 5 ms at full acceleration, then lags."""
    fine = np.linspace(0.0, time[-1], 100 * (len(time) - 1) + 1)
    speed, step = np.zeros_like(fine), fine[1]
    for k in range(1, len(fine)):
        rate = min((asked - speed[k - 1]) / LAG, ACCELERATION) if fine[k - 1] >= 4.9999e-3 else 0.0
        speed[k] = speed[k - 1] + step * rate
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * step])
    return speed[::100], angle[::100]


def test_straightened_speeds_give_the_angle_of_a_motor_that_starts_at_full_acceleration() -> None:
    speed, angle = motor(300.0, SAMPLE * np.arange(41.0))
    turned = [
        np.concatenate([[0.0], np.cumsum(0.5 * (s[1:] + s[:-1])) * SAMPLE]) for s in (speed, straight_line_speed(speed))
    ]
    plainly, bent = (np.max(np.abs(one - angle)) for one in turned)
    assert plainly == pytest.approx(ACCELERATION * SAMPLE**2 / 12.0, rel=0.05)
    assert bent < 0.2 * plainly


def test_a_corner_at_a_sample_is_left_as_it_is() -> None:
    speed = np.maximum(0.0, np.arange(-5.0, 6.0))
    np.testing.assert_array_equal(straight_line_speed(speed), speed)
    mirrored = straight_line_speed(-speed)
    np.testing.assert_array_equal(mirrored, -speed)


@pytest.mark.parametrize("samples", [0, 1, 2, 3])
def test_a_log_that_is_too_short_to_bend_is_unchanged(samples: int) -> None:
    speed = np.arange(float(samples)) ** 2
    np.testing.assert_array_equal(straight_line_speed(speed), speed)
