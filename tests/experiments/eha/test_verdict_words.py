"""A diagnosis in words."""

from dataclasses import replace

import pytest

from estimation.finding import Change, Finding, Gate, Outcome, Quantity
from estimation.notes import EstimateCode
from experiments.eha.entries import diagnosis_entries
from experiments.eha.plain_verdict import verdict
from experiments.eha.verdict_words import (
    NEXT_LINE,
    SEVERITY_NAMES,
    headline,
    library_sentence,
    models_sentence,
    next_step,
    onset_clause,
    reliability_text,
    severity_text,
    verdict_lines,
)
from experiments.page.condition_names import condition_in_words
from experiments.page.sentences import sentence
from faults.conditions import CONDITIONS
from faults.diagnosis.diagnose import EhaEvidence
from faults.diagnosis.rmse import Scores
from faults.notes import AdviceCode, AgainstCode, ClassCode
from plant.notes import Note


def found_as(
    condition: str, change: Change | None = None, against: tuple[Note, ...] = (), *, judged: bool = True
) -> Finding:
    """Return a diagnosis of a condition whose nominal model has an error of 0.1, and the others 0.2 and more."""
    errors = {name: 0.1 if name == condition else 0.2 + 0.01 * place for place, name in enumerate(CONDITIONS)}
    shares = {**dict.fromkeys(CONDITIONS, 0.0), "major_friction": 0.03, condition: 0.97}
    return Finding(
        actuator="eha",
        outcome=Outcome.OK,
        quantities={"bulk_modulus": Quantity.normal(2.07e8, 1e6, "Pa")},
        gate=Gate(True, ()),
        channels=("velocity_m_s",),
        condition=condition,
        probabilities=shares if judged else {},
        unknown=bool(against),
        against=against,
        severities={"leakage_flow": Quantity(1.0, "L/min", (0.9, 1.1)), "entrained_air": Quantity(None, "%")},
        not_told=(ClassCode.BULK_MODULUS_NOT_VISIBLE.note(),),
        since=change,
        advice=(AdviceCode.CHECK_RIG.note() if against else AdviceCode.NOTHING.note(),),
        evidence=EhaEvidence(estimate=None, scores=Scores(errors, {"velocity_m_s": errors}), diagnosis=None),
    )


def test_a_change_within_the_log_is_dated_with_its_interval() -> None:
    found = diagnosis_entries(found_as("minor_leakage", Change(3.21, (3.1, 3.3), "normal")))
    assert (found["since_s"], found["since_ci95_s"], found["condition_before"]) == (3.21, [3.1, 3.3], "normal")
    assert "since 3.21 s (3.10 to 3.30 s), normal before" in headline(found)


def test_a_fault_without_a_change_is_dated_before_the_log_began() -> None:
    found = diagnosis_entries(found_as("minor_leakage"))
    assert (found["since_s"], found["since_ci95_s"], found["condition_before"]) == (None, None, None)
    assert "since before the log began" in headline(found)


def test_a_healthy_actuator_has_a_date_only_if_a_fault_came_before() -> None:
    assert onset_clause(diagnosis_entries(found_as("normal"))) == ""
    mended = diagnosis_entries(found_as("normal", Change(2.0, (1.9, 2.2), "minor_friction")))
    assert onset_clause(mended).endswith("minor friction before")
    assert "since" not in headline(diagnosis_entries(found_as("normal")))


@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_headline_begins_with_the_condition(condition: str) -> None:
    entries = diagnosis_entries(found_as(condition))
    assert headline(entries).startswith(condition_in_words(condition))
    assert entries["message"] == headline(entries)


AGAINST = (AgainstCode.SPEED_BIAS.note(bias_rad_s=3.0), AgainstCode.OIL_SOFT.note(share=0.4))


@pytest.mark.parametrize(
    ("alike", "said"),
    [
        (
            ("minor_leakage", "minor_leakage_minor_friction"),
            "minor leakage, probability 96.6 %; friction cannot be",
        ),
        (("major_friction", "minor_leakage_major_friction"), "leakage cannot be told: normal or minor leakage equally"),
        (("normal", "minor_leakage_minor_friction"), "leakage and friction cannot be told: normal or minor leakage + "),
    ],
)
def test_equally_probable_conditions_are_named_together_in_the_headline(alike: tuple[str, ...], said: str) -> None:
    """Before, three equal percentages read as if the first condition had been found."""
    shares = {**dict.fromkeys(CONDITIONS, 0.04 / (9 - len(alike))), **dict.fromkeys(alike, 0.96 / len(alike))}
    result = {**diagnosis_entries(found_as(alike[0])), "probabilities": shares}
    assert said in headline(result)
    assert "second most likely" not in headline(result)
    unlike = {**result, "probabilities": {**shares, alike[0]: 0.97 / len(alike)}}
    assert "second most likely" in headline(unlike)


def test_a_fault_outside_the_nine_can_be_second_most_likely_in_the_headline() -> None:
    """Before, it read "minor leakage, probability 90.0 %; second most likely major leakage, < 0.1 %" and no more."""
    result = diagnosis_entries(found_as("minor_leakage"))
    said = headline({**result, "probabilities": {"minor_leakage": 0.9, "major_leakage": 1e-5}})
    assert said.startswith("minor leakage, probability 90.0 %")
    assert said.endswith("second most likely none of the nine conditions, 10.0 %")


def test_normal_leakage_with_undetermined_friction_is_not_dated_as_a_fault() -> None:
    shares = {"normal": 0.3, "minor_friction": 0.35, "major_friction": 0.35}
    result = {**diagnosis_entries(found_as("major_friction")), "probabilities": shares}
    assert headline(result) == (
        "normal leakage, probability > 99.9 %; friction cannot be told: minor or major friction equally likely"
    )


def test_a_piston_that_stands_still_is_not_said_to_fit_no_condition() -> None:
    """Before, "none of the nine conditions fits" stood above a verdict by which several do."""
    still = AgainstCode.STUCK_OR_LEAKS.note(moved_m=4e-5, pumped_m=9e-3)
    said = headline(diagnosis_entries(found_as("major_leakage", against=(still,))))
    assert said.startswith("UNKNOWN: the piston stands still, which several conditions and a blocked rod explain; the ")
    both = headline(diagnosis_entries(found_as("major_leakage", against=(still, *AGAINST))))
    assert both.startswith("UNKNOWN: none of the nine conditions fits")


def test_a_verdict_with_reasons_against_it_begins_with_unknown_and_lists_them() -> None:
    entries = diagnosis_entries(found_as("minor_leakage", against=AGAINST))
    assert headline(entries).startswith("UNKNOWN: none of the nine conditions fits; the nearest is minor leakage")
    assert reliability_text(entries) == "no: " + NEXT_LINE.join(map(str, AGAINST))
    assert next_step(entries) == sentence(str(AdviceCode.CHECK_RIG.note()))
    sound = diagnosis_entries(found_as("minor_leakage"))
    assert reliability_text(sound).startswith("yes: ")
    assert reliability_text(sound).endswith(str(ClassCode.BULK_MODULUS_NOT_VISIBLE.note()))


@pytest.mark.parametrize(("against", "begins"), [((), "minor_leakage, by a wide margin"), (AGAINST, "UNKNOWN")])
def test_without_a_circuit_the_message_gives_the_nearest_condition_and_its_margin(
    against: tuple[Note, ...], begins: str
) -> None:
    entries = diagnosis_entries(found_as("minor_leakage", against=against, judged=False))
    assert entries["message"] == models_sentence(entries)
    assert entries["message"].startswith(begins)
    assert "the error of normal is 2.0 times as large" in entries["message"]
    assert (entries["condition"], entries["runner_up"]) == ("minor_leakage", "normal")


def test_a_severity_without_a_value_is_called_not_determined() -> None:
    entries = diagnosis_entries(found_as("normal"))
    assert entries["severity"]["entrained_air"] == {
        "value": None,
        "unit": "%",
        "ci95": [None, None],
        "ci95_total": [None, None],
    }
    assert severity_text(entries["severity"]["entrained_air"]) == "not determined"
    assert severity_text(entries["severity"]["leakage_flow"]) == "1.00 L/min (0.90 to 1.10)"


def with_library(found: Finding, best: str) -> Finding:
    """Return the same finding, with a library in which one condition has the smallest error."""
    errors = {name: 1e-3 if name == best else 2e-3 for name in CONDITIONS}
    scores = Scores(errors, {"velocity_m_s": errors})
    unknown = dict.fromkeys(SEVERITY_NAMES, Quantity(None, "1"))
    evidence = replace(found.evidence, transfer_functions=scores)
    return replace(found, severities={**unknown, **found.severities}, evidence=evidence)


def test_the_terminal_shows_the_verdict_and_the_work_of_the_page() -> None:
    entries = diagnosis_entries(with_library(found_as("minor_leakage"), "minor_leakage"))
    said = verdict_lines({"file": "run.csv", **entries})
    assert said[1] == f"  verdict   {verdict(entries)}"
    assert "(minor leakage)" in said[1]
    (following,) = [line for line in said if line.startswith("  next ")]
    assert following.startswith("  next      Plan a check of pump and piston seal.")
    assert following.endswith(".")


def test_an_unknown_verdict_gives_no_unconditional_probability_and_no_repair() -> None:
    entries = diagnosis_entries(with_library(found_as("minor_leakage", against=AGAINST), "minor_leakage"))
    said = verdict_lines({"file": "run.csv", **entries})
    assert "probability" not in said[0]
    assert "% if it had to be one of them" in said[0]
    assert not any("pump and piston seal" in line for line in said)


def test_the_nearest_condition_of_an_unknown_verdict_is_one_of_the_nine() -> None:
    """Before, a valve that never opened kept its share of "if it had to be one of them": 90 instead of 99.9 %."""
    shares = {"normal": 0.9, "minor_friction": 0.0005}
    said = headline({"probabilities": shares, "unknown": True, "condition": "unknown", "since_s": None})
    assert "99.9 % if it had to be" in said


def test_a_warning_precedes_the_severities_of_an_unknown_log() -> None:
    warned = "  numbers   do not rely on them: they are those of the nearest model, which does not fit the log"
    for against, there in ((AGAINST, True), ((), False)):
        entries = diagnosis_entries(with_library(found_as("minor_leakage", against=against), "minor_leakage"))
        said = verdict_lines({"file": "run.csv", **entries})
        assert (warned in said) is there
        assert not there or said.index(warned) < next(i for i, line in enumerate(said) if line.startswith("  leakage"))


@pytest.mark.parametrize(("shown", "said"), [(2.07e8, True), (2.2e8, False)])
def test_a_bulk_modulus_that_the_gate_refuses_is_doubted_beside_a_reliable_condition(shown: float, said: bool) -> None:
    """Before, a number that estimate calls doubtful stood below "reliable: yes"; the circuit's own number differs."""
    small = EstimateCode.PRESSURE_RESIDUALS_SMALL.note(ratio=1.6)
    found = found_as("normal")
    severities = {**found.severities, "bulk_modulus": Quantity.normal(shown, 1e6, "Pa")}
    entries = diagnosis_entries(replace(found, gate=Gate(False, (small,)), severities=severities))
    assert (f"do not rely on bulk modulus: {small}" in reliability_text(entries)) is said


def test_the_library_of_transfer_functions_agrees_or_disagrees_without_changing_the_verdict() -> None:
    alone = {**diagnosis_entries(found_as("minor_leakage")), "severity": None}
    agrees = diagnosis_entries(with_library(found_as("minor_leakage"), "minor_leakage"))
    differs = diagnosis_entries(with_library(found_as("minor_leakage"), "major_friction"))
    assert "agrees: minor leakage has the smallest error in velocity, 1.00 mm/s" in library_sentence(agrees)
    assert "names major friction instead: its error in velocity is 1.00 mm/s, that of minor leakage is 2.00 mm/s" in (
        library_sentence(differs)
    )
    for entries in (agrees, differs):
        said = verdict_lines({"file": "run.csv", **entries})
        assert said[-1].strip() == library_sentence(entries)
        assert len(said) == 8
        assert {key for key in alone if alone[key] != entries[key]} == {
            "severity",
            "transfer_function_scores",
            "transfer_function_condition",
        }


@pytest.mark.parametrize(
    "found",
    [
        found_as("minor_leakage", against=AGAINST),
        found_as("minor_leakage", Change(3.21, (3.1, 3.3), "normal")),
    ],
)
def test_the_library_is_not_mentioned_for_an_unknown_or_changing_condition(found: Finding) -> None:
    assert library_sentence(diagnosis_entries(with_library(found, "normal"))) == ""
    assert library_sentence(diagnosis_entries(found_as("minor_leakage"))) == ""


def test_the_library_is_not_mentioned_if_only_one_of_its_models_could_be_run() -> None:
    errors = {"normal": 0.0012, "minor_leakage": 0.0019}
    found = {"condition": "normal", "unknown": False, "since_s": None, "transfer_function_scores": errors}
    assert "agrees" in library_sentence(found)
    assert library_sentence({**found, "transfer_function_scores": {**errors, "minor_leakage": float("inf")}}) == ""


def test_the_margin_of_the_nominal_models_is_a_percentage_or_a_factor_by_its_size() -> None:
    about = {"condition": "normal", "runner_up": "minor_leakage", "unknown": False}
    said = {margin: models_sentence({**about, "margin": margin}) for margin in (1.001, 1.5, 3.0, float("inf"))}
    assert "only 0.1 % larger" in said[1.001]
    assert "50 % larger" in said[1.5]
    assert "3.0 times as large" in said[3.0]
    assert said[float("inf")] == "normal, which fits exactly, as minor_leakage does not"
    assert models_sentence({**about, "margin": 1.5, "unknown": True}).endswith(said[1.5])
