"""The state of a log follows from its severities and their limits."""

import json
from typing import Any

import pytest

from experiments.fleet.actuator_page import actuator_page
from experiments.fleet.actuators import ActuatorRow, actuator_rows
from experiments.fleet.naming import by_pattern
from experiments.fleet.page import fleet_page, rig_hint, row_cells, sickest_of, title_of
from experiments.fleet.rows import STATES, log_rows
from tests.experiments.fleet.conftest import beside, between, store_row


@pytest.mark.parametrize(
    ("leakage", "spread", "state"),
    [(1.2, 0.2, "within"), (2.9, 0.2, "open"), (3.1, 0.2, "likely"), (3.5, 0.2, "over")],
)
def test_the_state_follows_from_value_and_interval_relative_to_the_limit(
    leakage: float, spread: float, state: str
) -> None:
    (row,) = log_rows([store_row("a.csv", leakage, spread)], {}, {})
    assert row.state == state
    assert row.worst is not None
    assert row.worst.name == ("leakage_flow" if leakage > 2.0 else "bulk_modulus")


def test_bulk_modulus_is_bad_below_its_limit() -> None:
    (row,) = log_rows([store_row("a.csv", 1.0)], {}, {"bulk_modulus": 2.05e8})
    assert row.state == "likely"
    assert row.amounts["bulk_modulus"].share > 1.0


def test_a_given_limit_replaces_the_limit_of_the_store() -> None:
    assert log_rows([store_row("a.csv", 2.0)], {}, {"leakage_flow": 1.5})[0].state == "over"


def test_logs_without_a_verdict_have_the_state_unknown_or_failed() -> None:
    unknown, failed = log_rows(
        [store_row("a.csv", 1.0, outcome="mismatch"), store_row("b.csv", 1.0, outcome="failed", quantities=None)],
        {},
        {},
    )
    assert (unknown.state, failed.state) == ("unknown", "failed")


def test_a_log_between_two_conditions_is_at_most_probably_past_a_limit() -> None:
    doubt: dict[str, Any] = {"outcome": "mismatch", "found_condition": None, "reason": "none of the nine"}
    rows = [
        store_row("a.csv", 1.8, against=between(0.5, 0.0), **doubt),
        store_row("b.csv", 9.0, against=between(1.5, 0.0), **doubt),
        store_row("c.csv", 9.0, **doubt),
    ]
    found = log_rows(rows, {}, {})
    assert [(one.state, one.has_verdict) for one in found] == [("open", True), ("likely", True), ("unknown", False)]


def test_a_circuit_outside_the_nine_has_no_verdict_but_is_named_if_few_actuators_are() -> None:
    doubt: dict[str, Any] = {"outcome": "mismatch", "found_condition": None, "against": beside(1.25, 0.0)}
    files = [f"P-{number}_{place}.csv" for number in range(9) for place in range(5)]
    rows = [store_row(one, 4.0, **(doubt if one > "P-8_1.csv" else {})) for one in files]

    def fleet(sick: list[Any]) -> list[ActuatorRow]:
        return actuator_rows(log_rows(sick, by_pattern(files, "{actuator}_{date}.csv"), {}))

    (row,) = fleet(rows[-5:])
    assert (row.state, row.last.has_verdict, row.last.shows_severities) == ("unknown", False, True)
    assert row_cells(row)[2:6] == [
        "leakage between minor and major, if the rig file is right",
        "leakage 4.00 L/min",
        None,
        "no verdict since 2",
    ]
    assert "No verdict since 2; leakage 4.00 L/min now, if the rig file is right" in actuator_page(row, {}).replace(
        "\N{NO-BREAK SPACE}", " "
    )
    assert 'data-head="worst">leakage 4.00' in actuator_page(row, {})
    assert sickest_of(fleet([store_row(files[0], 1.0), *rows[-5:]])) == ["P-8"]
    # if many lie beside the nine, the rig file probably describes another size
    assert sickest_of(fleet([store_row(one, 4.0, **doubt) for one in files])) == []
    assert "move their logs" in rig_hint(fleet([store_row(one, 4.0, **doubt) for one in files]))


def test_an_intermediate_log_with_a_further_reason_against_it_is_unknown() -> None:
    against = json.dumps([*json.loads(between(0.5, 0.0)), {"code": "oil_soft", "data": {}}])
    (row,) = log_rows([store_row("a.csv", 9.0, outcome="mismatch", against=against)], {}, {})
    assert (row.state, row.has_verdict) == ("unknown", False)


def test_a_log_with_an_unreadable_date_has_its_own_row_and_keeps_its_verdict() -> None:
    files = ["A_2026-99-01.csv", "A_2026-11-22.csv"]
    rows = [store_row(files[0], 4.0), store_row(files[1], 1.0)]
    logs = log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {})
    found = actuator_rows(logs)
    assert [(one.name, one.state) for one in found] == [(files[0], "over"), ("A", "within")]
    assert "must be ISO 8601 such as 2026-11-22, or a number, got '2026-99-01'" in logs[0].named.problem
    assert title_of(found) == "The actuator is past no limit; the log without an actuator is past one."
    page = fleet_page(found, {}, "hall")
    assert "Logs without a usable date" in page
    assert "could not be read" not in page


def test_the_state_of_another_kind_of_actuator_follows_from_its_condition() -> None:
    rows = [store_row("a.csv", 1.0, quantities=None, found_condition=name) for name in ("healthy", "cracked_flap")]
    assert [one.state for one in log_rows(rows, {}, {})] == ["within", "over"]


def test_estimates_and_simulated_runs_are_left_out_of_a_fleet() -> None:
    assert log_rows([store_row("a.csv", 1.0, verb="estimate"), store_row("", 1.0)], {}, {}) == []


def test_actuators_are_sorted_by_the_severity_of_their_last_log() -> None:
    files = {"A_3.csv": 3.4, "A_1.csv": 1.0, "B_1.csv": 9.0, "B_2.csv": 1.1, "C_1.csv": 4.4, "D_1.csv": 3.1}
    rows = [store_row(file, leakage) for file, leakage in files.items()]
    found = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {}))
    assert [one.name for one in found] == ["C", "A", "D", "B"]
    assert [len(one.logs) for one in found] == [1, 2, 1, 2]


def test_the_state_of_an_actuator_is_that_of_its_last_readable_log() -> None:
    rows = [store_row("A_1.csv", 3.6), store_row("A_2.csv", 1.0, outcome="failed", quantities=None)]
    (row,) = actuator_rows(log_rows(rows, by_pattern(["A_1.csv", "A_2.csv"], "{actuator}_{date}.csv"), {}))
    assert row.last.state == "over"


def test_every_state_has_a_description() -> None:
    assert all(words for words in STATES.values())


def test_a_severity_as_when_healthy_is_0_percent_of_its_limit_without_a_sign() -> None:
    """Before, the table of a fleet showed -0 % where a value was a little better than healthy."""
    leakage = json.loads(store_row("P-1_1.csv", 0.9999)["quantities"])["leakage_flow"]
    sound = store_row("P-1_1.csv", 1.0, quantities=json.dumps({"leakage_flow": leakage}))
    (row,) = actuator_rows(log_rows([sound], by_pattern(["P-1_1.csv"], "{actuator}_{date}.csv"), {}))
    assert str(row_cells(row)[4]) == "0.0"
