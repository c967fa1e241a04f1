"""The explanation of a log is reported in numbers that follow from the fit, and the log is corrected by it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.eha.another_rod import is_of_another_rod
from estimation.eha.bulk_modulus import _channel_slips
from estimation.eha.changing_leakage import LARGEST_WARMING_FACTOR
from estimation.eha.explanation_notes import (
    FAULTS_BEYOND_CONDITIONS,
    LEAKAGE_COURSE,
    corrected_log,
    corrected_rig,
    log_at_pump_speed,
    notes_of,
)
from estimation.fits.greybox.pump_ripple import NO_RIPPLE, Ripple, Turning, delivering_speed
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.log_checks.clean import CleanLog
from estimation.notes import RigCode
from plant.components.oil import ATMOSPHERE, effective_bulk_modulus
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

P = EhaParameters()
NORMAL = 1.96
STATED = 3e5
PRESSURE = "differential_pressure_pa"


def explanation(
    *names: str, delay: float = 0.0, rivals: tuple[str, ...] = (), **values: tuple[float, float]
) -> Explanation:
    fit: Any = None
    return Explanation(names, values, {PRESSURE: delay}, (fit,), rivals, STATED)


def told(*names: str, delay: float = 0.0, rivals: tuple[str, ...] = (), **values: tuple[float, float]) -> Note:
    (note, *_) = notes_of(explanation(*names, delay=delay, rivals=rivals, **values), P)
    return note


def data(note: Note) -> dict[str, Any]:
    return {
        name: pytest.approx(value, rel=1e-3, abs=0.0 if value else 1e-12) if isinstance(value, float) else value
        for name, value in note.data.items()
    }


def test_lateness_is_delay_plus_lag_and_an_offset_is_noted_unchanged() -> None:
    late = told("pressure_late", delay=2e-3, pressure_lag=(1e-3, 1e-4))
    assert late.code is RigCode.PRESSURE_LATE
    assert data(late) == {"late_ms": 3.0, "half_width_ms": 0.1 * NORMAL}
    assert data(told("pressure_offset", pressure_offset=(-1e5, 2e3))) == {
        "offset_pa": -1e5,
        "half_width_pa": 2e3 * NORMAL,
    }


@pytest.mark.parametrize(("zero", "side"), [(4e-3, "B"), (-4e-3, "A")])
def test_an_encoders_zero_may_be_a_hose_on_one_side(zero: float, side: str) -> None:
    more = 2.0 * P.piston_area * 4e-3
    assert data(told("encoder_zero", position_zero=(zero, 1e-4))) == {
        "zero_mm": pytest.approx(1e3 * zero),
        "half_width_mm": pytest.approx(0.1 * NORMAL, rel=1e-3),
        "side": side,
        "more": pytest.approx(more),
    }


def test_a_negative_compression_loss_of_the_pump_is_a_pressure_tapping() -> None:
    assert told("pump_compresses", pump_compression=(1.2, 0.1)).code is RigCode.PUMP_COMPRESSES
    assert told("pump_compresses", pump_compression=(-2.1, 0.1)).code is RigCode.PRESSURE_TAPPED


@pytest.mark.parametrize(("share", "code"), [(0.7, RigCode.PUMP_WORN), (0.95, RigCode.AREA_TO_DISPLACEMENT)])
def test_a_pump_that_delivers_far_less_is_worn(share: float, code: RigCode) -> None:
    d = P.pump_displacement
    note = told("delivery", pump_displacement=(share * d, 0.01 * d))
    assert note.code is code
    assert data(note) == {"percent": 100.0 * share, "half_width": NORMAL}


def test_an_impossible_pump_delivery_is_a_speed_in_another_unit() -> None:
    """The factor on the logged speed is the inverse of the pump's apparent delivery over its displacement."""
    d = P.pump_displacement

    def said(share: float) -> tuple[Note, ...]:
        delivery = explanation("delivery", pump_displacement=(share * d, 0.01 * d))
        fit: Any = SimpleNamespace(reasons=(), explanation=delivery)
        return _channel_slips(fit, P)

    (note,) = said(9.5)
    assert note.data["factor"] == pytest.approx(1.0 / 9.5)
    assert said(1.2) == ()


@pytest.mark.parametrize(
    ("rig", "told_share", "other"),
    [(0.25, 0.25, False), (0.25, 0.23, False), (0.25, 0.2, True), (-0.25, -0.2, True), (0.0, 0.25, False)],
)
def test_areas_unlike_those_of_the_rig_files_single_rod_are_doubted(
    rig: float, told_share: float, *, other: bool
) -> None:
    """The areas of the rod absorbed a displacement that was 6 % off, and the class was wrong at 99 %."""
    rods = {"area_difference": (told_share, 0.01), "volume_difference": (0.2, 0.1), "pilot_share": (0.0, 0.1)}
    found = explanation("single_rod", **rods)
    (note,) = notes_of(found, replace(P, area_difference=rig))
    assert is_of_another_rod(note) == other


def test_notes_on_volume_play_load_relief_and_check_valves_hold_the_fitted_values() -> None:
    v = P.chamber_volume
    assert data(told("volume", chamber_volume=(0.8 * v, 0.02 * v))) == {"percent": 80.0, "half_width": 2.0 * NORMAL}
    assert data(told("position_play", position_play=(5e-5, 1e-6))) == {"play_um": 50.0}
    areas = told("single_rod", area_difference=(0.25, 0.01), volume_difference=(-0.25, 0.1), pilot_share=(1.0, 0.1))
    half_width = 200.0 * 0.01 * NORMAL / 1.25**2
    assert data(areas) == {
        "percent": 60.0,
        "half_width": half_width,
        "volume_percent": 500.0 / 3.0,
        "pilot_share": 1.0,
        "rig_percent": 100.0,
        "rig_volume_percent": 100.0,
        "rig_pilot_share": 0.0,
    }
    begun = told("start_load", start_pressure=(5e5, 1e3), start_level=(2e5, 1e3))
    assert data(begun) == {
        "pressure_pa": 5e5,
        "force_n": 5e5 * P.piston_area,
        "level_pa": 2e5,
    }
    assert data(told("relief_low", relief_pressure=(2e6, 1e4))) == {
        "setting_pa": 2e6,
        "half_width_pa": 1e4 * NORMAL,
        "rig_pa": P.relief_pressure,
    }
    stepped = {"leakage_coefficient": (6e-11, 0.0), "leakage_before": (-0.9, 0.0), "step_at": (0.4, 0.0)}
    told_step = data(told("leakage_step", **stepped, step_width=(1e-3, 0.0)))
    assert told_step == {"percent_of_log": 40.0, "within_percent": 0.1, "first": 6e-12, "last": 6e-11}
    for later, side in ((6e3, "A"), (-6e3, "B")):
        cracked = told("checks_crack", crack_pressure=(4e4, 1e3), crack_difference=(later, 2e3))
        assert data(cracked) == {
            "crack_pa": 4e4,
            "half_width_pa": 1e3 * NORMAL,
            "side": side,
            "later_pa": 6e3,
            "later_half_width_pa": 2e3 * NORMAL,
        }
    assert data(told("makeup_bends", makeup_bend=(5e-5, 1e-5))) == {"drop_pa": 6e4}


def test_entrained_air_is_noted_at_atmospheric_pressure_with_the_air_free_bulk_modulus() -> None:
    share, liquid = 1e-3, 1.5e9
    softness = share * ATMOSPHERE
    modulus = 1.0 / (1.0 / liquid + softness / STATED**2)
    note = told("air", air_softness=(softness, 0.1 * softness), bulk_modulus=(modulus, 1e6))
    assert note.code is RigCode.AIR_ENTRAINED
    assert data(note) == {
        "percent": 100.0 * share,
        "half_width": 10.0 * share * NORMAL,
        "stated_pa": STATED,
        "liquid_pa": liquid,
    }
    assert modulus == pytest.approx(effective_bulk_modulus(STATED, liquid, share, 0.0), rel=2e-3)
    late = told("air_midway", air_softness=(softness, 0.0), bulk_modulus=(modulus, 1e6), air_onset=(0.4, 0.01))
    assert late.code is RigCode.AIR_ENTERS
    assert late.data["percent_of_log"] == pytest.approx(40.0)


@pytest.mark.parametrize(("factor", "code"), [(2.0, "DRIFTS"), (0.5, "DRIFTS"), (4.0, "GROWS"), (0.2, "GROWS")])
def test_leakage_that_changes_by_more_than_oil_thins_is_a_fault(factor: float, code: str) -> None:
    assert LARGEST_WARMING_FACTOR == 3.0
    growth = 2.0 * (factor - 1.0) / (factor + 1.0)  # a straight line that is 1 halfway
    note = told(
        "leakage_growth", leakage_growth=(growth, 0.0), leakage_bend=(0.0, 0.0), leakage_coefficient=(8e-12, 0.0)
    )
    assert note.code is RigCode[f"LEAKAGE_{code}"]
    assert data(note) == {"factor": factor, "first": 8e-12 / factor, "last": 8e-12}


def test_the_chamber_that_is_blocked_or_drains_is_named() -> None:
    assert told("makeup_blocked", makeup_share_b=(0.01, 0.0)).data["side"] == "B"
    assert told("makeup_blocked", makeup_share_b=(99.0, 0.0)).data["side"] == "A"
    # the border is an equal conductance of both valves
    for share, side in ((0.9, "B"), (1.1, "A")):
        assert told("makeup_blocked", makeup_share_b=(share, 0.0)).data["side"] == side
    for side in "ab":
        drained = {f"drain_share_{side}": (20.0, 1.0), "case_leakage": (2e-13, 0.0)}
        assert data(told(f"port_{side}_drains", **drained)) == {"side": side.upper(), "drain": 4e-12}


@pytest.mark.parametrize(
    ("share", "case", "leaks"), [(0.1, 4e-12, "B"), (0.1, 1e-12, ""), (1.8, 1e-12, "A"), (1.6, 1e-12, "")]
)
def test_a_port_that_drains_more_than_a_sound_pump_may_is_a_leak(share: float, case: float, leaks: str) -> None:
    """The prior is a twentieth of the healthy leakage; the drain of a sound pump may be seven times as large."""
    note = told("port_a_drains", drain_share_a=(share, 0.0), case_leakage=(case, 0.0))
    assert note.code is (RigCode.PORT_DRAINS if leaks else RigCode.PORTS_DRAIN_APART)
    assert (note.code in FAULTS_BEYOND_CONDITIONS) == bool(leaks)
    assert note.data.get("side", "") == leaks


def test_rivals_are_named_last() -> None:
    rivals = ("encoder_zero", "volume and start_load")
    *_, last = notes_of(explanation("pressure_offset", rivals=rivals, pressure_offset=(1e5, 1.0)), P)
    first, second = (
        "a position sensor with its zero away from mid-stroke",
        "another chamber volume and a load at the start",
    )
    assert f"by {first}; or by {second} of the log; the interval includes this" in str(last)
    assert last.data["others"] == "encoder_zero, volume and start_load"
    assert len(notes_of(explanation("pressure_offset", pressure_offset=(1e5, 1.0)), P)) == 1


def clean() -> CleanLog:
    time = 1e-3 * np.arange(200)
    channels = {
        "motor_speed_rad_s": np.ones(200),
        "position_m": 0.1 * time,
        "differential_pressure_pa": 1e6 * time,
    }
    return CleanLog(Record(1e-3, channels), {}, (), ())


def test_a_log_is_corrected_by_its_sensors_offsets_and_lateness() -> None:
    found = explanation(delay=2e-3, pressure_lag=(1e-3, 0.0), pressure_offset=(5e4, 0.0), position_zero=(4e-3, 0.0))
    before, after = clean().record, corrected_log(clean(), found).record
    assert after["position_m"] == pytest.approx(before["position_m"] - 4e-3)
    assert after["differential_pressure_pa"][:197] == pytest.approx(before["differential_pressure_pa"][3:] - 5e4)
    assert np.isnan(after["differential_pressure_pa"][-2:]).all()
    assert corrected_log(clean(), explanation()).record["position_m"] is not None
    np.testing.assert_array_equal(
        corrected_log(clean(), explanation()).record["differential_pressure_pa"], before["differential_pressure_pa"]
    )


@pytest.mark.parametrize("late", [0.0, 0.4e-3, 1.3e-3, 3e-3])
def test_a_late_pressure_at_a_lower_rate_is_corrected_in_its_nearest_rows(late: float) -> None:
    rows, time = np.arange(0, 200, 4), 1e-3 * np.arange(200)
    true = np.sin(30.0 * time)
    sampled = np.full(200, np.nan)
    sampled[rows] = np.sin(30.0 * (time[rows] - late))
    record = Record(1e-3, {"position_m": 0.1 * time, "differential_pressure_pa": sampled})
    found = explanation(delay=late, pressure_offset=(0.0, 0.0))
    after = corrected_log(CleanLog(record, {}, (), ()), found).record["differential_pressure_pa"]
    there = np.flatnonzero(np.isfinite(after))
    assert np.all(np.diff(there) == 4)
    assert len(there) >= len(rows) - 1
    assert after[there[1:-1]] == pytest.approx(true[there[1:-1]], abs=3e-4)  # the slope at the ends is one-sided


def test_the_course_of_leakage_is_one_at_the_end_of_the_log_and_always_positive() -> None:
    found = explanation(leakage_growth=(1.0, 0.0), leakage_bend=(0.4, 0.0))
    course = corrected_log(clean(), found).record[LEAKAGE_COURSE]
    assert course[-1] == 1.0
    assert course[100] / course[0] == pytest.approx(1.0 / (1.0 - 0.5 + 0.4 * 0.25))
    steep = corrected_log(clean(), explanation(leakage_growth=(4.0, 0.0), leakage_bend=(0.0, 0.0))).record[
        LEAKAGE_COURSE
    ]
    assert steep[0] * 2.98 == pytest.approx(1e-3, rel=1e-6)


def test_the_rig_is_corrected_only_in_displacement_and_chamber_volume() -> None:
    found = explanation(pump_displacement=(5e-7, 0.0), chamber_volume=(6e-5, 0.0), bulk_modulus=(1e8, 0.0))
    right = corrected_rig(P, found)
    assert (right.pump_displacement, right.chamber_volume, right.bulk_modulus) == (5e-7, 6e-5, P.bulk_modulus)
    assert corrected_rig(P, explanation()) == P


def test_a_log_gets_the_speed_at_which_a_pump_without_ripple_delivers_the_same() -> None:
    speed = np.linspace(20.0, 40.0, 200)
    speed[7] = np.nan
    log = CleanLog(Record(1e-3, {"motor_speed_rad_s": speed, "position_m": np.zeros(200)}), {}, (), ())
    assert log_at_pump_speed(log, NO_RIPPLE) is log
    teeth = (Ripple(11, 0.1, 0.02),)
    found = log_at_pump_speed(log, Turning(teeth, 0.3)).record
    wanted = delivering_speed(np.linspace(20.0, 40.0, 200), teeth, 0.3, 1e-3)
    assert found["motor_speed_rad_s"] == pytest.approx(wanted)
    assert np.ptp(found["motor_speed_rad_s"] - np.linspace(20.0, 40.0, 200)) > 2.0
    assert np.array_equal(found["position_m"], log.record["position_m"])
