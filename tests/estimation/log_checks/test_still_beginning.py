import numpy as np
import pytest

from estimation.log_checks.still_beginning import REST, without_still_beginning
from plant.arrays import Array
from plant.log.record import Record

RATE = 100.0


def log(rest: float, motion: float, *, position: Array | None = None, offset: float = 0.0) -> Record:
    """Return a log at 100 Hz whose motor stands still at first, and then turns to and fro [both s]."""
    t = np.arange(round((rest + motion) * RATE)) / RATE
    rng = np.random.default_rng(1)
    turns = np.where(t >= rest, np.sin(2.0 * np.pi * (t - rest)), 0.0)
    speed = 100.0 * turns + 0.05 * rng.standard_normal(t.size) + offset
    path = np.cumsum(0.05 * turns) / RATE if position is None else position
    return Record(1.0 / RATE, {"motor_speed_rad_s": speed, "position_m": path + 1e-6 * rng.standard_normal(t.size)})


def test_a_long_log_begins_just_before_it_moves_and_keeps_its_clock() -> None:
    found = without_still_beginning(log(40.0, 10.0), 30.0)
    assert found.start_time == pytest.approx(40.0 - REST, abs=0.05)
    assert found.duration == pytest.approx(10.0 + REST, abs=0.05)


def test_an_offset_of_motor_speed_is_no_motion() -> None:
    assert without_still_beginning(log(40.0, 10.0, offset=0.5), 30.0).start_time > 39.0


def test_velocity_tells_where_there_is_no_position() -> None:
    whole = log(40.0, 10.0)
    rng, moves = np.random.default_rng(2), np.arange(len(whole)) >= 40.0 * RATE
    noisy = 0.05 * moves * np.sign(whole["motor_speed_rad_s"]) + 1e-3 * rng.standard_normal(len(whole))
    found = without_still_beginning(whole.replace(position_m=None, velocity_m_s=noisy), 30.0)
    assert found.start_time == pytest.approx(40.0 - REST, abs=0.05)


@pytest.mark.parametrize("record", [log(5.0, 10.0), log(0.0, 50.0), log(0.3, 50.0)], ids=["short", "moves", "at once"])
def test_other_logs_are_left_as_they_are(record: Record) -> None:
    assert without_still_beginning(record, 30.0) is record


def test_a_piston_that_creeps_while_the_motor_rests_is_kept() -> None:
    creep = np.concatenate([np.linspace(0.0, 5e-3, 4000), np.full(1000, 5e-3)])
    assert without_still_beginning(log(40.0, 10.0, position=creep), 30.0).start_time < 1.0


def test_a_log_in_which_nothing_moves_is_left_as_it_is() -> None:
    still = Record(1.0 / RATE, {"motor_speed_rad_s": np.zeros(5000), "position_m": np.zeros(5000)})
    assert without_still_beginning(still, 30.0) is still
