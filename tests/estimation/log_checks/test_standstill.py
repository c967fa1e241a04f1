"""Travel of a piston and of its pump."""

import numpy as np
import pytest

from estimation.log_checks.channel_names import POSITION, SPEED, VELOCITY
from estimation.log_checks.standstill import travels
from plant.eha.model import EhaParameters
from plant.log.record import Record

RIG = EhaParameters()


@pytest.mark.parametrize(
    ("speed", "travel", "still", "at_rest", "stuck"),
    [
        (0.0, 0.0, True, True, False),
        (0.4, 0.0, True, True, False),
        (100.0, 0.0, True, False, True),
        (1.0, 0.0, True, False, False),
        (0.0, 0.01, False, False, False),
        (100.0, 0.05, False, False, False),
    ],
)
def test_a_still_piston_is_stuck_only_if_its_pump_turns(
    speed: float, travel: float, still: bool, at_rest: bool, stuck: bool
) -> None:
    """An offset of speed is not a turning pump."""
    time, noise = np.arange(2000) * 1e-3, np.random.default_rng(1).standard_normal((2, 2000))
    channels = {SPEED: np.full(2000, speed) + 0.1 * noise[0], POSITION: travel * np.sin(6.0 * time) + 1e-5 * noise[1]}
    gone = travels(Record(1e-3, channels), RIG)
    assert gone is not None
    assert (gone.still, gone.at_rest, gone.stuck) == (still, at_rest, stuck)
    assert gone.piston == pytest.approx(2.0 * travel, abs=2e-5 + 0.01 * travel)


@pytest.mark.parametrize(("velocity", "stuck"), [(1e-4, True), (1e-3, False)])
def test_without_position_a_small_offset_of_velocity_is_no_motion(velocity: float, stuck: bool) -> None:
    """It hid a blocked rod, which without pressure was diagnosed as major leakage and major friction."""
    noise = 1e-3 * np.random.default_rng(1).standard_normal(10_000)
    gone = travels(Record(1e-3, {SPEED: np.full(10_000, 100.0), VELOCITY: velocity + noise}), RIG)
    assert gone is not None
    assert gone.stuck == stuck


def test_without_position_and_velocity_there_is_no_travel() -> None:
    assert travels(Record(1e-3, {SPEED: np.ones(2000)}), RIG) is None
