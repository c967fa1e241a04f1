"""Severities with the leakage that the balance of flows tells, which no seal hides."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Gate, Outcome
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.known_losses import by_the_balance, known_losses
from faults.diagnosis.severity import severities
from faults.notes import ClassCode
from tests.faults.diagnosis.test_severity import ACTUATOR, NARROW, RIG, extent, fits

LEAKAGE, BIAS = 1.02 * RIG.leakage_coefficient, 0.99 * RIG.flow_bias


def estimate(**changed: Any) -> BulkModulusEstimate:
    one = BulkModulusEstimate(
        outcome=Outcome.OK,
        value=2e8,
        std=1e5,
        bound=1e-3,
        gate=Gate(True, ()),
        form="flow",
        channels=(),
        nis={},
        others={"leakage_coefficient": (LEAKAGE, 1e-3 * LEAKAGE), "flow_bias": (BIAS, 1e-3 * BIAS)},
        correlation=-0.9,
    )
    return replace(one, **changed)


def diagnosis(**changed: Any) -> Diagnosis:
    known, told_by = fits(NARROW), partial(severities, fits(NARROW), ACTUATOR, {}, ())
    whole = {"onset": None, "drift": None, "blocks": SimpleNamespace(course=None, earlier=None)} | changed
    board = cast(Any, SimpleNamespace(fits=known, **whole))
    return Diagnosis({}, (), told_by(), {}, {}, (), board, told_by)


def test_leakage_is_the_balances_and_friction_the_circuits() -> None:
    circuit, told = diagnosis().severity, by_the_balance(diagnosis(), estimate()).severity
    assert told["leakage_flow"].value == pytest.approx(6e4 * (LEAKAGE * RIG.relief_pressure + BIAS))
    assert extent(told["leakage_flow"]) < 0.1 * extent(circuit["leakage_flow"])
    assert extent(told["velocity_lost"]) < extent(circuit["velocity_lost"])
    assert told["added_friction"].ci95 == pytest.approx(circuit["added_friction"].ci95, rel=0.2)
    assert told["added_friction"].value == circuit["added_friction"].value


def test_notes_of_others_than_the_circuit_stay() -> None:
    of_the_pump = ClassCode.WEAR_NOT_TOLD.note(percent=5.0, limit=90.0)
    assert by_the_balance(replace(diagnosis(), not_told=(of_the_pump,)), estimate()).not_told == (of_the_pump,)


@pytest.mark.parametrize(
    "changed",
    [
        {"form": "motion"},
        {"outcome": Outcome.MISMATCH},
        {"gate": Gate(False, ())},
        {"explanation": object()},
        {"others": {}},
        {"others": {"leakage_coefficient": (LEAKAGE, np.inf), "flow_bias": (BIAS, 1e-3 * BIAS)}},
    ],
)
def test_a_balance_that_is_refused_or_needs_another_cause_tells_no_leakage(changed: dict[str, Any]) -> None:
    assert known_losses(estimate(**changed)) is None
    assert by_the_balance(one := diagnosis(), estimate(**changed)) is one


@pytest.mark.parametrize("changed", [{"onset": object()}, {"drift": object()}])
def test_a_leakage_that_changes_within_a_log_is_not_that_of_the_whole(changed: dict[str, Any]) -> None:
    assert by_the_balance(one := diagnosis(**changed), estimate()) is one


def test_what_the_circuit_knows_better_stays() -> None:
    open_by = {"leakage_coefficient": (LEAKAGE, 0.5 * LEAKAGE), "flow_bias": (BIAS, 0.5 * BIAS)}
    assert by_the_balance(one := diagnosis(), estimate(others=open_by)) is one
