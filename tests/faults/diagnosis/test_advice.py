"""Advice depends on what a log contains: it does not ask for what is already there."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.finding import Quantity
from estimation.notes import EstimateCode, RigCode, SensorCode
from faults.conditions import CONDITIONS
from faults.diagnosis.advice import advice_for, held_speed_count, oil_advice, rig_advice
from faults.notes import AdviceCode, AgainstCode, ClassCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note
from plant.sensors.sensors import drop_samples

HEALTHY = EhaParameters()
PRESSURE = "differential_pressure_pa"
ALL = ("velocity_m_s", PRESSURE)
SURE = dict.fromkeys(CONDITIONS, 0.0) | {"normal": 1.0}
UNSURE = dict.fromkeys(CONDITIONS, 0.0) | {"normal": 0.6, "minor_leakage": 0.4}
ALIKE = (ClassCode.LEAKAGE_AND_BIAS_ALIKE.note(),)


def staircase(levels: list[float], dwell: float = 0.5, sample_time: float = 1e-3, noise: float = 0.0) -> Record:
    """Return levels held one after the other, behind a motor's lag of 10 ms."""
    wanted = np.repeat(levels, max(1, round(dwell / sample_time)))
    share, speed = 1.0 - np.exp(-sample_time / 0.01), np.empty(len(wanted))
    now = 0.0
    for place, level in enumerate(wanted):
        now += share * (level - now)
        speed[place] = now
    speed += noise * np.random.default_rng(4).standard_normal(len(speed))
    return Record(sample_time, {"motor_speed_rad_s": speed})


def codes(notes: tuple[Note, ...]) -> list[str]:
    return [note.code for note in notes]


@pytest.mark.parametrize("noise", [0.0, 0.05, 1.0])
@pytest.mark.parametrize("sample_time", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize(
    ("levels", "count"),
    [
        ([100.0, -100.0, 100.0], 1),
        ([0.0, 60.0], 1),
        ([50.0, -100.0], 2),
        ([100.0, 90.0, 100.0, 90.0], 2),
        ([0.0, 30.0, 0.0, -60.0, 90.0, -120.0, 60.0, 30.0, -90.0], 4),
    ],
)
def test_held_speeds_are_counted(levels: list[float], count: int, sample_time: float, noise: float) -> None:
    assert held_speed_count(staircase(levels, sample_time=sample_time, noise=noise)) == count


def test_a_drive_that_never_settles_and_a_motor_at_rest_hold_no_speed() -> None:
    time = 1e-3 * np.arange(5000)
    assert held_speed_count(Record(1e-3, {"motor_speed_rad_s": 100.0 * np.sin(2.0 * np.pi * 5.0 * time)})) == 0
    assert held_speed_count(Record(1e-3, {"motor_speed_rad_s": np.zeros(5000)})) == 0
    assert held_speed_count(Record(1e-3, {"motor_speed_rad_s": 100.0 * np.ones(3)})) == 0
    assert held_speed_count(Record(1e-3, {"motor_speed_rad_s": np.full(100, np.nan)})) == 0


def test_held_speeds_are_counted_despite_gaps_slow_sensors_and_long_logs() -> None:
    record = staircase([40.0, -80.0, 120.0, 80.0], dwell=1.0, noise=0.05)
    assert held_speed_count(drop_samples(record, 0.05, np.random.default_rng(1))) == 3
    slow = np.where(np.arange(len(record)) % 10 == 3, record["motor_speed_rad_s"], np.nan)
    assert held_speed_count(record.replace(motor_speed_rad_s=slow)) == 3
    assert held_speed_count(staircase([40.0, 80.0] * 100, dwell=0.15)) == 2


def test_a_slow_log_shows_a_held_speed_by_four_samples() -> None:
    speed = np.tile(np.repeat([100.0, 60.0], 4), 5)
    assert held_speed_count(Record(0.05, {"motor_speed_rad_s": speed})) == 2
    assert held_speed_count(Record(0.05, {"motor_speed_rad_s": np.tile(np.repeat([100.0, 60.0], 2), 10)})) == 0


def test_a_slow_ramp_counts_as_two_held_speeds() -> None:
    ramp = np.linspace(0.0, 100.0, 20_000)
    assert held_speed_count(Record(1e-3, {"motor_speed_rad_s": ramp})) == 2


def test_the_published_sine_holds_one_speed_at_most_and_steps_hold_several() -> None:
    rng = np.random.default_rng(2)
    held = {
        name: held_speed_count(Record(1e-3, {"motor_speed_rad_s": make_drive(name, 10.0, 1e-3, HEALTHY, rng)}))
        for name in ("sine", "prbs", "steps")
    }
    assert held["sine"] <= 1
    assert held["prbs"] <= 1
    assert held["steps"] >= 2


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("sample_time", [5e-4, 2e-3])
def test_closer_speeds_are_advised_for_a_log_with_two_or_more_held_speeds(seed: int, sample_time: float) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 12))
    levels = rng.permutation(np.linspace(1.0, 0.15, count)) * rng.choice([-1.0, 1.0], count) * 120.0
    record = staircase(list(levels), float(rng.uniform(0.2, 1.5)), sample_time, float(rng.choice([0.0, 0.05, 1.0])))
    assert held_speed_count(record) >= 2
    for shares in (SURE, UNSURE):
        (first, *_) = advice_for(record, shares, (), ALIKE, ALL)
        assert first.code == AdviceCode.CLOSER_SPEEDS
        assert first.data["speeds"] >= 2


def test_more_speeds_are_advised_for_a_log_with_one_held_speed() -> None:
    (said,) = advice_for(staircase([100.0, -100.0]), SURE, (), ALIKE, ALL)
    assert said == AdviceCode.MORE_SPEEDS.note(speeds=1)


def test_more_speeds_are_advised_if_a_worn_pump_is_not_excluded() -> None:
    worn = (ClassCode.WEAR_NOT_TOLD.note(percent=5.0, limit=90.0),)
    (said,) = advice_for(staircase([100.0, -100.0]), SURE, (), worn, ALL)
    assert said == AdviceCode.MORE_SPEEDS.note(speeds=1)
    assert codes(advice_for(staircase([100.0, -50.0, 20.0]), SURE, (), worn, ALL)) == [AdviceCode.NOTHING]


def test_a_drive_that_draws_oil_is_advised_if_a_make_up_valve_never_opened() -> None:
    unseen = (RigCode.MAKEUP_UNSEEN.note(side="B"),)
    assert advice_for(staircase([100.0]), SURE, (), unseen, ALL) == (AdviceCode.DRAW_OIL.note(side="B"),)


def test_nothing_is_advised_after_a_sure_verdict() -> None:
    assert codes(advice_for(staircase([100.0]), SURE, (), (), ALL)) == [AdviceCode.NOTHING]


def test_logging_pressure_and_moving_the_piston_are_advised_before_a_longer_log() -> None:
    unseen = (ClassCode.FRICTION_NOT_VISIBLE.note(),)
    said = advice_for(staircase([100.0]), UNSURE, (), unseen, ("velocity_m_s",))
    assert codes(said) == [AdviceCode.LOG_PRESSURE, AdviceCode.MOVE_PISTON, AdviceCode.LOG_LONGER]
    assert said[-1].data["duration_s"] == pytest.approx(0.499)


def test_no_longer_log_is_advised_after_a_long_log_with_undecided_conditions() -> None:
    assert codes(advice_for(staircase([100.0] * 24), UNSURE, (), (), ALL)) == [AdviceCode.CONDITIONS_OPEN]


def test_larger_steps_are_advised_once() -> None:
    unseen = (ClassCode.FRICTION_NOT_VISIBLE.note(),)
    assert codes(advice_for(staircase([100.0] * 24), UNSURE, (), unseen, ALL)) == [AdviceCode.MOVE_PISTON]


def test_advice_on_an_objection_replaces_all_other_advice() -> None:
    record = staircase([100.0])
    froze = SensorCode.SENSOR_FROZE.note(channel="position_m", value=0.0, begin_s=0.0, length_s=1.0)
    clipped = SensorCode.SENSOR_CLIPPED.note(channel=PRESSURE, levels="1e6", percent=3.0)
    residuals = EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=38.0)
    assert advice_for(record, UNSURE, (froze, residuals, clipped), ALIKE, ALL) == (
        AdviceCode.CHECK_SENSOR.note(channels=f"position_m and {PRESSURE}"),
    )
    disagree = SensorCode.SENSORS_DISAGREE.note(difference_m_s=0.1)
    assert advice_for(record, UNSURE, (disagree,), (), ALL) == (
        AdviceCode.CHECK_SENSOR.note(channels="position_m and velocity_m_s"),
    )
    for against in (residuals, AgainstCode.NONE_FITS.note(percent=90.0)):
        assert codes(advice_for(record, UNSURE, (against,), (), ALL)) == [AdviceCode.FIT_DOUBTED]
    assert codes(advice_for(record, UNSURE, (AgainstCode.OIL_SOFT.note(share=0.4),), (), ALL)) == [AdviceCode.CHECK_RIG]
    contradicted = EstimateCode.RIG_CONTRADICTED.note(percent=200.0)
    assert codes(advice_for(record, UNSURE, (contradicted, residuals), (), ALL)) == [AdviceCode.CHECK_RIG]
    smoothed = EstimateCode.PRESSURE_SMOOTHED.note(channel="c")  # its fit contradicts no rig file
    (said,) = advice_for(record, UNSURE, (smoothed, contradicted, residuals), (), ALL)
    assert said == AdviceCode.LOG_UNFILTERED.note(channel="c")


def test_faster_sampling_is_advised_for_an_unsure_log_at_100_hz_or_less() -> None:
    slow = Record(0.01, {"motor_speed_rad_s": np.full(200, 100.0)})
    assert codes(advice_for(slow, UNSURE, (), (), ALL)) == [AdviceCode.LOG_FASTER, AdviceCode.LOG_LONGER]
    doubted = (AgainstCode.NONE_FITS.note(percent=90.0),)
    assert codes(advice_for(slow, UNSURE, doubted, (), ALL)) == [AdviceCode.LOG_FASTER, AdviceCode.FIT_DOUBTED]
    assert codes(advice_for(slow, SURE, (), (), ALL)) == [AdviceCode.NOTHING]


def test_without_probabilities_only_objections_get_advice() -> None:
    assert advice_for(staircase([100.0]), {}, (), (), ALL) == ()
    (mend,) = advice_for(staircase([100.0]), {}, (AgainstCode.NONE_FITS.note(percent=90.0),), (), ALL)
    assert mend.code == AdviceCode.FIT_DOUBTED


def test_repair_of_a_fault_outside_the_nine_is_advised_before_a_check_of_the_rig_file() -> None:
    grows = RigCode.LEAKAGE_GROWS.note(factor=12.0, first=5e-12, last=6e-11)
    blocked = RigCode.MAKEUP_BLOCKED.note(side="B")
    outside = AgainstCode.OUTSIDE_CONDITIONS.note()
    assert advice_for(staircase([100.0]), SURE, (grows, outside), (), ALL) == (AdviceCode.STOP_LEAKAGE.note(),)
    assert advice_for(staircase([100.0]), SURE, (blocked,), (), ALL) == (AdviceCode.CHECK_MAKEUP.note(side="B"),)


STARVES = RigCode.PUMP_STARVES.note(from_rad_s=80.0, percent=12.0, half_width=1.0, fastest_rad_s=150.0)


@pytest.mark.parametrize(
    ("fault", "work"),
    [
        (RigCode.PUMP_WORN.note(percent=70.0, half_width=1.0), AdviceCode.CHECK_PUMP.note()),
        (RigCode.RELIEF_LOW.note(setting_pa=2e6, half_width_pa=1e4, rig_pa=3e6), AdviceCode.CHECK_RELIEF.note()),
        (RigCode.AIR_ENTERS.note(percent=1.0, half_width=0.1, percent_of_log=40.0), AdviceCode.FIND_AIR.note()),
        (RigCode.PORT_DRAINS.note(side="A", drain=1e-12), AdviceCode.CHECK_MAKEUP.note(side="A")),
        (RigCode.BORE_LEAKS.note(at_mm=4.0, width_mm=3.0, factor=9.0), AdviceCode.INSPECT_BORE.note(at_mm=4.0)),
        (RigCode.TOOTH_LEAKS.note(factor=9.0), AdviceCode.INSPECT_PUMP.note()),
        (STARVES, AdviceCode.CHECK_INLET.note()),
        (RigCode.LEAKAGE_LIFTS.note(from_pa=6e5, highest_pa=9e5, factor=4.0), AdviceCode.CHECK_VALVES.note()),
        (RigCode.LEAKS_ONE_WAY.note(side="A", factor=4.0), AdviceCode.CHECK_VALVES.note()),
        (AgainstCode.PUMP_DELIVERS_LESS.note(percent=80.0), AdviceCode.CHECK_PUMP.note()),
        (AgainstCode.MAKEUP_STUCK.note(side="B"), AdviceCode.CHECK_MAKEUP.note(side="B")),
        (AgainstCode.STUCK_OR_LEAKS.note(moved_m=1e-5, pumped_m=0.04), AdviceCode.FREE_PISTON.note()),
        (AgainstCode.MAKEUP_LEAKS.note(), AdviceCode.CHECK_MAKEUP.note(side="A or B")),
        (AgainstCode.OIL_SOFTENS.note(share=0.7, at_s=9.1), AdviceCode.FIND_AIR.note()),
        (AgainstCode.RELIEF_EARLY.note(), AdviceCode.CHECK_RELIEF.note()),
        (RigCode.PRESSURE_OFFSET.note(offset_pa=1e5, half_width_pa=1e3), AdviceCode.CHECK_RIG.note()),
    ],
    ids=lambda note: note.code.name,
)
def test_each_fault_has_its_own_repair_advice(fault: Note, work: Note) -> None:
    assert advice_for(staircase([100.0]), SURE, (fault,), (), ALL) == (work,)


@pytest.mark.parametrize(("ends", "percent"), [((1.4e8, 1.5e8), 27.5), ((1.6e8, 1.7e8), None), (None, None)])
def test_bleeding_is_advised_only_if_the_interval_of_bulk_modulus_is_below_the_limit(
    ends: tuple[float, float] | None, percent: float | None
) -> None:
    modulus = Quantity(None, "Pa") if ends is None else Quantity(0.5 * sum(ends), "Pa", ends)
    said = oil_advice({"bulk_modulus": modulus}, {"bulk_modulus": 2e8}, {"bulk_modulus": 1.6e8}, 1e-3)
    assert codes(said) == ([] if percent is None else [AdviceCode.BLEED])
    assert [note.data["percent"] for note in said] == ([] if percent is None else [pytest.approx(percent)])
    volumes = [] if modulus.value is None or percent is None else [pytest.approx(1e-3 * 2e8 / modulus.value)]
    # the chamber volume at which the log would give the rig file's bulk modulus
    assert [note.data["volume"] for note in said] == volumes


def test_a_correction_is_advised_for_a_chamber_volume_that_contradicts_the_log() -> None:
    true, written = replace(HEALTHY, chamber_volume=5.4e-4), replace(HEALTHY, chamber_volume=1.08e-3)
    (explained,) = rig_advice([RigCode.VOLUME_DIFFERS.note(percent=50.0, half_width=5.0)], true, written)
    assert str(explained) == (
        "correct chamber_volume in the rig file from 0.00108 to 0.00054 m^3, then diagnose this log again"
    )
    (stiff,) = rig_advice([RigCode.OIL_STIFFER.note(ratio=2.0)], written, written)
    assert "else correct chamber_volume from 0.00108 to 0.00054 m^3; then" in str(stiff)
    assert rig_advice([RigCode.OIL_SOFTER.note(ratio=0.5)], written, written) == ()  # the cause may be air
    assert codes(rig_advice([Note(RigCode.SINGLE_ROD, {})], written, written)) == [AdviceCode.GIVE_TWO_SIDES]
