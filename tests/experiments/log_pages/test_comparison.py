"""A comparison of two logs, and the fleet page of the uploaded logs."""

from typing import Any

import pytest

from experiments.log_pages.comparison import compare_view, comparison_rows, plain_words, quantities_of
from experiments.serve.fleet_view import actuator_view, fleet_view
from faults.notes import AgainstCode


def result(value: float | None, half: float | None, **more: Any) -> dict[str, Any]:
    ends = None if value is None or half is None else [value - half, value + half]
    one = {"value": value, "std": None, "ci95": ends, "unit": "N"}
    return {"file": "a.csv", "message": "so", "severity": {"added_friction": one}, **more}


@pytest.mark.parametrize(
    ("second", "half", "changed"), [(13.0, 1.0, True), (11.0, 1.0, False), (7.0, 1.0, True), (13.0, 4.0, False)]
)
def test_a_quantity_has_changed_if_the_interval_of_the_difference_excludes_zero(
    second: float, half: float, changed: bool
) -> None:
    (row,) = comparison_rows(result(10.0, 1.0), result(second, half))
    assert row["difference"] == pytest.approx(second - 10.0)
    wide = (1.0 + half**2) ** 0.5
    assert row["interval"] == pytest.approx([second - 10.0 - wide, second - 10.0 + wide])
    assert row["changed"] is changed


def test_an_asymmetric_interval_gives_an_asymmetric_interval_of_the_difference() -> None:
    """Before, leakage of 6 L/min (3 to 16) less one of 6.04 was said to be between -7 and 6."""
    wide = {"value": 6.0, "std": None, "ci95": [3.0, 16.0], "unit": "N"}
    (row,) = comparison_rows(result(6.0, 0.02), {"file": "b", "message": "so", "severity": {"added_friction": wide}})
    assert row["interval"] == pytest.approx([-3.0, 10.0], abs=0.01)
    (back,) = comparison_rows({"file": "b", "message": "so", "severity": {"added_friction": wide}}, result(6.0, 0.02))
    assert back["interval"] == pytest.approx([-10.0, 3.0], abs=0.01)


@pytest.mark.parametrize("second", [result(None, None), result(12.0, None), {"file": "b", "message": "no"}])
def test_a_quantity_without_both_intervals_has_not_changed(second: dict[str, Any]) -> None:
    (row,) = comparison_rows(result(10.0, 1.0), second)
    assert (row["interval"], row["changed"]) == (None, False)


def test_quantities_of_every_kind_of_result_are_found() -> None:
    bulk = {"value": 2e8, "std": 1e6, "ci95": None}
    assert quantities_of({"bulk_modulus_pa": bulk, "severity": None}) == {"bulk_modulus": {"unit": "Pa", **bulk}}
    assert set(quantities_of(result(1.0, 0.1, quantities={"air": {"value": 0.1, "unit": ""}}))) == {
        "added_friction",
        "air",
    }


def test_the_page_of_two_logs_uses_mpa_and_escapes_file_names() -> None:
    bulk = {"value": 2.0e8, "std": 1e6, "ci95": [1.98e8, 2.02e8]}
    first = {"file": "<img src=x>.csv", "message": "one", "bulk_modulus_pa": bulk, "probabilities": {"normal": 0.9}}
    lower = {"value": 1.5e8, "std": 1e6, "ci95": [1.48e8, 1.52e8]}
    page = compare_view(first, {**first, "file": "b.csv", "bulk_modulus_pa": lower})
    assert "In the second log, bulk modulus is lower." in page
    assert "200.0 (198.0 to 202.0)" in page
    assert "bulk modulus [MPa]" in page
    assert "<img src=x>" not in page
    assert "No certain difference" in compare_view(first, first)


def test_logs_without_a_quantity_in_common_are_not_called_alike() -> None:
    first = result(1.0, 0.1, probabilities={"major_leakage": 1.0})
    page = compare_view(first, {"file": "b.csv", "message": "inspected"})
    assert "The two logs cannot be compared: no quantity has an interval in both." in page
    assert "No certain difference" not in page
    assert "&lt; 0.1" not in page  # the second log was not diagnosed, so no condition has a small probability


def test_logs_of_equal_name_are_shown_with_their_ids_and_an_invalid_date_is_accepted() -> None:
    row = {"outcome": "ok", "found_condition": "normal"}
    rows = [("0" * 16, "run.csv", row), ("1" * 16, "run.csv", row), ("2" * 16, "P_2026-99-99.csv", row)]
    page = fleet_view([*rows, ("3" * 16, "P_2026-01-02.csv", row)], "{actuator}_{date}.csv", {}, {}, "here")
    assert "run.csv (000000)" in page
    assert "run.csv (111111)" in page
    assert "P_2026-99-99.csv" in page
    assert f"logs/{'3' * 16}" in page
    assert "None of 4 actuators" in page


def test_the_title_lists_higher_and_lower_quantities_of_the_second_log() -> None:
    first = {"file": "a", "message": "so", "quantities": {n: {"value": 1.0, "std": 0.01, "unit": ""} for n in "abc"}}
    values = {"a": 2.0, "b": 0.5, "c": 0.2}
    second = {**first, "quantities": {name: {"value": one, "std": 0.01, "unit": ""} for name, one in values.items()}}
    assert "<h1>In the second log, a is higher; b and c are lower.</h1>" in compare_view(first, second)


HALF_MINOR = AgainstCode.BETWEEN_CONDITIONS.note(leakage=0.5, friction=0.0).to_dict()


@pytest.mark.parametrize(
    ("second", "title"),
    [
        ({"condition": "normal"}, "From major leakage to normal."),
        (
            {"condition": "normal", "unknown": True, "reasons": ["one"], "notes": [HALF_MINOR]},
            "From major leakage to leakage between none and minor.",
        ),
        ({}, "Major leakage in both logs."),
    ],
)
def test_the_heading_of_two_diagnoses_names_both_conditions(second: dict[str, Any], title: str) -> None:
    first = result(2.0, 0.1, condition="major_leakage", unknown=False, probabilities={"major_leakage": 1.0}, notes=[])
    first |= {"reasons": []}
    page = compare_view(first, {**first, **second})
    assert f"<h1>{title}</h1>" in page
    assert '<p class="answer">No certain difference between the two logs.</p>' in page


WORN = {"code": "pump_worn", "severity": "warning", "text": "the pump is worn", "data": {}}


@pytest.mark.parametrize(
    ("notes", "title"),
    [
        ([], "From major leakage to no verdict."),
        ([WORN], "From major leakage to a fault beside the nine conditions."),
    ],
)
@pytest.mark.parametrize("turned", [False, True])
def test_nothing_is_said_to_have_changed_if_no_model_fits_one_of_the_logs(
    notes: list[dict[str, Any]], title: str, turned: bool
) -> None:
    shares = {"major_leakage": 1.0}
    first = result(2.0, 0.1, condition="major_leakage", unknown=False, probabilities=shares, notes=[], reasons=[])
    second = result(9.0, 0.1, condition="normal", unknown=True, probabilities={"normal": 1.0}, notes=notes)
    second |= {"file": "b.csv", "reasons": ["the pump is worn"]}
    page = compare_view(*((second, first) if turned else (first, second)))
    assert turned or f"<h1>{title}</h1>" in page
    assert "Nothing certain can be said of what changed: the numbers of b.csv are not reliable." in page
    assert "In the second log" not in page
    assert ">changed<" not in page
    assert ">not reliable<" in page
    assert page.count("Do not rely on its numbers") == 1
    conditions = page.split('id="conditions"')[1]
    assert "normal" not in conditions  # the nearest condition of a log that fits none
    assert "A dash: none of the nine fits the log." in conditions


def test_a_fault_between_two_conditions_is_compared_as_its_page_shows_it() -> None:
    shares = {"major_leakage": 1.0}
    first = result(2.0, 0.1, condition="major_leakage", unknown=False, probabilities=shares, notes=[], reasons=[])
    second = {**result(9.0, 0.1), "condition": "normal", "unknown": True, "probabilities": {"normal": 1.0}}
    second |= {"reasons": ["one"], "notes": [HALF_MINOR]}
    page = compare_view(first, second)
    assert "In the second log, added friction is higher." in page
    assert "Do not rely" not in page


def test_a_comparison_links_to_both_logs_the_list_and_the_reverse_comparison() -> None:
    one = {"file": "a.csv", "message": "so"}
    page = compare_view(one, {**one, "file": "b.csv"}, ("0" * 16, "1" * 16))
    for link in (f"logs/{'0' * 16}", f"logs/{'1' * 16}", ".", f"compare?first={'1' * 16}&amp;second={'0' * 16}"):
        assert f'href="{link}"' in page
    assert "href" not in compare_view(one, one).split("<nav")[0].split("<header")[1]


def test_a_comparison_uses_the_verdicts_of_the_pages_and_warns_of_an_unknown_one() -> None:
    leaks = {
        "file": "a.csv",
        "message": "so",
        "condition": "minor_leakage",
        "unknown": False,
        "notes": [],
        "reasons": [],
    }
    shares = {"minor_leakage": 0.97, "normal": 0.03}
    said = "The actuator leaks inside more than it should (minor leakage); friction is normal. This is probable (97 %)."
    assert plain_words({**leaks, "probabilities": shares}) == said
    assert plain_words({"condition": None, "message": "no"}) == plain_words({"message": "2 GPa"}) == ""
    doubtful = {**leaks, "unknown": True, "probabilities": shares}
    assert "Probability" not in plain_words(doubtful)
    page = compare_view(leaks, doubtful)
    assert page.count("Do not rely on its numbers") == 1


def test_an_actuator_with_several_logs_has_a_page_that_lists_its_last_logs() -> None:
    row = {"outcome": "ok", "found_condition": "normal"}
    rows = [(f"{day}" * 16, f"P 1_2026-01-0{day}.csv", row) for day in (1, 2)]
    named = ("{actuator}_{date}.csv", dict[str, float](), dict[str, list[float]]())
    fleet = fleet_view([*rows, ("3" * 16, "Q_2026-01-03.csv", row)], *named, "here")
    assert "actuator?name=P%201" in fleet
    assert f"logs/{'3' * 16}" in fleet
    assert '<a href=".">All logs</a>' in fleet
    assert "--pages" not in fleet
    page = actuator_view(rows, *named, "P 1")
    assert page.count("P 1_2026-01-0") == 2
    assert f'href="logs/{"2" * 16}"' in page
    assert 'href="fleet"' in page
    assert actuator_view(rows, *named, "none") == ""


def test_a_quantity_without_a_value_has_no_difference_and_other_entries_are_omitted() -> None:
    first = {
        "file": "a.csv",
        "message": "one",
        "severity": {"added_friction": {"value": None, "unit": "N"}, "note": "x"},
    }
    second = result(12.0, 1.0)
    (row,) = comparison_rows(first, second)
    assert (row["difference"], row["changed"]) == (None, False)
    page = compare_view(first, second)
    assert "12.0 (11.0 to 13.0)" in page
    assert "None" not in page
