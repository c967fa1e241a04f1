"""A drive that changes is learnt before it is judged; so is one that comes back."""

import numpy as np
import pytest

from faults.watch.events import Alarm
from faults.watch.watch import Watch
from plant.arrays import Array
from plant.eha.model import EhaParameters

P, T = EhaParameters(), 5e-3


def running(speed: Array, leak_from: float) -> Array:
    """Return an actuator whose leakage is quadratic in pressure, and pressure in speed: no balance fits all speeds."""
    rng, leak = np.random.default_rng(4), np.where(T * np.arange(len(speed)) < leak_from, 0.05, 1.0)
    lagged, pressure = np.zeros(len(speed)), 0.0
    for k in range(1, len(speed)):  # the motor follows its command in 20 ms
        lagged[k] = lagged[k - 1] + T / 0.02 * (speed[k] - lagged[k - 1])
    share = lagged / P.rated_speed
    pressure = np.sign(share) * (0.1 + 0.5 * share**2)
    velocity = (share - leak * np.sign(share) * pressure**2) * P.rated_flow / P.piston_area
    noise = rng.standard_normal((len(speed), 3)) * [0.05, 1e-7, 2e3]
    return np.column_stack([lagged, np.cumsum(velocity) * T, pressure * P.relief_pressure]) + noise


@pytest.mark.parametrize("pressure", [True, False])
def test_another_amplitude_raises_no_alarm_when_it_begins_or_ends_and_a_leak_does(pressure: bool) -> None:
    time = T * np.arange(round(700.0 / T))
    speed = 100.0 * np.sign(np.sin(2.0 * np.pi * time / 2.2))
    speed[round(200.0 / T) : round(350.0 / T)] *= 0.5
    speed[round(500.0 / T) : round(600.0 / T)] *= 1.5
    samples = running(speed, 690.0)
    if not pressure:
        samples[:, 2] = 0.0
    alarms = [one for one in Watch(P, T, pressure=pressure).take(samples) if isinstance(one, Alarm)]
    assert [round(alarm.since) for alarm in alarms] == [690]
