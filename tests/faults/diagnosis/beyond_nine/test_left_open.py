"""The probability of a fault that a log does not exclude."""

import numpy as np
import pytest

from estimation.notes import RigCode
from faults.diagnosis.beyond_nine.left_open import (
    DELIVERIES,
    delivery_log_priors,
    likelier_fault_notes,
    odds_of_wear,
    with_unseen_valve,
)
from faults.notes import ClassCode


@pytest.mark.parametrize(
    "shares",
    [(-9.0, -9.0, -4.0, 3.9, 3.9), (0.0, 0.0, 0.0, 3.9, 3.9), (3.0, 3.0, 1.0, 0.0, 0.0), (-9.0, 0.0, 1.2, 1.0, 1.0)],
    ids=str,
)
def test_odds_of_wear_count_well_worn_pumps_against_the_sound_pump(shares: tuple[float, ...]) -> None:
    presumed = 0.5 * np.exp(-0.5 * (np.log(DELIVERIES) / 0.15) ** 2)
    less, well = np.exp(shares) * presumed, np.array([1.0, 1.0, 1.0, 0.0, 0.0])
    assert odds_of_wear([one - 5.0 for one in shares], -5.0) == pytest.approx(np.log(less @ well))


def test_the_prior_of_wear_does_not_depend_on_the_number_of_pumps_tried() -> None:
    tenths = np.exp(-0.5 * (np.log([0.7, 0.8, 0.9]) / 0.15) ** 2)
    assert np.sum(np.exp(delivery_log_priors(DELIVERIES))) == pytest.approx(np.sum(tenths), rel=0.2)
    assert delivery_log_priors([1.0]) == 0.0


def test_a_valve_that_never_opened_is_as_likely_stuck_as_each_of_the_nine_conditions() -> None:
    sure = {"normal": 0.0, "major_friction": 1.0}
    unseen = (RigCode.MAKEUP_UNSEEN.note(side="B"),)
    left, said = with_unseen_valve(sure, unseen)
    assert left["normal"] == 0.0
    assert left["major_friction"] == pytest.approx(0.9)
    assert [note.code for note in said] == [ClassCode.STUCK_NOT_TOLD]
    assert said[0].data["percent"] == pytest.approx(100.0 * (1.0 - left["major_friction"]))
    assert with_unseen_valve(sure, ()) == (sure, ())
    worn, (beside,) = with_unseen_valve({"normal": 0.0, "major_friction": 0.7}, unseen)  # 0.3 for a worn pump
    assert sum(worn.values()) + 0.01 * beside.data["percent"] == pytest.approx(0.7)
    assert with_unseen_valve({}, unseen) == ({}, ())


def test_a_fault_likelier_than_every_condition_is_an_objection_to_all_nine() -> None:
    """Before, the headline gave 94 % for none of the nine, while the rest of the page named a condition."""
    wear = ClassCode.WEAR_NOT_TOLD.note(percent=94.0, limit=90.0)
    unseen = ClassCode.STUCK_NOT_TOLD.note(percent=10.0)
    assert likelier_fault_notes({"normal": 0.04, "minor_leakage": 0.02}, (unseen, wear)) == (wear,)
    assert likelier_fault_notes({"normal": 0.5, "minor_leakage": 0.1}, (unseen, wear)) == ()
    assert likelier_fault_notes({}, (wear,)) == ()
