"""The assessment of a verdict: an error is silent if nothing in the answer warns of it."""

from typing import Any

import pytest

from experiments.open_benchmark.judge import judge_bulk_modulus, judge_class, names_cause
from experiments.open_benchmark.score import coverage, summary

TRUTH = {"beta_lo": "2e8", "beta_hi": "2.1e8", "accept": "normal;unknown"}


def estimate(value: float | None, half: float = 1e5, *, passed: bool = True, **more: Any) -> dict[str, Any]:
    quantity: dict[str, Any] = {"value": value, "ci95": None if value is None else [value - half, value + half]}
    return {"outcome": "ok", "bulk_modulus_pa": {**quantity, **more}, "gate": {"passed": passed}}


@pytest.mark.parametrize(
    ("said", "covered", "silent", "narrow"),
    [
        (estimate(2.05e8), True, False, False),
        (estimate(2.12e8), False, False, True),
        (estimate(2.4e8), False, True, True),
        (estimate(2.4e8, passed=False), False, False, False),
        (estimate(2.4e8, ci95_total=[2e8, 2.8e8]), False, False, False),
        (estimate(None), None, False, False),
    ],
    ids=["within the range", "a little off", "far off", "flagged", "far off, total interval admits it", "no number"],
)
def test_a_large_error_without_a_warning_is_silent(
    said: dict[str, Any], covered: bool | None, silent: bool, narrow: bool
) -> None:
    row = judge_bulk_modulus(said, TRUTH)
    assert (row["covered"], row["silent_beta"], row["narrow"]) == (covered, silent, narrow)


def diagnosis(name: str | None, p: float, *, unknown: bool = False) -> dict[str, Any]:
    return {"outcome": "ok", "condition": name, "probabilities": {name: p}, "unknown": unknown}


@pytest.mark.parametrize(
    ("said", "accept", "verdict", "silent", "false_unknown"),
    [
        (diagnosis("normal", 0.99), "normal", "right", False, False),
        (diagnosis("minor_leakage", 0.99), "normal", "wrong", True, False),
        (diagnosis("minor_leakage", 0.6), "normal", "wrong", False, False),
        (diagnosis("minor_leakage", 0.99, unknown=True), "normal", "unknown", False, True),
        (diagnosis("minor_leakage", 0.99, unknown=True), "normal;unknown", "unknown", False, False),
        (diagnosis(None, 0.0), "normal", "failed", False, False),
    ],
)
def test_a_wrong_and_confident_condition_is_silent(
    said: dict[str, Any], accept: str, verdict: str, silent: bool, false_unknown: bool
) -> None:
    row = judge_class(said, {"accept": accept})
    assert (row["verdict"], row["silent_class"], row["false_unknown"]) == (verdict, silent, false_unknown)


@pytest.mark.parametrize(
    ("ends", "steady", "began", "false", "dated"),
    [
        (None, True, "", False, None),
        ([5.2, 5.3], True, "", True, None),
        ([5.2, 5.3], False, "", False, None),
        ([5.2, 5.3], False, "5.25", False, True),
        ([5.2, 5.3], False, "5.35", False, False),
        (None, False, "5.25", False, False),
    ],
)
def test_the_date_of_a_condition_is_right_false_or_missing_against_the_truth(
    ends: list[float] | None, *, steady: bool, began: str, false: bool, dated: bool | None
) -> None:
    said = diagnosis("normal", 0.99) | {"since_ci95_s": ends}
    row = judge_class(said, {"accept": "normal", "steady": steady, "since_s": began})
    assert (row["false_since"], row["since"]) == (false, dated)
    assert judge_class(said, {"accept": "normal"})["since"] is None  # data sets of other authors do not state it


def test_a_cause_counts_as_named_in_any_message_or_warning() -> None:
    assert names_cause("", {"message": "lag"}) is None
    assert names_cause(r"\blag", {"message": "ok", "warnings": ["pressure lags by 2 ms"]}) is True
    assert names_cause(r"\blag", {"message": "ok"}, {"reasons": ["the flag is set"]}) is False


def test_the_summary_counts_logs_by_set_and_sensors() -> None:
    row = judge_bulk_modulus(estimate(2.4e8), TRUTH) | judge_class(diagnosis("minor_leakage", 0.99), TRUTH)
    row |= {"set": "a", "pressure": True, "named": None, "severities": 2, "covered_severities": 1, "seconds": 1.0}
    (line,) = summary([row, row | {"silent_class": False}]).to_dict("records")
    assert (line["logs"], line["silent_beta"], line["silent_class"], line["severities_%"]) == (2, 2, 1, 50.0)


def test_coverage_is_counted_for_each_quantity_over_the_logs_with_a_value() -> None:
    told = [{"z_leakage_flow": 1.0}, {"z_leakage_flow": -3.0}, {"z_flow_bias": 0.5}]
    (leakage, bias) = coverage([row | {"set": "a", "pressure": True} for row in told]).to_dict("records")
    assert (leakage["quantity"], leakage["numbers"], leakage["covered"]) == ("leakage_flow", 2, 1)
    assert (leakage["z"], leakage["largest"]) == (pytest.approx(5.0**0.5), -3.0)
    assert (bias["quantity"], bias["numbers"], bias["covered"]) == ("flow_bias", 1, 1)
