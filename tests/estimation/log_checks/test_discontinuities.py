"""A reset zero is subtracted, lost rows end a part of the log, and plain motion does neither."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.discontinuities import pressure_strays, without_discontinuities
from estimation.notes import ChannelCode, SensorCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, Sensors
from tests.estimation.log_checks.made_logs import circuit_log

SPEED, POSITION, VELOCITY = "motor_speed_rad_s", "position_m", "velocity_m_s"
PRESSURE = "differential_pressure_pa"
ROW = 1500


def stepped(record: Record, channel: str, size: float) -> Record:
    return record.replace(**{channel: record[channel] + np.where(np.arange(len(record)) < ROW, 0.0, size)})


@pytest.mark.parametrize("sensors", [BENCH, IDEAL])
@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "chirp", "sine"])
def test_a_log_without_discontinuities_is_unchanged(drive: str, sensors: Sensors) -> None:
    record = circuit_log(drive, sensors)
    assert without_discontinuities(record) == (record, ())
    still = record.replace(**{VELOCITY: None})
    assert without_discontinuities(still) == (still, ())


@pytest.mark.parametrize("drive", ["steps", "multisine", "sine"])
def test_a_reset_of_the_position_zero_is_named_and_subtracted(drive: str) -> None:
    record = circuit_log(drive)
    found, (note,) = without_discontinuities(stepped(record, POSITION, 0.004))
    assert note.code is SensorCode.POSITION_REZEROED
    assert note.data["step"] == pytest.approx(0.004, abs=1e-5)
    assert note.data["at_s"] == pytest.approx(record.start_time + ROW * record.sample_time)
    assert np.allclose(found[POSITION], record[POSITION], rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("drive", ["steps", "multisine", "sine"])
def test_a_reset_of_the_pressure_zero_is_named_and_the_longer_part_used(drive: str) -> None:
    given = stepped(circuit_log(drive), PRESSURE, 1e6)
    found, (note,) = without_discontinuities(given)
    assert note.code is SensorCode.PRESSURE_REZEROED
    assert note.data["step"] == pytest.approx(1e6, rel=0.03)
    assert note.data["begin_s"] == pytest.approx(found.start_time) == pytest.approx(1e-3 * ROW)
    assert np.array_equal(found[PRESSURE], given[PRESSURE][ROW:])


@pytest.mark.parametrize(("rows", "named"), [(1, True), (3, False)])
def test_a_pressure_that_rises_over_several_rows_was_not_rezeroed(rows: int, *, named: bool) -> None:
    """A piston that bounces off a stop raises a small chamber by 60 bar in four rows: the log was cut there."""
    record = circuit_log("multisine")
    risen = 2e6 * np.clip(np.arange(len(record)) - ROW + 1, 0, rows)
    _, notes = without_discontinuities(record.replace(**{PRESSURE: record[PRESSURE] + risen}))
    assert [note.code for note in notes] == [SensorCode.PRESSURE_REZEROED] * named


@pytest.mark.parametrize(("drive", "rows"), [("multisine", 120), ("multisine", 400), ("prbs", 400)])
def test_lost_rows_are_named_and_the_longest_part_is_used(drive: str, rows: int) -> None:
    record = circuit_log(drive)
    kept = np.delete(np.arange(len(record)), np.arange(ROW, ROW + rows))
    found, (note,) = without_discontinuities(Record(1e-3, {name: record[name][kept] for name in record}))
    assert note.code is SensorCode.ROWS_LOST
    assert POSITION in note.data["jumped"]
    assert found.start_time == pytest.approx(ROW * 1e-3)
    assert np.array_equal(found[PRESSURE], record[PRESSURE][ROW + rows :])


def test_a_motor_step_within_a_row_is_no_reset_of_the_pressure_zero() -> None:
    """In a run without noise nothing else jumps as far, so a step of the motor was called lost rows."""
    record = circuit_log("steps", IDEAL)
    pressure = record[PRESSURE] + np.where(np.arange(len(record)) < ROW, 0.0, 3e6)
    speed = record[SPEED] + np.where(np.arange(len(record)) < ROW, 0.0, 400.0)
    given = record.replace(**{PRESSURE: pressure, SPEED: speed})
    assert without_discontinuities(given) == (given, ())


@pytest.mark.parametrize(("first", "named"), [(0.0, False), (100.0, True)])
def test_the_first_rise_of_pressure_from_rest_is_no_reset_of_its_zero(first: float, *, named: bool) -> None:
    """Until one chamber draws make-up oil, both raise pressure: it rose twice as fast as at any later time."""
    record, rows = circuit_log("multisine"), np.arange(4000)
    speed = np.where(rows < ROW, first, record[SPEED])
    speed[ROW : ROW + 20] = np.linspace(first, record[SPEED][ROW + 20], 20)
    pressure = np.where(rows < ROW, record[PRESSURE][ROW], record[PRESSURE]) + np.where(rows < ROW + 12, 0.0, 1e6)
    position = np.where(rows < ROW, record[POSITION][ROW], record[POSITION])
    given = record.replace(**{SPEED: speed, PRESSURE: pressure, POSITION: position, VELOCITY: None})
    assert (SensorCode.PRESSURE_REZEROED in [note.code for note in without_discontinuities(given)[1]]) == named


def test_a_reset_of_the_pressure_zero_at_low_motor_speed_is_named() -> None:
    """Everything before the motor reached half its top speed was taken for its start."""
    record, rows = circuit_log("multisine"), np.arange(4000)
    slow = np.where(rows < 500, 0.0, np.where(rows < 3500, 0.2 * record[SPEED], 5.0 * record[SPEED]))
    pressure = record[PRESSURE] + np.where(rows < ROW, 0.0, 1e6)
    given = record.replace(**{SPEED: slow, PRESSURE: pressure, VELOCITY: None})
    assert SensorCode.PRESSURE_REZEROED in [note.code for note in without_discontinuities(given)[1]]


def test_a_piston_that_hits_a_stop_is_neither_lost_rows_nor_a_reset_zero() -> None:
    """A load pulls it there; pump and pressure then change within a row. The part after it gave oil 17 % too soft."""
    time = 1e-3 * np.arange(3000)
    free = np.arange(3000) < ROW
    position = np.where(free, 0.05 * time, 0.05 * time[ROW])
    pressure = -3e6 + 2e5 * np.sin(20.0 * time) + np.where(free, 0.0, 1.5e6)
    rng = np.random.default_rng(2)
    channels = {
        SPEED: 60.0 * np.sin(20.0 * time) + rng.normal(0.0, 0.01, 3000),
        POSITION: position + rng.normal(0.0, 1e-7, 3000),
        VELOCITY: np.where(free, 0.05, 0.0) + rng.normal(0.0, 1e-4, 3000),
        PRESSURE: pressure + rng.normal(0.0, 1e4, 3000),
    }
    record = Record(1e-3, channels)
    assert without_discontinuities(record) == (record, ())
    goes_on = record.replace(**{POSITION: 0.05 * time + rng.normal(0.0, 1e-7, 3000)})
    assert without_discontinuities(goes_on)[1]


@pytest.mark.parametrize("stopped", [True, False])
def test_a_stop_that_yields_over_milliseconds_is_recognised_at_5_khz(stopped: bool) -> None:
    """At 5 kHz a stop of a healthy small cylinder was taken for a reset pressure zero, and its log was unknown."""
    rng, time = np.random.default_rng(3), 2e-4 * np.arange(10000)
    hit = time[5000]
    beyond = 8e-5 * (1.0 - np.exp(-np.maximum(time - hit, 0.0) / 2e-3)) if stopped else 0.05 * (time - hit)
    position = np.where(time < hit, 0.05 * (time - hit), beyond)
    channels = {
        SPEED: 60.0 + 20.0 * np.sin(20.0 * time) + rng.normal(0.0, 0.01, 10000),
        POSITION: position + rng.normal(0.0, 1e-8, 10000),
        VELOCITY: np.gradient(position, time) + rng.normal(0.0, 1e-4, 10000),
        PRESSURE: 2e5 * np.sin(20.0 * time) + np.where(time > hit, 1.5e6, 0.0) + rng.normal(0.0, 5e3, 10000),
    }
    assert (without_discontinuities(Record(2e-4, channels))[1] == ()) == stopped


def test_a_position_that_is_held_for_a_while_becomes_missing_samples() -> None:
    record = circuit_log("multisine")
    held = record[POSITION].copy()
    held[ROW : ROW + 100] = held[ROW]
    clean = clean_log(record.replace(**{POSITION: held}), EhaParameters())
    (note,) = (one for one in clean.left_out if one.code is SensorCode.HELD_ALONE)
    assert note.data["channel"] == POSITION
    assert np.flatnonzero(np.isnan(clean.record[POSITION])).tolist() == list(range(ROW + 1, ROW + 100))
    assert clean.objections == ()


def test_a_spike_a_short_log_and_a_slow_one_have_no_steps() -> None:
    record = circuit_log("multisine")
    spike = record[POSITION].copy()
    spike[ROW] += 0.01
    for given in (record.replace(**{POSITION: spike}), stepped(record, POSITION, 0.01).slice(1300, 1700)):
        assert without_discontinuities(given) == (given, ())
    slow = stepped(record, PRESSURE, 1e6).slice(0, None, 3)
    assert without_discontinuities(slow) == (slow, ())


def test_a_swapped_position_and_velocity_is_named_and_no_reset_zero_is_found() -> None:
    record = circuit_log("multisine")
    jerky = record[VELOCITY] + np.where(np.arange(len(record)) < ROW, 0.0, 0.004)
    clean = clean_log(record.replace(**{POSITION: jerky, VELOCITY: record[POSITION]}), EhaParameters())
    assert [note.code for note in clean.mistakes] == [ChannelCode.CHANNELS_SWAPPED]
    assert not {SensorCode.POSITION_REZEROED, SensorCode.ROWS_LOST} & {note.code for note in clean.left_out}


@pytest.mark.parametrize("noisy", [False, True])
def test_pressure_strays_are_residuals_of_a_trimmed_least_squares_fit(noisy: bool) -> None:
    record = circuit_log("steps")
    pressure = record[PRESSURE].copy()
    pressure[700:720] = np.nan
    record = record.replace(**{PRESSURE: pressure})
    found = pressure_strays(record, noisy=noisy)
    speed, position, rise = record[SPEED], record[POSITION], np.diff(pressure)
    pumped, swept = 0.5e-3 * (speed[1:] + speed[:-1]), np.diff(position)
    columns = [
        *(np.roll(one, k) for one in (swept, pumped) for k in (-1, 0, 1)),
        0.5e-3 * (pressure[1:] + pressure[:-1]),
    ]
    columns += [1e-3 * np.sign(pumped), *((np.roll(rise, 1),) if noisy else ())]
    rows = np.stack(columns, axis=1)
    rows[[0, -1]] = 0.0
    there = np.isfinite(rise) & np.isfinite(rows).all(axis=1)
    kept, wanted = there, rise
    for _ in range(3):
        size = np.linalg.norm(rows[kept], axis=0)
        wanted = rise - (rows / size) @ np.linalg.lstsq(rows[kept] / size, rise[kept])[0]
        far = np.abs(wanted)
        kept = kept & (far <= 3.0 * np.sort(far[kept])[int(0.99 * (np.count_nonzero(kept) - 1))])
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-6 * np.nanmax(np.abs(wanted)))
    assert np.isnan(found[705])
