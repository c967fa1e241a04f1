"""A diagnosis in words and as entries."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from experiments.command.verdict import headline, since, verdict_entries
from faults.conditions import CONDITIONS
from faults.diagnosis import Diagnosis
from faults.onset import Onset
from faults.severity import Severity


def entries(condition: str, onset: Onset | None) -> dict[str, Any]:
    others = dict.fromkeys(CONDITIONS, 0.0)
    board = cast("Any", SimpleNamespace(onset=onset))
    severity = {"leakage_flow": Severity(1.0, "L/min", (0.9, 1.1))}
    shares = {**others, condition: 0.97, "major_friction": 0.03}
    return verdict_entries(Diagnosis(condition, shares, False, (), severity, {"leakage_flow": 1.0}, (), board))


def test_a_change_within_the_log_is_dated_with_its_interval() -> None:
    found = entries("minor_leakage", Onset(3.21, (3.1, 3.3), "normal"))
    assert (found["since_s"], found["since_ci95_s"], found["condition_before"]) == (3.21, [3.1, 3.3], "normal")
    assert "since 3.21 s (3.10 to 3.30), normal until then" in headline(found)


def test_a_fault_without_a_change_was_there_before_the_log_began() -> None:
    found = entries("minor_leakage", None)
    assert (found["since_s"], found["since_ci95_s"], found["condition_before"]) == (None, None, None)
    assert "since before the log began" in headline(found)


def test_a_healthy_actuator_is_healthy_since_no_time_unless_it_was_ill() -> None:
    assert since(entries("normal", None)) == ""
    assert since(entries("normal", Onset(2.0, (1.9, 2.2), "minor_friction"))).endswith("minor friction until then")
    assert "since" not in headline(entries("normal", None))


@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_headline_begins_with_the_condition(condition: str) -> None:
    assert headline(entries(condition, None)).startswith(condition.replace("_", " "))
