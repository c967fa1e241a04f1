"""A log of an actuator other than the rig file's is recognised by where the pumped oil goes."""

from dataclasses import replace

import pytest

from estimation.eha import another_rig
from estimation.eha.another_rig import rejected_if_another_rig, rig_contradiction_notes
from estimation.eha.estimate import estimate_log
from estimation.eha.result import wide_bound_note, without_number
from estimation.finding import Outcome
from estimation.fits.flow.log import FLOW_CHANNELS
from estimation.log_checks.channel_physics import LONG, MIDDLE
from estimation.log_checks.clean import clean_log
from estimation.log_checks.flow_balance import FlowBalance
from estimation.notes import EstimateCode
from experiments.eha.entries import estimate_entries
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from tests.estimation.fits.short_logs import PAPER, PRESSURE, WORN, log

SMALL = replace(PAPER, piston_area=PAPER.piston_area / 3.0, chamber_volume=PAPER.chamber_volume / 30.0)
"""Rig file of a smaller cylinder than the log's: with the same pump, its piston would move three times as far."""


@pytest.mark.parametrize("times", [0.3, 0.5, 2.0, 3.0])
def test_another_ratio_of_displacement_to_piston_area_is_named_with_its_size(times: float) -> None:
    rig = replace(PAPER, pump_displacement=PAPER.pump_displacement / times)
    (note,) = rig_contradiction_notes(log(4.0), rig)
    assert note.code == EstimateCode.RIG_CONTRADICTED
    assert note.data["percent"] == pytest.approx(100.0 * times, rel=0.25)


@pytest.mark.parametrize("rig", [PAPER, WORN, replace(PAPER, pump_displacement=1.07 * PAPER.pump_displacement)])
def test_a_rig_file_that_is_off_by_less_than_its_uncertainty_is_not_contradicted(rig: EhaParameters) -> None:
    assert rig_contradiction_notes(log(4.0), rig) == ()


def test_without_pressure_too_little_motion_may_be_leakage_and_contradicts_no_rig_file() -> None:
    rig = replace(PAPER, pump_displacement=2.0 * PAPER.pump_displacement)
    assert rig_contradiction_notes(log(2.0).replace(**{PRESSURE: None}), rig) == ()


def test_a_log_of_another_actuator_is_a_mismatch_and_not_unobservable() -> None:
    unseen = without_number(Outcome.NOT_OBSERVABLE, (wide_bound_note(0.1),), "flow", FLOW_CHANNELS, 0.1)
    found = rejected_if_another_rig(unseen, clean_log(log(2.0), SMALL), SMALL)
    assert found.outcome is Outcome.MISMATCH
    assert [note.code for note in found.gate.reasons] == [EstimateCode.RIG_CONTRADICTED]
    assert rejected_if_another_rig(unseen, clean_log(log(2.0), PAPER), PAPER) is unseen


@pytest.mark.slow
def test_its_message_names_the_wrong_motion_and_does_not_ask_for_logged_pressure() -> None:
    found = estimate_log(log(2.0), Rig("small", SMALL))
    assert found.outcome is Outcome.MISMATCH
    said = estimate_entries(found)["message"]
    assert said.startswith("no value of bulk modulus: the model does not describe the log; the piston moves as if")
    assert "log pressure" not in said


@pytest.mark.parametrize(("longer", "told"), [(0.52, True), (0.87, False)])
def test_a_ratio_that_longer_blocks_do_not_confirm_contradicts_no_rig_file(
    longer: float, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For a leaky rig with a correct rig file, blocks of 20 ms gave a ratio of 0.62 and those of 50 ms 0.87."""
    swept = {MIDDLE: 0.55, LONG: longer}
    balance = FlowBalance(0.0, 0.01, 1.0, 0.1, 0.9999, 0.5)
    monkeypatch.setattr(another_rig, "flow_balance", lambda _, __, length: balance._replace(swept=swept[length]))
    assert bool(rig_contradiction_notes(log(1.0), PAPER)) == told
