"""If a log cannot distinguish a worn pump from leakage, classes are averaged over the pump's deliveries."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.eha.rig_share import DELIVERY_ENTRY, undetermined_delivery
from estimation.finding import NORMAL_95, Gate
from estimation.fits.hypotheses import PRIOR_SPREADS
from estimation.notes import RigCode
from experiments.open_benchmark.kinds import make
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.beyond_nine import wear
from faults.diagnosis.beyond_nine.wear import (
    FLOW_SCALE,
    chance_by_conditions,
    chance_of_wear,
    probabilities_over_wear,
    with_pump_delivery,
)
from faults.diagnosis.calibration import shipped_calibration
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import LASTING, misfit
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.evidence import Scoreboard, bounded_log_odds, weigh_evidence
from faults.notes import AgainstCode, ClassCode
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.notes import Note
from plant.sensors.sensors import BENCH
from tests.faults.diagnosis.short_logs import ACTUATOR as RIG
from tests.faults.diagnosis.short_logs import OFF, blocks, log, made_classes

HEALTHY = EhaParameters()
ACTUATOR = actuator_of(HEALTHY)
OPEN = (RigCode.WEAR_NOT_EXCLUDED.note(percent=30.0, half_width=30.0),)
BETWEEN = 0.4
"""Position of the leakage between minor and major, on a logarithmic scale [fraction]."""


@pytest.fixture(scope="module")
def board() -> Scoreboard:
    minor, major = (parameters_for(CONDITIONS[name]) for name in ("minor_leakage", "major_leakage"))
    between = {
        name: getattr(minor, name) ** (1.0 - BETWEEN) * getattr(major, name) ** BETWEEN
        for name in ("leakage_coefficient", "flow_bias")
    }
    worn = circuit_of(replace(minor, **between, pump_displacement=0.9 * minor.pump_displacement))
    rng = np.random.default_rng(5)
    drive = make_drive("prbs", 2.0, 1e-3, HEALTHY, rng)
    return weigh_evidence(simulate(CIRCUIT, drive, 1e-3, worn, sensors=BENCH, rng=rng), ACTUATOR)


def test_averaging_over_wear_moves_probability_from_major_to_minor_leakage(board: Scoreboard) -> None:
    sound = board.probabilities(shipped_calibration())
    found = probabilities_over_wear(board, ACTUATOR, OPEN, shipped_calibration())
    assert found is not None
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["minor_leakage"] > 2.0 * sound["minor_leakage"] > 0.0
    assert found["major_leakage"] < sound["major_leakage"]


def test_classes_are_not_averaged_over_wear_if_the_log_determines_the_delivery(board: Scoreboard) -> None:
    assert probabilities_over_wear(board, ACTUATOR, (), shipped_calibration()) is None


def test_conditions_are_summed_over_pumps_weighted_by_their_prior(monkeypatch: pytest.MonkeyPatch) -> None:
    one = blocks()
    told = {"models": np.linspace(0.0, -6.0, 9), "parameters": np.linspace(-3.0, 0.0, 9)}
    board = Scoreboard(told, one, made_classes(OFF, one), log(), None)
    scores = {share: np.random.default_rng(round(10.0 * share)).normal(size=9) for share in wear.TRIED_DELIVERIES}
    best = board.fits.best

    def held(there: Any, information: Any, _: Any) -> Any:
        assert information is board.fits.information  # no circuit is fitted again for another pump
        led = dict(zip(COORDINATES, np.exp(there.coordinates - best.coordinates), strict=True))
        share = round(led["leakage"], 6)
        # all flows scale with the pump's delivery
        scaled = {"leakage": share, "bias": share, "bulk_modulus": 1.0 / share}
        assert led == pytest.approx({name: scaled.get(name, 1.0) for name in COORDINATES})
        return scores[share]

    monkeypatch.setattr(wear, "region_scores", held)
    found = probabilities_over_wear(board, RIG, OPEN, shipped_calibration())
    likely, left = np.exp(board.fits.scores), misfit(one, best.fitted, best.scales) / LASTING
    for share, score in scores.items():
        likely = likely + np.exp(score - left) * np.exp(
            -(np.log(share) ** 2) / (2.0 * PRIOR_SPREADS[DELIVERY_ENTRY] ** 2)
        )
    exact = replace(board, log_odds={**told, "parameters": bounded_log_odds(np.log(likely))}).probabilities(
        shipped_calibration()
    )
    assert found == pytest.approx(dict(exact))
    without = replace(board, blocks=blocks(pressure=False))
    assert probabilities_over_wear(without, RIG, OPEN, shipped_calibration()) is None


def said(*names: str, **changed: Any) -> Any:
    explanation = SimpleNamespace(names=names) if names else None
    plain = {"form": "flow", "gate": Gate(passed=True, reasons=()), "remarks": (), "explanation": explanation}
    return SimpleNamespace(**{**plain, **changed})


PUMP, SPEED = AgainstCode.PUMP_OFF, AgainstCode.SPEED_BIAS


@pytest.mark.parametrize(
    ("estimate", "kept"),
    [
        (said(), []),
        (said("encoder_zero"), []),
        (said("pressure_offset"), [SPEED]),
        (said("pressure_late", "pressure_drift"), [SPEED]),
        (said(form="motion"), [PUMP, SPEED]),
        (said(gate=Gate(passed=False, reasons=())), [PUMP, SPEED]),
    ],
)
def test_a_valid_flow_balance_overrules_a_circuits_objections_to_pump_and_speed(
    board: Scoreboard, estimate: Any, kept: list[AgainstCode]
) -> None:
    others = AgainstCode.OUTSIDE_CONDITIONS
    against = (PUMP.note(percent=-15.0), SPEED.note(bias_rad_s=4.7), others.note())
    found = board.probabilities(shipped_calibration())
    diagnosis = Diagnosis(found, against, {}, {}, {}, (), board)
    judged = with_pump_delivery(diagnosis, ACTUATOR, estimate)
    assert [note.code for note in judged.against] == [*kept, others]
    assert judged.probabilities == found


def test_a_circuits_objection_to_the_pump_is_kept_if_the_balance_does_not_exclude_wear(board: Scoreboard) -> None:
    found = board.probabilities(shipped_calibration())
    off = AgainstCode.PUMP_OFF.note(percent=-15.0)
    judged = with_pump_delivery(Diagnosis(found, (off,), {}, {}, {}, (), board), ACTUATOR, said(remarks=OPEN))
    assert judged.against == (off,)
    assert judged.probabilities != found


@pytest.mark.parametrize(
    ("note", "chance"),
    [
        (RigCode.WEAR_NOT_EXCLUDED.note(percent=30.0, half_width=30.0), 0.2412),
        (RigCode.WEAR_NOT_EXCLUDED.note(percent=100.0 * (0.08 - np.log(0.9)), half_width=8.0), 0.5),
        (RigCode.WEAR_NOT_EXCLUDED.note(percent=9.0, half_width=24.0, likeliest=-11.5, most=9.0), 0.0),
        (RigCode.WEAR_NOT_EXCLUDED.note(percent=20.0, half_width=24.0, likeliest=-11.5, most=20.0), 0.3847),
        (RigCode.AREA_TO_DISPLACEMENT.note(percent=92.0, half_width=NORMAL_95), 0.02275),
        (RigCode.PUMP_WORN.note(percent=80.0, half_width=1.0), 0.0),
        (AgainstCode.PUMP_OFF.note(percent=-15.0), 0.0),
    ],
)
def test_a_pump_is_worn_with_the_probability_that_it_delivers_less_than_nine_tenths(note: Note, chance: float) -> None:
    assert chance_of_wear((note,)) == pytest.approx(chance, rel=1e-3)


def test_the_probability_of_a_worn_pump_is_taken_from_the_nine_conditions(board: Scoreboard) -> None:
    found = board.probabilities(shipped_calibration())
    diagnosis = Diagnosis(found, (), {}, {}, {}, (), board)
    near = (RigCode.AREA_TO_DISPLACEMENT.note(percent=91.0, half_width=2.0 * NORMAL_95),)
    judged = with_pump_delivery(diagnosis, ACTUATOR, said("delivery"), near)
    chance = chance_of_wear(near)
    assert 0.3 < chance < 0.32
    assert judged.probabilities == pytest.approx({name: (1.0 - chance) * one for name, one in found.items()})
    assert [note.code for note in judged.not_told] == [ClassCode.WEAR_NOT_TOLD]
    assert judged.not_told[0].data == {"percent": pytest.approx(100.0 * chance), "limit": pytest.approx(90.0)}
    open_ = with_pump_delivery(diagnosis, ACTUATOR, said(remarks=OPEN))
    left = undetermined_delivery(OPEN)
    assert left is not None
    chance = chance_by_conditions(board, ACTUATOR, left, shipped_calibration())
    assert sum(open_.probabilities.values()) == pytest.approx(1.0 - chance)


def test_a_worn_pump_is_likelier_the_farther_a_sound_pumps_leakage_is_beyond_the_conditions(board: Scoreboard) -> None:
    """A stuck piston with a pump of 80 % was diagnosed as major leakage at 93 %, with more leakage than that has."""
    left = undetermined_delivery(OPEN)
    assert left is not None
    best, major = board.fits.best, ACTUATOR.conditions[list(CONDITIONS).index("major_leakage")]
    chances = {}
    for share in (1.25, 1.0, 0.8):
        there = replace(best, coordinates=major - np.log(share) * FLOW_SCALE)
        with_it = replace(board, fits=replace(board.fits, best=there))
        chances[share] = chance_by_conditions(with_it, ACTUATOR, left, shipped_calibration())
    assert chances[1.25] < chances[1.0] < 0.4 < chances[0.8]


def test_a_log_without_evidence_on_conditions_keeps_the_balances_probability_of_wear(
    board: Scoreboard, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wear, "region_scores", lambda *_: np.zeros(9))
    monkeypatch.setattr(wear, "scores_in_forces", lambda *_: np.zeros(9))
    for note in (*OPEN, RigCode.WEAR_NOT_EXCLUDED.note(percent=20.0, half_width=24.0, likeliest=-11.5, most=20.0)):
        left = undetermined_delivery((note,))
        assert left is not None
        found = chance_by_conditions(board, ACTUATOR, left, shipped_calibration())
        assert found == pytest.approx(chance_of_wear((note,)), abs=0.02)


def test_a_pump_is_not_worn_if_its_delivery_would_imply_negative_leakage(board: Scoreboard) -> None:
    """The slopes promised a pump of one third, although no flow was lost: a sound actuator was called worn at 99 %."""
    for likeliest, width in ((-104.0, 5.8), (-104.0, 0.0), (0.0, 5.8)):
        note = RigCode.WEAR_NOT_EXCLUDED.note(percent=3.7, half_width=width, likeliest=likeliest, most=3.7)
        left = undetermined_delivery((note,))
        assert left is not None
        assert chance_by_conditions(board, ACTUATOR, left, shipped_calibration()) == chance_of_wear((note,)) == 0.0


def test_conditions_keep_their_order_if_the_balance_is_certain_of_wear(board: Scoreboard) -> None:
    """A probability of 100 % left nothing for the nine, and the first of them was reported: a healthy actuator."""
    found = board.probabilities(shipped_calibration())
    sure = (RigCode.WEAR_NOT_EXCLUDED.note(percent=42.0, half_width=6.0),)
    judged = with_pump_delivery(Diagnosis(found, (), {}, {}, {}, (), board), ACTUATOR, said(remarks=sure))
    over = probabilities_over_wear(board, ACTUATOR, sure, shipped_calibration())
    assert over is not None
    assert judged.condition == max(over, key=lambda name: over[name])
    assert sum(judged.probabilities.values()) == pytest.approx(0.01)


def test_no_condition_is_scored_with_a_pump_that_the_balance_excludes(
    board: Scoreboard, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[float] = []
    leakage = COORDINATES.index("leakage")

    def held(there: Any, *_: Any) -> Any:
        tried.append(np.exp(there.coordinates - board.fits.best.coordinates)[leakage])
        return board.fits.scores

    monkeypatch.setattr(wear, "region_scores", held)
    monkeypatch.setattr(wear, "scores_in_forces", held)
    near = (RigCode.WEAR_NOT_EXCLUDED.note(percent=15.0, half_width=5.0),)
    assert probabilities_over_wear(board, ACTUATOR, near, shipped_calibration()) is not None
    assert tried == [pytest.approx(0.9)]


@pytest.mark.slow
def test_another_law_of_friction_is_not_taken_for_a_worn_pump() -> None:
    made = make("plain", "training", 100)
    channels = {name: made.log[name].to_numpy() for name in made.setup.logger.channels}
    finding = diagnose_log(Record(1e-3, channels), Rig())
    assert finding.condition == made.setup.condition == "major_friction"
    assert finding.against == ()
