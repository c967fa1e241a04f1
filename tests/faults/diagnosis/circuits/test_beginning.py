"""With what a log begins: pressure, motion, and the time that does not count."""

import numpy as np
import pytest

from faults.diagnosis.circuits.beginning import SETTLING, SLIDING_SETTLING, TURNING_SETTLING, Beginning, beginning_of
from faults.diagnosis.circuits.blocks import blocks_of
from plant.log.record import Record
from tests.faults.diagnosis.circuits.test_blocks import PRESSURE, running


@pytest.mark.parametrize(
    ("seconds", "first", "pressure", "settling"),
    [
        (11.0, 60.0, False, SLIDING_SETTLING),
        (3.0, 60.0, False, 0.9),
        (6.0, 0.0, False, SETTLING),
        (6.0, 60.0, True, SETTLING),
    ],
)
def test_without_pressure_a_log_that_begins_in_motion_has_a_longer_settling_time(
    seconds: float, first: float, pressure: bool, settling: float
) -> None:
    log = running(seconds, first)
    blocks = blocks_of(log if pressure else log.replace(**{PRESSURE: None}))
    assert blocks.settling == pytest.approx(settling, rel=2e-3)
    assert blocks.first == round(blocks.settling / 0.01)
    assert blocks.start_velocity == (0.0 if pressure or not first else blocks.velocity[0])
    assert len(blocks.valid) == len(blocks.velocity) - blocks.first


@pytest.mark.parametrize(("velocity", "settling"), [(0.02, SLIDING_SETTLING), (1e-5, TURNING_SETTLING)])
def test_a_piston_that_rests_while_the_motor_turns_settles_sooner_than_one_that_slides(
    velocity: float, settling: float
) -> None:
    record = Record(1e-2, {"motor_speed_rad_s": np.full(2000, 60.0)})
    found = beginning_of(record, None, np.append(velocity, np.full(1999, 0.02)))
    assert found == Beginning(None, None, velocity if velocity == 0.02 else 0.0, settling)


@pytest.mark.parametrize(("first", "begun"), [(1e6, (1e6, 0.02)), (1e3, None), (np.nan, None)])
def test_a_log_begins_under_a_pressure_that_is_more_than_noise(first: float, begun: tuple[float, float] | None) -> None:
    record = Record(1e-2, {"motor_speed_rad_s": np.full(2000, 60.0)})
    found = beginning_of(record, np.append(first, np.full(1999, 1e6)), np.full(2000, 0.02))
    assert found == Beginning(begun, None if np.isnan(first) else (first, 0.02), 0.0, SETTLING)


def test_a_log_whose_blocks_know_no_velocity_begins_at_rest() -> None:
    record = Record(1e-2, {"motor_speed_rad_s": np.full(2000, 60.0)})
    unknown = np.full(2000, np.nan)
    assert beginning_of(record, None, unknown) == Beginning(None, None, 0.0, TURNING_SETTLING)
