import numpy as np
import pytest
from numpy.typing import NDArray

from plant.errors import LogError, NoChannelError
from plant.log.checks import CheckedLog, Clock, checked_log
from plant.log.notes import LogCode

Values = NDArray[np.float64]
N = 1000
TIME = 1e-3 * np.arange(N)
SPEED = 100.0 * np.sin(2.0 * np.pi * 2.0 * TIME)
VELOCITY = 0.03 * np.sin(2.0 * np.pi * 2.0 * TIME)


def check(time: Values = TIME, **changes: Values) -> CheckedLog:
    log = {"time_s": time, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY, **changes}
    return checked_log(log, source="a.csv")


def with_gaps(values: Values, *rows: int) -> Values:
    out = values.copy()
    out[list(rows)] = np.nan
    return out


def test_a_clean_log_passes_without_a_note_and_unchanged() -> None:
    checked = check()
    assert checked.notes == ()
    assert checked.sample_time == pytest.approx(1e-3, rel=1e-12)
    np.testing.assert_array_equal(checked.channels["velocity_m_s"], VELOCITY)


@pytest.mark.parametrize("digits", [6, 9])
def test_times_rounded_when_printed_pass_silently(digits: int) -> None:
    time = np.array([float(f"{t:.{digits}g}") for t in 0.5 + TIME / 2])
    assert check(time).notes == ()


def test_times_since_the_epoch_pass_silently() -> None:
    checked = check(1.7e9 + TIME)
    assert checked.notes == ()
    assert checked.sample_time == pytest.approx(1e-3, rel=1e-6)


def test_the_sample_time_is_the_mean_of_rounded_steps() -> None:
    time = np.round(np.arange(N) / 3000.0, 6)
    assert check(time).sample_time == pytest.approx(1.0 / 3000.0, rel=1e-6)


def test_jitter_within_one_percent_is_resampled_with_a_note() -> None:
    rng = np.random.default_rng(1)
    time = TIME + 1e-3 * np.concatenate(([0.0], rng.uniform(-0.0045, 0.0045, N - 2), [0.0]))
    phase = 2.0 * np.pi * 2.0
    checked = check(time, velocity_m_s=0.03 * np.sin(phase * time))
    assert [note.code for note in checked.notes] == [LogCode.TIME_JITTERS]
    assert checked.notes[0].data["percent"] < 0.9
    even = checked.start_time + checked.sample_time * np.arange(N)
    np.testing.assert_allclose(checked.channels["velocity_m_s"], 0.03 * np.sin(phase * even), atol=2e-8)


def test_a_single_shifted_time_stamp_is_resampled_with_a_note() -> None:
    time = TIME.copy()
    time[700] += 0.01 * 1e-3
    (note,) = check(time).notes
    assert note.code == LogCode.TIME_JITTERS
    assert note.data["percent"] == pytest.approx(1.0, rel=1e-6)
    assert (
        str(note) == "time_s jitters by at most 1 % of the sample time of 0.001 s (0.045 % rms); the log was resampled"
    )


@pytest.mark.parametrize("share", [0.2, 0.35])
def test_a_signal_sampled_with_jitter_is_resampled_accurately_to_a_uniform_clock(share: float) -> None:
    time = TIME + 1e-3 * np.random.default_rng(1).uniform(-share, share, N)
    checked = check(time, velocity_m_s=0.03 * np.sin(40.0 * np.pi * time))
    assert [note.code for note in checked.notes] == [LogCode.TIME_JITTERS]
    assert checked.notes[0].data["rms_percent"] == pytest.approx(100.0 * share * (2.0 / 3.0) ** 0.5, rel=0.1)
    even = checked.start_time + checked.sample_time * np.arange(N)
    off = checked.channels["velocity_m_s"] - 0.03 * np.sin(40.0 * np.pi * even)
    assert np.sqrt(np.mean(off**2)) < 2e-5
    assert np.max(np.abs(off)) < 2e-4


def test_resampling_keeps_noise_white_and_its_standard_deviation() -> None:
    rng = np.random.default_rng(1)
    time = TIME + 1e-3 * rng.uniform(-0.2, 0.2, N)
    noise = check(time, velocity_m_s=rng.normal(0.0, 1e-3, N)).channels["velocity_m_s"]
    assert np.std(noise) == pytest.approx(1e-3, rel=0.05)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.1


def test_resampled_values_remain_multiples_of_the_sensor_resolution() -> None:
    time = TIME + 1e-3 * np.random.default_rng(1).uniform(-0.2, 0.2, N)
    counts = check(time, position_m=1e-6 * np.rint(1e4 * np.sin(6.0 * time))).channels["position_m"] / 1e-6
    np.testing.assert_allclose(counts, np.rint(counts), atol=1e-6)


def test_gaps_between_jittering_stamps_stay_gaps() -> None:
    keep = np.ones(N, dtype=bool)
    keep[[300, 301, 302, 700, 701]] = False
    time = (TIME + 1e-3 * np.random.default_rng(1).uniform(-0.2, 0.2, N))[keep]
    log = {"time_s": time, "motor_speed_rad_s": SPEED[keep], "velocity_m_s": VELOCITY[keep]}
    checked = checked_log(log, source="a")
    assert np.flatnonzero(np.isnan(checked.channels["velocity_m_s"])).tolist() == [300, 301, 302, 700, 701]


def test_time_steps_that_scatter_like_random_events_are_refused() -> None:
    time = np.cumsum(np.random.default_rng(1).uniform(0.2e-3, 1.8e-3, N))
    with pytest.raises(LogError, match=r"scatter by at most 35 % of the sample time|leaves out"):
        check(time)


@pytest.mark.parametrize(("sample_time", "quantum"), [(1e-3 / 3.0, 1e-5), (7e-4, 1e-3), (5e-4, 1e-3), (1e-3, 0.015625)])
def test_rounded_time_stamps_are_made_uniform_and_samples_do_not_change(sample_time: float, quantum: float) -> None:
    checked = check(np.round(sample_time * np.arange(N) / quantum) * quantum)
    assert [note.code for note in checked.notes] == [LogCode.TIME_ROUNDED]
    assert checked.notes[0].data["quantum_s"] == pytest.approx(quantum, rel=1e-3)
    assert checked.sample_time == pytest.approx(sample_time, rel=2.0 * quantum / (N * sample_time))
    np.testing.assert_array_equal(checked.channels["velocity_m_s"], VELOCITY)


def test_gaps_between_rounded_stamps_stay_gaps() -> None:
    keep = np.ones(N, dtype=bool)
    keep[[300, 301]] = False
    time = np.round(np.arange(N)[keep] / 3000.0, 5)
    log = {"time_s": time, "motor_speed_rad_s": SPEED[keep], "velocity_m_s": VELOCITY[keep]}
    checked = checked_log(log, source="a")
    assert np.flatnonzero(np.isnan(checked.channels["velocity_m_s"])).tolist() == [300, 301]


def test_a_missing_sample_stays_missing_through_resampling() -> None:
    time = TIME.copy()
    time[1::2] += 5e-6
    checked = check(time, velocity_m_s=with_gaps(VELOCITY, 10, 11, 500))
    assert np.flatnonzero(np.isnan(checked.channels["velocity_m_s"])).tolist() == [10, 11, 500]


@pytest.mark.parametrize("time", [np.zeros(N), TIME[::-1], np.concatenate([TIME[:500], TIME[:500]])])
def test_time_that_does_not_increase_is_refused(time: Values) -> None:
    with pytest.raises(LogError, match="must increase"):
        check(time)


def test_a_row_with_a_repeated_time_stamp_becomes_a_missing_sample() -> None:
    time = TIME.copy()
    time[41] = time[40]
    checked = check(time)
    assert checked.notes[0] == LogCode.TIME_REPEATS.note(channel="time_s", count=1, total=N, percent=0.1)
    assert np.flatnonzero(np.isnan(checked.channels["velocity_m_s"])).tolist() == [41]


@pytest.mark.parametrize("rows", [np.arange(N), np.array([40]), np.arange(300, 700, 7)])
def test_duplicate_rows_are_removed_and_no_sample_is_missing(rows: NDArray[np.int64]) -> None:
    twice = np.sort(np.concatenate([np.arange(N), rows]))
    copied = {"time_s": TIME, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY}
    checked = checked_log({name: values[twice] for name, values in copied.items()}, source="a.csv")
    assert [note.code for note in checked.notes] == [LogCode.TIME_REPEATS]
    np.testing.assert_array_equal(checked.channels["velocity_m_s"], VELOCITY)


def test_rows_absent_from_a_log_become_missing_samples_at_their_times() -> None:
    keep = np.ones(N, dtype=bool)
    keep[[100, 101, 600]] = False
    checked = checked_log(
        {"time_s": TIME[keep], "motor_speed_rad_s": SPEED[keep], "velocity_m_s": VELOCITY[keep]},
        source="a.csv",
    )
    velocity = checked.channels["velocity_m_s"]
    assert np.flatnonzero(np.isnan(velocity)).tolist() == [100, 101, 600]
    np.testing.assert_array_equal(velocity[keep], VELOCITY[keep])
    assert [(note.code, note.data["channel"], note.data["count"], note.data["total"]) for note in checked.notes] == [
        (LogCode.SAMPLES_MASKED, "motor_speed_rad_s", 3, 1000),
        (LogCode.SAMPLES_MASKED, "velocity_m_s", 3, 1000),
    ]
    assert (
        str(checked.notes[0]) == "motor_speed_rad_s is missing in 3 of 1000 samples (0.3 %); those samples are not used"
    )


def test_more_than_five_percent_left_out_is_refused() -> None:
    keep = np.ones(N, dtype=bool)
    keep[100:151] = False
    log = {"time_s": TIME[keep], "motor_speed_rad_s": SPEED[keep], "velocity_m_s": VELOCITY[keep]}
    with pytest.raises(LogError, match="leaves out 51 of 1000 samples"):
        checked_log(log, source="a.csv")


def every_tenth(values: Values, first: int) -> Values:
    slow = np.full(len(values), np.nan)
    slow[first::10] = values[first::10]
    return slow


def test_a_channel_that_is_logged_every_tenth_row_is_kept_with_a_note() -> None:
    checked = check(motor_speed_rad_s=every_tenth(SPEED, 0), differential_pressure_pa=every_tenth(1e6 * VELOCITY, 3))
    assert [(note.code, dict(note.data)) for note in checked.notes] == [
        (LogCode.CHANNEL_SLOWER, {"channel": "motor_speed_rad_s", "rows": 10}),
        (LogCode.CHANNEL_SLOWER, {"channel": "differential_pressure_pa", "rows": 10}),
    ]
    assert np.count_nonzero(np.isfinite(checked.channels["differential_pressure_pa"])) == N // 10


def test_a_channel_with_nine_tenths_missing_at_random_is_left_out() -> None:
    lost = np.where(np.random.default_rng(1).random(N) < 0.9, np.nan, 1e5)
    checked = check(differential_pressure_pa=lost)
    assert "differential_pressure_pa" not in checked.channels
    assert checked.notes[0].code == LogCode.CHANNEL_LEFT_OUT
    assert checked.notes[0].data["channel"] == "differential_pressure_pa"
    assert checked.notes[0].data["count"] == np.count_nonzero(np.isnan(lost))


@pytest.mark.parametrize(("first", "behind"), [(300, N), (0, 700), (200, 800)])
def test_a_log_is_cut_to_the_time_span_with_pressure(first: int, behind: int) -> None:
    pressure = np.full(N, np.nan)
    pressure[first:behind] = 1e5 * TIME[first:behind]
    checked = check(differential_pressure_pa=pressure)
    np.testing.assert_array_equal(checked.channels["differential_pressure_pa"], pressure[first:behind])
    np.testing.assert_array_equal(checked.channels["velocity_m_s"], VELOCITY[first:behind])
    assert checked.start_time == pytest.approx(TIME[first])
    (note,) = checked.notes
    assert note.code == LogCode.CHANNEL_LOGGED_IN_PART
    assert note.data["begin_s"] == pytest.approx(TIME[first])
    assert note.data["end_s"] == pytest.approx(TIME[behind - 1])


def test_a_log_is_cut_to_the_time_span_of_a_slowly_sampled_pressure_that_begins_late() -> None:
    pressure = np.full(N, np.nan)
    pressure[300::10] = 1e5
    checked = check(differential_pressure_pa=pressure)
    assert len(checked.channels["velocity_m_s"]) == N - 309
    assert [note.code for note in checked.notes] == [LogCode.CHANNEL_LOGGED_IN_PART, LogCode.CHANNEL_SLOWER]


@pytest.mark.parametrize("channel", ["differential_pressure_pa", "motor_voltage_v"])
def test_a_pressure_logged_under_half_of_the_time_or_another_channel_logged_in_part_is_left_out(channel: str) -> None:
    lost = np.full(N, 1.0)
    lost[: 600 if channel.endswith("pa") else 300] = np.nan
    checked = check(**{channel: lost})
    assert (channel in checked.channels, len(checked.channels["velocity_m_s"])) == (False, N)


def test_channels_with_different_time_stamps_are_resampled_to_those_of_the_fastest() -> None:
    when = TIME[5::10] + 3.7e-4
    rows = np.argsort(np.concatenate([TIME, when]), kind="stable")
    none, nothing = np.full(len(when), np.nan), np.full(N, np.nan)
    ramp = 1e5 + 1e6 * when
    log = {
        "time_s": np.concatenate([TIME, when]),
        "motor_speed_rad_s": np.concatenate([SPEED, none]),
        "velocity_m_s": np.concatenate([VELOCITY, none]),
        "differential_pressure_pa": np.concatenate([nothing, ramp]),
    }
    checked = checked_log({name: values[rows] for name, values in log.items()}, source="a.csv")
    pressure = checked.channels["differential_pressure_pa"]
    np.testing.assert_array_equal(checked.channels["velocity_m_s"], VELOCITY)
    assert np.flatnonzero(np.isfinite(pressure)).tolist() == list(range(5, N, 10))
    np.testing.assert_allclose(pressure[15:-10:10], 1e5 + 1e6 * TIME[15:-10:10], rtol=1e-12)
    assert checked.notes[0].code == LogCode.TIMES_OF_THEIR_OWN
    assert checked.notes[0].data["channel"] == "motor_speed_rad_s"
    assert checked.notes[0].data["sample_time_s"] == pytest.approx(1e-3, rel=1e-9)


def test_a_clock_shift_of_less_than_a_sample_is_corrected_in_a_log_with_missing_samples() -> None:
    time = TIME.copy()
    time[500:] += 4e-4
    checked = check(time, motor_speed_rad_s=with_gaps(SPEED, 3), velocity_m_s=with_gaps(VELOCITY, 7))
    assert checked.notes[0].code == LogCode.TIME_JITTERS
    assert np.flatnonzero(np.isnan(checked.channels["motor_speed_rad_s"])).tolist() == [3]


@pytest.mark.parametrize("count", [0, 1, 9])
def test_fewer_than_ten_samples_are_refused(count: int) -> None:
    part = {"time_s": TIME, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY}
    with pytest.raises(LogError, match=f"at least 10 samples are needed, got {count}"):
        checked_log({name: values[:count] for name, values in part.items()}, source="a.csv")


@pytest.mark.parametrize("lost", ["time_s", "motor_speed_rad_s"])
def test_a_missing_required_column_is_named(lost: str) -> None:
    log = {"time_s": TIME, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY}
    del log[lost]
    with pytest.raises(LogError, match=rf"a\.csv: column {lost} is missing; the log has {', '.join(log)}$"):
        checked_log(log, source="a.csv")


def test_a_log_with_neither_position_nor_velocity_is_refused() -> None:
    with pytest.raises(LogError, match="position_m or velocity_m_s is missing"):
        checked_log({"time_s": TIME, "motor_speed_rad_s": SPEED}, source="a.csv")


def test_differential_pressure_is_derived_from_both_port_pressures() -> None:
    a, b = 2e6 + 1e4 * SPEED, 1e6 - 1e4 * SPEED
    checked = check(pressure_a_pa=a, pressure_b_pa=b)
    np.testing.assert_array_equal(checked.channels["differential_pressure_pa"], a - b)
    measured = 2.1e4 * SPEED
    kept = check(pressure_a_pa=a, pressure_b_pa=b, differential_pressure_pa=measured)
    np.testing.assert_array_equal(kept.channels["differential_pressure_pa"], measured)
    alone = check(pressure_a_pa=a)
    assert "differential_pressure_pa" not in alone.channels
    assert LogCode.CHAMBER_ALONE.note(channel="pressure_a_pa", other="pressure_b_pa") in alone.notes


def test_the_clock_in_the_metadata_is_used_only_if_the_time_stamps_agree() -> None:
    log = {"time_s": 0.1 + TIME, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY}
    same = checked_log(log, source="a.csv", clock=Clock(1e-3, 0.1))
    assert (same.sample_time, same.start_time) == (1e-3, 0.1)
    other = checked_log(log, source="a.csv", clock=Clock(2e-3, 0.1))
    assert other.sample_time == pytest.approx(1e-3, rel=1e-9)


def test_rows_without_a_time_are_left_out_up_to_five_percent() -> None:
    few = check(with_gaps(TIME, 3, 400, 401))
    assert few.notes[0] == LogCode.TIME_MISSING.note(channel="time_s", count=3, total=N, percent=0.3)
    assert few.sample_time == pytest.approx(1e-3)
    with pytest.raises(LogError, match=r"time_s is missing in 60 of 1000 samples \(6 %\), at most 5 % may be"):
        check(with_gaps(TIME, *range(60)))
    short = {"time_s": with_gaps(TIME[:10], 3), "motor_speed_rad_s": SPEED[:10], "velocity_m_s": VELOCITY[:10]}
    with pytest.raises(LogError, match="time_s is missing in 1 of 10 samples"):
        checked_log(short, source="a.csv")


def test_a_log_without_a_sufficiently_sampled_channel_beside_time_is_refused() -> None:
    with pytest.raises(NoChannelError, match="at least one channel is needed beside time_s"):
        checked_log({"time_s": TIME}, source="a.csv", required=())
    hardly = np.where(np.random.default_rng(1).random(N) < 0.5, SPEED, np.nan)
    with pytest.raises(LogError, match="no channel has 95 % of its samples"):
        checked_log({"time_s": TIME, "motor_speed_rad_s": hardly}, source="a.csv", required=())
    kept = checked_log(
        {"time_s": TIME, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY, "position_m": hardly * np.nan},
        source="a.csv",
    )
    assert list(kept.channels) == ["motor_speed_rad_s", "velocity_m_s"]


def test_a_channel_that_is_logged_every_second_row_is_kept_with_a_note() -> None:
    half = np.where(np.arange(N) % 2 == 0, 1e6 * VELOCITY, np.nan)
    checked = check(differential_pressure_pa=half)
    assert [(note.code, dict(note.data)) for note in checked.notes] == [
        (LogCode.CHANNEL_SLOWER, {"channel": "differential_pressure_pa", "rows": 2})
    ]


@pytest.mark.parametrize(("lost", "kept"), [(4, True), (5, False)])
def test_a_slowly_sampled_channel_needs_95_percent_of_its_samples_between_first_and_last(lost: int, kept: bool) -> None:
    rows = np.arange(9, N - 10, 10)  # 99 samples: the log begins before the first, and ends after the last
    slow = np.full(N, np.nan)
    slow[np.delete(rows, np.arange(10, 10 + 2 * lost, 2))] = 1e5
    assert ("differential_pressure_pa" in check(differential_pressure_pa=slow).channels) is kept
