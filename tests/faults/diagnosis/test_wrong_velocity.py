"""A wrong velocity sensor is named and left out if motor speed and pressure agree with position."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.eha.estimate import EstimateOptions, checked_estimate
from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Finding, Gate
from estimation.log_checks.clean import CleanLog, clean_log
from estimation.notes import EstimateCode, RigCode, SensorCode
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.wrong_velocity import without_wrong_velocity
from faults.notes import AdviceCode, ClassCode
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

RIG = Rig("paper", EhaParameters())
POSITION, VELOCITY = "position_m", "velocity_m_s"
DIFFERS = (SensorCode.SENSORS_DISAGREE.note(difference_m_s=1e-3),)
WEAR_OPEN = (RigCode.WEAR_NOT_EXCLUDED.note(percent=13.0),)


@cache
def log() -> Record:
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(8)
    return simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


@cache
def seen() -> tuple[CleanLog, BulkModulusEstimate]:
    return checked_estimate(clean_log(log(), RIG.parameters), RIG, EstimateOptions())


def diagnosed(velocity: Array) -> Finding:
    return diagnose_log(log().replace(**{VELOCITY: velocity}), RIG)


def stuck_when_slow(velocity: Array) -> Array:
    """Return a velocity from a sensor that reads 0 in slow motion."""
    return np.where(np.abs(velocity) < 0.5 * velocity.std(), 0.0, velocity)


@pytest.mark.parametrize(
    "wrong",
    [lambda v: 0.8 * v, stuck_when_slow, lambda v: 0.0 * v],
    ids=["its gain is 20 % low", "it sticks", "it reads 0"],
)
def test_a_wrong_velocity_sensor_is_named_and_the_class_is_kept(wrong: Callable[[Array], Array]) -> None:
    found = diagnosed(wrong(log()[VELOCITY]))
    assert (found.condition, found.unknown, found.against) == ("minor_leakage", False, ())
    assert [note.data["channel"] for note in found.notes if note.code is ClassCode.VELOCITY_CONTRADICTED] == [VELOCITY]
    assert [note.data["channel"] for note in found.advice if note.code is AdviceCode.MEND_SENSOR] == [VELOCITY]


def test_a_wrong_position_makes_the_class_unknown_and_both_sensors_suspect() -> None:
    brief = log().slice(0, 600)
    wave = 2e-3 * np.sin(12.0 * brief.time)
    found = diagnose_log(brief.replace(**{POSITION: brief[POSITION] + wave}), RIG)
    assert found.unknown
    assert all(note.code is not ClassCode.VELOCITY_CONTRADICTED for note in found.notes)
    assert any(note.code is AdviceCode.CHECK_SENSOR for note in found.advice)


def test_a_velocity_is_left_out_only_if_the_flow_balance_confirms_the_position() -> None:
    clean, estimate = seen()
    assert without_wrong_velocity(clean, (), estimate, ()) is None
    assert without_wrong_velocity(clean, DIFFERS, estimate, ()) is not None
    refused = replace(estimate, gate=Gate(passed=False, reasons=(EstimateCode.SEARCH_ENDED.note(),)))
    for unsure in (refused, replace(estimate, form="motion")):
        assert without_wrong_velocity(clean, DIFFERS, unsure, ()) is None


@pytest.mark.parametrize(("gain", "offset", "told"), [(0.9, 0.0, False), (1.0, 2e-3, True)])
def test_at_one_motor_speed_a_gain_error_may_belong_to_position(gain: float, offset: float, *, told: bool) -> None:
    """At one speed, the flow balance cannot separate it from a worn pump; any other error of position breaks it."""
    clean, estimate = seen()
    wave = offset * np.sin(4.0 * clean.record.time)
    changed = replace(clean, record=clean.record.replace(**{VELOCITY: gain * clean.record[VELOCITY] + wave}))
    assert without_wrong_velocity(changed, DIFFERS, estimate, ()) is not None
    assert (without_wrong_velocity(changed, DIFFERS, estimate, WEAR_OPEN) is not None) == told
