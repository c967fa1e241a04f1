"""Without the flow balance, a class stands only if a circuit follows the log closely and no fault explains it."""

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Gate, Outcome, Quantity
from estimation.notes import EstimateCode, RigCode
from faults.diagnosis.beyond_nine import balance_refused
from faults.diagnosis.beyond_nine.balance_refused import (
    CLOSE_RESIDUALS,
    COMPARED_SEVERITIES,
    LARGEST_GAINS,
    class_without_balance,
)
from faults.diagnosis.beyond_nine.faulty_circuits import EARLY, STUCK, WORN
from faults.diagnosis.beyond_nine.other_faults import SOUND, OtherCircuits, other_circuits
from faults.diagnosis.beyond_nine.sound_circuit import Trial
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.class_regions import fit_classes
from faults.diagnosis.evidence import Scoreboard
from faults.diagnosis.severity import severities_at
from faults.notes import AgainstCode, ClassCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note
from tests.faults.diagnosis.beyond_nine.test_other_faults import ACTUATOR, FAULTS, log_of
from tests.faults.diagnosis.circuits.test_rivals import leaving, log

CORRELATED = EstimateCode.PRESSURE_RESIDUALS_CORRELATED.note(correlation=0.4)
BLOCKED = RigCode.MAKEUP_BLOCKED.note(side="A")
ANOTHER_SOUND = {SOUND: 30.0, WORN: -3.1, STUCK: 0.5, EARLY: -20.0}
NONE_BETTER = {SOUND: 1.0, WORN: -3.1, STUCK: 0.5, EARLY: -20.0}


AT_NORMAL = severities_at(ACTUATOR.conditions[0], ACTUATOR)
ONLY_NORMAL = np.array([0.0, *np.full(8, -10.0)])


def around(values: Mapping[str, float], width: float = 1.0) -> dict[str, Quantity]:
    """Return severities with intervals about given values."""
    return {
        name: Quantity(values[name], "", (values[name] - width, values[name] + width)) for name in COMPARED_SEVERITIES
    }


def stands(
    monkeypatch: pytest.MonkeyPatch,
    doubts: tuple[Note, ...] = (CORRELATED,),
    against: tuple[Note, ...] = (),
    form: str = "flow",
    noises: float = 1.0,
    gains: dict[str, float] = NONE_BETTER,
    scores: Array = ONLY_NORMAL,
    severity: Mapping[str, Quantity] | None = None,
) -> Note | None:
    """Return the note on a log if a circuit leaves ``noises`` times the sensors' noise of velocity."""
    one = log()
    one = replace(one, speed=np.full_like(one.speed, 50.0), velocity=one.velocity * 10.0)
    fits = cast("Any", type("Fits", (), {"best": leaving(noises, 1.0, one)}))
    board = Scoreboard({}, one, fits, Record(1e-3, {"motor_speed_rad_s": np.zeros(2)}), None)
    estimate = BulkModulusEstimate(Outcome.OK, 1e9, 1e7, 0.01, Gate(False, doubts), form, ("position_m",), {}, {})
    monkeypatch.setattr(balance_refused, "other_circuits", lambda *_: OtherCircuits(gains, sound_scoring(scores)))
    told = around(AT_NORMAL) if severity is None else severity
    found = Diagnosis({"normal": 0.9, "minor_friction": 0.1}, against, told, {}, {}, (), board)
    return class_without_balance(doubts, found, estimate, ACTUATOR)


def sound_scoring(scores: Array) -> Trial:
    """Return a circuit at the normal condition with the given log-likelihoods of the nine."""
    best = SimpleNamespace(coordinates=ACTUATOR.conditions[0])
    return Trial(ACTUATOR, cast("Any", SimpleNamespace(scores=scores, best=best)))


def test_a_refused_balance_keeps_its_class_if_a_circuit_follows_closely_and_no_fault_is_better(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said = stands(monkeypatch)
    assert said is not None
    assert said.code is ClassCode.BALANCE_REFUSED
    assert 0.0 < said.data["velocity_percent"] < 100.0 * CLOSE_RESIDUALS[0]


def test_a_class_stands_if_the_search_for_the_cause_of_residuals_was_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    said = stands(monkeypatch, (CORRELATED, EstimateCode.SEARCH_ENDED.note()))
    assert said is not None


def test_a_class_stands_if_another_sound_circuit_that_explains_more_has_the_same_class_and_severities(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert stands(monkeypatch, gains=ANOTHER_SOUND) is not None
    untold = {name: Quantity(None, "", None, None) for name in COMPARED_SEVERITIES}
    assert stands(monkeypatch, gains=ANOTHER_SOUND, severity=untold) is not None


@pytest.mark.slow
def test_a_class_stands_around_wider_make_up_valves_than_the_rig_files() -> None:
    wide = replace(
        ACTUATOR.circuit, makeup_conductance=5.0 * ACTUATOR.circuit.makeup_conductance, pump_case_leakage=0.0
    )
    one = log_of(wide, pressure=True)
    others = other_circuits(one, fit_classes(one, ACTUATOR), ACTUATOR)
    assert others.gains[SOUND] > LARGEST_GAINS[SOUND]
    assert others.condition == "minor_friction"


@pytest.mark.parametrize(
    "change",
    [
        {"doubts": ()},
        {"doubts": (CORRELATED, BLOCKED)},
        {"against": (AgainstCode.OUTSIDE_CONDITIONS.note(),)},
        {"form": "motion"},
        {"noises": 40.0},
        {"gains": NONE_BETTER | {WORN: -2.9}},
        {"gains": NONE_BETTER | {STUCK: 4.1}},
        {"gains": NONE_BETTER | {EARLY: 0.1}},
        {"gains": ANOTHER_SOUND | {WORN: -2.9}},
        {"gains": ANOTHER_SOUND, "scores": ONLY_NORMAL[::-1]},
        {"gains": ANOTHER_SOUND, "scores": 0.25 * ONLY_NORMAL},
        {"gains": ANOTHER_SOUND, "severity": around({name: 1.5 + AT_NORMAL[name] for name in COMPARED_SEVERITIES})},
    ],
    ids=[
        *("no doubt", "a cause is named", "outside the nine", "no flow balance", "does not follow"),
        *("worn", "stuck", "relief", "another sound circuit and worn", "another sound circuit of another class"),
        *("another sound circuit of two classes", "another sound circuit with other severities"),
    ],
)
def test_a_refused_balance_loses_its_class_if_one_requirement_is_missing(
    monkeypatch: pytest.MonkeyPatch, change: dict[str, Any]
) -> None:
    assert stands(monkeypatch, **change) is None


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "name"), [(None, ""), ("valve A", STUCK), ("pump", WORN)])
def test_with_pressure_gains_of_circuits_identify_a_stuck_valve_and_a_worn_pump(fault: str | None, name: str) -> None:
    one = log_of(FAULTS[fault][0], pressure=True) if fault else log_of(pressure=True)
    gains = other_circuits(one, fit_classes(one, ACTUATOR), ACTUATOR).gains
    speaks = {other for other, gain in gains.items() if gain > LARGEST_GAINS.get(other, 0.0)}
    assert name in speaks if fault else not speaks
