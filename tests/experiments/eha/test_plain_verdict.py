"""The sentences that a mechanic reads first."""

from typing import Any

import pytest

from estimation.notes import ChannelCode, EstimateCode, RigCode, SensorCode
from experiments.eha.plain_verdict import (
    checks_on_actuator,
    confidence_cost_onset,
    separate_reasons,
    verdict,
    what_to_do,
)
from experiments.eha.verdict_words import reliability_text
from faults.conditions import CONDITIONS
from faults.notes import AdviceCode, AgainstCode
from plant.notes import Note

AMOUNT = {"velocity_lost": {"value": 28.4, "unit": "%", "ci95": [27.0, 30.0]}}


def said_of(condition: str, share: float = 1.0, **more: Any) -> dict[str, Any]:
    return {
        "condition": condition,
        "unknown": False,
        "probabilities": {condition: share},
        "severity": AMOUNT,
        "since_s": None,
        "advice": ["log again"],
        "reasons": [],
        "notes": [],
        **more,
    }


@pytest.mark.parametrize("condition", CONDITIONS)
def test_the_verdict_on_every_condition_names_its_faults(condition: str) -> None:
    result = said_of(condition)
    for fault in ("leakage", "friction"):
        level = getattr(CONDITIONS[condition], fault)
        assert (f"{level} {fault}" in verdict(result)) == (level != "none")
    assert ("Nothing needs repair." in what_to_do(result)) == (condition == "normal")
    assert what_to_do(result)[-1] == "Log again."


@pytest.mark.parametrize(
    ("note", "said"),
    [
        (
            ChannelCode.CHANNELS_SWAPPED.note(channel="a", other="b", correlation=0.9),
            "unit or name of a is wrong.",
        ),
        (
            SensorCode.SENSORS_DISAGREE.note(difference_m_s=0.01),
            "of velocity_m_s or position_m reads wrong.",
        ),
        (SensorCode.SENSOR_CONSTANT.note(channel="b", value=1e5), "the sensor of b reads wrong."),
        (AgainstCode.STUCK_OR_LEAKS.note(moved_m=1e-5, pumped_m=0.04), "the log does not tell why."),
        (EstimateCode.RIG_CONTRADICTED.note(percent=129.0), "the log and the rig file contradict each other."),
        (EstimateCode.PRESSURE_SMOOTHED.note(channel="c"), "smoothed, so that no fit can be checked."),
        (AgainstCode.OIL_STIFF.note(share=2.0), "the log does not fit any known condition of this actuator."),
    ],
)
def test_the_heading_of_a_log_without_a_verdict_gives_the_reason(note: Note, said: str) -> None:
    result = said_of("normal", unknown=True, notes=[note.to_dict()], reasons=[str(note)])
    assert verdict(result).startswith("No verdict: ")
    assert verdict(result).endswith(said)
    filtered = SensorCode.FILTERED.note(channel="position_m", rows=4)
    beside = said_of("normal", unknown=True, notes=[filtered.to_dict()], reasons=["another one"])
    assert verdict(beside).endswith("does not fit any known condition of this actuator.")


@pytest.mark.parametrize(
    ("leakage", "friction", "said"),
    [
        (0.5, 0.0, "The actuator leaks more inside than a healthy one, or"),
        (0.0, 1.5, "The actuator has more friction than a healthy one, or"),
        (0.25, 0.5, "The actuator leaks more inside and has more friction than a healthy one, or"),
        (0.0, 0.0, "No verdict: the log does not fit any known condition of this actuator."),
    ],
)
def test_a_fault_between_the_nine_sizes_is_in_the_verdict_and_the_work(
    leakage: float, friction: float, said: str
) -> None:
    note = AgainstCode.BETWEEN_CONDITIONS.note(leakage=leakage, friction=friction)
    result = said_of("normal", unknown=True, notes=[note.to_dict()], reasons=[str(note)])
    assert verdict(result).startswith(said)
    fits = leakage > 0.0 or friction > 0.0
    assert (
        confidence_cost_onset(result).startswith(
            "The size is none of those of the nine conditions: to the nearest quarter, it is "
        )
        is fits
    )
    first = "If rig file and sensors are right: plan a check"
    assert all(one.startswith(first) for one in checks_on_actuator(result))
    assert bool(checks_on_actuator(result)) is fits
    assert any("pump and piston seal" in one for one in checks_on_actuator(result)) is (leakage > 0.0)
    assert any("guides and alignment" in one for one in checks_on_actuator(result)) is (friction > 0.0)
    assert "to the nearest quarter" in str(note)


def test_a_circuit_outside_the_nine_is_described_by_its_levels_and_the_part_that_deviates() -> None:
    note = AgainstCode.OUTSIDE_CONDITIONS.note(leakage=1.25, friction=0.0, part="flow bias", ratio=0.19)
    result = said_of("normal", unknown=True, notes=[note.to_dict()], reasons=[str(note)])
    assert verdict(result) == "The actuator leaks more inside than a healthy one, or the rig file or a sensor is wrong."
    assert "leakage is 1.25 and friction 0 " in confidence_cost_onset(result)
    assert confidence_cost_onset(result).endswith("but flow bias is 0.19 times what it should be at these levels.")
    assert checks_on_actuator(result)[0].startswith(
        "If rig file and sensors are right: plan a check of pump and piston seal."
    )


def test_an_intermediate_size_beside_another_reason_leads_to_no_work() -> None:
    note = AgainstCode.BETWEEN_CONDITIONS.note(leakage=0.5, friction=0.0)
    result = said_of("normal", unknown=True, notes=[note.to_dict()], reasons=[str(note), "the pressure froze"])
    assert checks_on_actuator(result) == []
    assert "do not rely on the numbers" in confidence_cost_onset(result)


def test_a_named_fault_takes_precedence_over_an_intermediate_size() -> None:
    notes = [RigCode.MAKEUP_BLOCKED.note(side="B"), AgainstCode.BETWEEN_CONDITIONS.note(leakage=0.5, friction=0.5)]
    result = said_of("normal", unknown=True, notes=[one.to_dict() for one in notes])
    assert verdict(result) == "A make-up valve is stuck shut."


def test_reasons_that_may_follow_from_a_frozen_sensor_are_omitted() -> None:
    froze = SensorCode.SENSOR_FROZE.note(channel="position_m", value=0.016, length_s=3.0, begin_s=3.0)
    follows = AgainstCode.UNEXPLAINED.note(percent=102.0, channel="velocity")
    notes: list[Any] = [one.to_dict() for one in (follows, froze)]
    reasons: list[Any] = [str(follows), str(froze)]
    result = said_of("normal", unknown=True, notes=notes, reasons=reasons, not_told=[])
    assert confidence_cost_onset(result) == f"Do not rely on anything on this page: {froze}."
    assert separate_reasons(result) == []
    assert reliability_text(result) == f"no: {froze}; 1 more in --json, which may follow from this"
    assert reliability_text({**result, "notes": notes[:1], "reasons": reasons[:1]}) == f"no: {follows}"


def test_several_reasons_against_a_verdict_are_a_list() -> None:
    result = said_of("normal", unknown=True, notes=[], reasons=["one does not fit", "nor does another"])
    assert confidence_cost_onset(result) == "Do not rely on anything on this page:"
    assert separate_reasons(result) == ["One does not fit.", "Nor does another."]


def test_soft_oil_is_in_the_verdict_and_is_never_nothing_to_repair() -> None:
    soft: dict[str, Any] = {"notes": [AdviceCode.BLEED.note(percent=27.0, volume=1.5e-3).to_dict()]}
    assert "softer than its limit; leakage and friction are normal" in verdict(said_of("normal", **soft))
    assert verdict(said_of("minor_leakage", **soft)).endswith("; its oil is softer than its limit.")
    assert what_to_do(said_of("normal", **soft)) == ["Log again."]
    assert (
        confidence_cost_onset(said_of("normal", **soft))
        == "The verdict on leakage and friction is certain (over 99 %)."
    )


def test_the_verdict_is_called_certain_only_above_99_percent() -> None:
    assert confidence_cost_onset(said_of("minor_leakage", 0.999)).startswith("This is certain (over 99 %).")
    assert confidence_cost_onset(said_of("minor_leakage", 0.9)).startswith("This is probable (90 %).")
    assert "several explanations (55 %)" in confidence_cost_onset(said_of("minor_leakage", 0.55))


def test_a_fault_is_described_with_its_loss_of_speed_and_its_begin() -> None:
    assert "28 % slower" in confidence_cost_onset(said_of("minor_leakage"))
    assert "The fault was there before the log began." in confidence_cost_onset(said_of("minor_leakage"))
    changed = said_of("minor_leakage", since_s=2.5, since_ci95_s=[2.4, 2.6], condition_before="normal")
    assert (
        "The condition changed 2.50 s into the log (2.40 to 2.60 s); until then it was normal."
        in confidence_cost_onset(changed)
    )
    assert "slower" not in confidence_cost_onset(said_of("normal"))
    open_friction = {"normal": 0.3, "minor_friction": 0.35, "major_friction": 0.35}
    assert "fault" not in confidence_cost_onset(said_of("major_friction", probabilities=open_friction))


def test_an_unknown_log_gets_reasons_but_no_verdict_and_no_work() -> None:
    result = said_of("minor_leakage", unknown=True, reasons=["motor speed reads wrong by 3 rad/s"])
    assert verdict(result).startswith("No verdict")
    assert what_to_do(result) == ["Log again."]
    assert "motor speed reads wrong by 3 rad/s" in confidence_cost_onset(result)


def test_a_named_fault_outside_the_nine_is_the_verdict_and_the_numbers_are_doubted() -> None:
    note = RigCode.MAKEUP_BLOCKED.note(side="B").to_dict()
    result = said_of("major_friction", unknown=True, reasons=[note["text"]], notes=[note])
    assert verdict(result) == "A make-up valve is stuck shut."
    assert "do not rely on the numbers below: the make-up valve of chamber B" in confidence_cost_onset(result)


def test_friction_that_a_log_does_not_determine_is_not_called_normal() -> None:
    even = dict.fromkeys(("minor_leakage", "minor_leakage_minor_friction", "minor_leakage_major_friction"), 1 / 3)
    result = said_of("minor_leakage", probabilities=even)
    told = "The actuator leaks inside more than it should (minor leakage); friction cannot be told from this log."
    assert verdict(result) == told
    assert confidence_cost_onset(result).startswith("The verdict on leakage is certain (over 99 %).")
    assert what_to_do(result)[0].startswith("Plan a check of pump and piston seal.")
    assert not any("guides" in one for one in what_to_do(result))


@pytest.mark.parametrize(("share", "word"), [(0.54, "probably "), (0.89, "probably "), (0.91, "")])
def test_a_level_below_nine_in_ten_is_called_probable(share: float, word: str) -> None:
    """Before, friction was called normal at 54 %, although it was minor."""
    leaks = {"major_leakage": share, "major_leakage_minor_friction": 1.0 - share}
    told = f"The actuator leaks badly inside (major leakage); friction is {word}normal."
    assert verdict(said_of("major_leakage", probabilities=leaks)) == told
    sound = {"normal": share, "minor_leakage": 1.0 - share}
    healthy = "leakage is probably normal and friction is normal." if word else "leakage and friction are normal."
    assert verdict(said_of("normal", probabilities=sound)) == f"The actuator is {word}healthy: {healthy}"
    rubs = {"minor_friction": share, "normal": 1.0 - share}
    assert verdict(said_of("minor_friction", probabilities=rubs)).startswith(f"The actuator {word}has more friction")


def test_an_actuator_with_undetermined_friction_is_not_called_healthy() -> None:
    even = dict.fromkeys(("normal", "minor_friction", "major_friction"), 1 / 3)
    result = said_of("normal", probabilities=even)
    assert verdict(result) == "Leakage is normal; friction cannot be told from this log."
    assert "Nothing needs repair." not in what_to_do(result)
    worn = said_of("normal", 0.3)  # the remaining probability is that of a worn pump
    nothing = said_of("normal", probabilities=dict.fromkeys(CONDITIONS, 1 / 9))
    assert verdict(worn) == verdict(nothing)
    assert verdict(nothing) == "Leakage cannot be told from this log; friction cannot be told from this log."
    assert confidence_cost_onset(nothing).startswith("The log leaves several conditions possible.")
