"""With every random drive, the piston stays within its travel and the speed within its rating."""

import numpy as np
import pytest

from experiments.open_benchmark.drives import (
    DriveLimits,
    multisine,
    position_steps,
    prbs,
    sines,
    steps,
    tracking,
)
from experiments.open_benchmark.run import TICK

ROOM = DriveLimits(duration=6.0, rated=125.0, travel=0.03, glide=4e-4)


@pytest.mark.parametrize("drive", [steps, prbs, multisine, sines])
@pytest.mark.parametrize("seed", range(4))
def test_a_speed_drive_stays_within_rated_speed_and_the_travel(drive: object, seed: int) -> None:
    assert callable(drive)
    speed = drive(ROOM, np.random.default_rng(seed))
    assert speed.shape == (ROOM.ticks,)
    assert np.max(np.abs(speed)) <= ROOM.rated * (1.0 + 1e-9)
    where = np.cumsum(ROOM.glide * speed * TICK)
    assert 0.2 * ROOM.travel < np.ptp(where) <= 2.1 * ROOM.travel  # twice the travel is from one side to the other


@pytest.mark.parametrize("drive", [position_steps, tracking])
def test_a_position_drive_stays_within_the_travel_and_tracking_within_the_motor_speed(drive: object) -> None:
    assert callable(drive)
    for seed in range(4):
        asked = drive(ROOM, np.random.default_rng(seed))
        assert asked.shape == (ROOM.ticks,)
        assert np.max(np.abs(asked)) <= ROOM.travel * (1.0 + 1e-9)
    followed = tracking(ROOM, np.random.default_rng(0))
    assert followed[0] == 0.0
    assert np.max(np.abs(np.diff(followed))) / TICK <= 0.8 * ROOM.glide * ROOM.rated * (1.0 + 1e-9)


def test_a_binary_signal_has_one_amplitude_and_both_signs() -> None:
    speed = prbs(ROOM, np.random.default_rng(2))
    assert len(np.unique(np.abs(speed))) == 1
    assert np.any(speed > 0.0)
    assert np.any(speed < 0.0)
