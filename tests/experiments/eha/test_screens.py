"""What a terminal shows for many logs of the gear-pump actuator, and for few."""

from typing import Any

import pytest

from experiments.command.terminal import render_text
from experiments.eha.entries import NO_DIAGNOSIS, NO_ESTIMATE
from experiments.eha.screens import MOST_MESSAGES, MOST_TABLES, diagnoses_shown, estimates_shown
from experiments.eha.verdict_words import SEVERITY_NAMES


def estimate(number: int, passed: bool = True, **changes: Any) -> dict[str, Any]:
    modulus = {"value": 2.0712e8, "ci95": [2.0e8, 2.1e8], "ci95_total": [1.8e8, 2.4e8], "std": 1e6}
    told = {"file": f"run{number}.csv", "outcome": "ok", "message": f"reason {number}", "bulk_modulus_pa": modulus}
    return {**NO_ESTIMATE, **told, "bound_percent": 0.5, "gate": {"passed": passed, "reasons": []}, **changes}


def shown(results: list[dict[str, Any]]) -> str:
    return render_text(*estimates_shown(results, {}))


def test_a_value_has_both_intervals_in_megapascals_and_its_verdict() -> None:
    line = next(line for line in shown([estimate(1)]).splitlines() if "run1.csv" in line)
    assert " ".join(line.split()) == "run1.csv 207 200 to 210 180 to 240 0.5 ok"


def test_a_value_that_the_gate_refuses_is_called_doubtful_and_its_reason_is_given() -> None:
    told = shown([estimate(1), estimate(2, passed=False)])
    assert "run2.csv: reason 2" in told
    assert "reason 1" not in told
    assert told.count("doubtful") == 1


def test_each_reason_against_a_value_has_a_line_below_it() -> None:
    against = {"message": "207 MPa; do not rely on it: friction; play", "gate": {"passed": False}}
    against["gate"]["reasons"] = ["friction", "play"]
    assert "run1.csv: 207 MPa; do not rely on it\n  reasons   friction\n            play" in shown(
        [estimate(1, **against)]
    )


def test_a_log_without_a_value_or_an_interval_has_dashes() -> None:
    nothing = {"value": None, "ci95": None, "ci95_total": None}
    told = shown([estimate(1, False, bulk_modulus_pa=nothing, outcome="not_observable", bound_percent=float("inf"))])
    line = next(line for line in told.splitlines() if "run1.csv" in line)
    assert line.split() == ["run1.csv", "-", "-", "-", "-", "not", "observable"]
    alone = {"value": 2e8, "ci95": None, "ci95_total": None}
    line = next(line for line in shown([estimate(1, bulk_modulus_pa=alone)]).splitlines() if "run1" in line)
    assert line.split() == ["run1.csv", "200.0", "-", "-", "0.5", "ok"]


def test_doubtful_values_of_many_logs_are_counted_and_not_explained_singly() -> None:
    many = [estimate(number, passed=number % 2 == 0) for number in range(MOST_MESSAGES + 3)]
    told = shown(many)
    assert f"3 of {len(many)} logs gave no reliable value" in told
    assert "reason" not in told.replace("give the reasons", "")
    assert "no reliable value" not in shown([estimate(number) for number in range(MOST_MESSAGES + 1)])


SCORES = {"normal": 0.1, "minor_leakage": 0.2}


def diagnosis(number: int, **changes: Any) -> dict[str, Any]:
    told = {"file": f"run{number}.csv", "outcome": "ok", "message": f"said {number}", "expected": None}
    found = {"condition": "normal", "runner_up": "minor_leakage", "margin": 2.0, "unknown": False, "scores": SCORES}
    found["probabilities"] = {"normal": 0.9, "minor_leakage": 0.1}
    about = {"transfer_function_scores": None, "transfer_function_condition": None, "channels": [], "notes": []}
    return {**NO_DIAGNOSIS, **told, **found, **about, **changes}


def found_severity() -> dict[str, Any]:
    return {name: {"value": None, "unit": "1", "ci95": [None, None]} for name in SEVERITY_NAMES}


def diagnosed(results: list[dict[str, Any]], **options: Any) -> str:
    return render_text(*diagnoses_shown(results, {"scores": False, "transfer_functions": None, **options}))


def test_an_empty_line_separates_logs_from_each_other_and_from_notes() -> None:
    noted = diagnosis(2, notes=[{"code": "known_as_the_rig", "data": {}, "text": "the rig limits it"}])
    said = diagnosed([{**one, "severity": found_severity(), "message": ""} for one in (diagnosis(1), noted)]).split(
        "\n"
    )
    first = [place for place, line in enumerate(said) if line.startswith(("run2", "1 of 2 logs"))]
    assert len(first) == 2
    assert all(said[place - 1] == "" for place in first)


def test_many_diagnoses_are_shown_as_a_table_with_one_line_for_each() -> None:
    many = [diagnosis(number) for number in range(MOST_TABLES)]
    many += [
        diagnosis(7, severity={**found_severity(), "leakage_flow": {"value": 6.04, "unit": "L/min"}}),
        diagnosis(8, unknown=True),
        diagnosis(9, probabilities=None, condition=None, margin=None, runner_up=None),
    ]
    told = diagnosed(many)
    lines = {line.split()[0]: line.split() for line in told.splitlines() if line.strip().startswith("run")}
    assert lines["run0.csv"][-1] == "yes"
    assert lines["run0.csv"][1:4] == ["normal", "90.0", "minor_leakage"]
    assert lines["run7.csv"][4:7] == ["6.0", "-", "-"]
    assert lines["run8.csv"][-1] == "UNKNOWN"
    assert "run9.csv: said 9" in told  # a log without a verdict gives its reason
    assert "said 0" not in told
    assert "<- best" not in diagnosed(many, scores=True)


@pytest.mark.parametrize("channels", [["differential_pressure_pa"], ["velocity_m_s"]])
def test_the_table_of_model_errors_marks_the_best_and_the_runner_up(
    channels: list[str],
) -> None:
    others = {"transfer_function_scores": {"normal": 0.3, "minor_leakage": 0.05}}
    one = diagnosis(1, channels=channels, **others, transfer_function_condition="minor_leakage", probabilities=None)
    told = diagnosed([one], scores=True)
    assert f"model error [{'1' if channels[0].startswith('diff') else 'm/s'}]" in told
    marks = {line.split()[0]: line for line in told.splitlines() if line.split()[:1] in (["normal"], ["minor_leakage"])}
    assert marks["normal"].rstrip().endswith("<- best")
    assert marks["minor_leakage"].rstrip().endswith("runner-up, best transfer function")
    assert "model error" not in diagnosed([one])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"expected": "normal"}, "  expected  normal: agrees"),
        ({"expected": "minor_leakage"}, "  expected  minor leakage: does not agree"),
        ({"expected": "normal", "unknown": True}, "  expected  normal: does not agree"),
    ],
)
def test_the_expected_condition_is_compared_in_one_line(changes: dict[str, Any], said: str) -> None:
    told = diagnosed([diagnosis(1, severity=found_severity(), **changes)]).split("\n")
    assert told.count(said) == 1
    assert "said 1" not in " ".join(told)
