"""Two logs side by side, and the fleet of what was dropped."""

from typing import Any

import pytest

from experiments.serve.comparison import compare_view, compared, quantities_of
from experiments.serve.fleet_view import fleet_view


def result(value: float | None, half: float | None, **more: Any) -> dict[str, Any]:
    ends = None if value is None or half is None else [value - half, value + half]
    one = {"value": value, "std": None, "ci95": ends, "unit": "N"}
    return {"file": "a.csv", "message": "so", "severity": {"added_friction": one}, **more}


@pytest.mark.parametrize(
    ("second", "half", "changed"), [(13.0, 1.0, True), (11.0, 1.0, False), (7.0, 1.0, True), (13.0, 4.0, False)]
)
def test_a_quantity_changed_where_the_interval_of_the_difference_leaves_out_zero(
    second: float, half: float, changed: bool
) -> None:
    (row,) = compared(result(10.0, 1.0), result(second, half))
    assert row["difference"] == pytest.approx(second - 10.0)
    wide = (1.0 + half**2) ** 0.5
    assert row["interval"] == pytest.approx([second - 10.0 - wide, second - 10.0 + wide])
    assert row["changed"] is changed


@pytest.mark.parametrize("second", [result(None, None), result(12.0, None), {"file": "b", "message": "no"}])
def test_without_both_intervals_nothing_is_said_to_have_changed(second: dict[str, Any]) -> None:
    (row,) = compared(result(10.0, 1.0), second)
    assert (row["interval"], row["changed"]) == (None, False)


def test_quantities_of_every_kind_of_result_are_found() -> None:
    bulk = {"value": 2e8, "std": 1e6, "ci95": None}
    assert quantities_of({"bulk_modulus_pa": bulk, "severity": None}) == {"bulk_modulus": {"unit": "Pa", **bulk}}
    assert set(quantities_of(result(1.0, 0.1, quantities={"air": {"value": 0.1, "unit": ""}}))) == {
        "added_friction",
        "air",
    }


def test_the_page_of_two_logs_shows_readers_units_and_no_tag_of_a_name() -> None:
    bulk = {"value": 2.0e8, "std": 1e6, "ci95": [1.98e8, 2.02e8]}
    first = {"file": "<img src=x>.csv", "message": "one", "bulk_modulus_pa": bulk, "probabilities": {"normal": 0.9}}
    page = compare_view(first, {**first, "file": "b.csv", "bulk_modulus_pa": {**bulk, "value": 1.5e8}})
    assert "Bulk modulus differs between the two logs." in page
    assert "200.0 (198.0 to 202.0)" in page
    assert "MPa" in page
    assert "<img src=x>" not in page
    assert "No certain difference" in compare_view(first, first)


def test_logs_of_one_name_are_told_apart_and_a_date_that_is_none_leaves_a_log_without_an_actuator() -> None:
    row = {"outcome": "ok", "found_condition": "normal"}
    rows = [("0" * 16, "run.csv", row), ("1" * 16, "run.csv", row), ("2" * 16, "P_2026-99-99.csv", row)]
    page = fleet_view([*rows, ("3" * 16, "P_2026-01-02.csv", row)], "{actuator}_{date}.csv", {}, "here")
    assert "run.csv (000000)" in page
    assert "run.csv (111111)" in page
    assert "P_2026-99-99.csv" in page
    assert f"logs/{'3' * 16}" in page
    assert "None of 4 actuators" in page


def test_what_has_no_value_is_shown_as_missing_and_what_is_no_quantity_is_left_out() -> None:
    first = {
        "file": "a.csv",
        "message": "one",
        "severity": {"added_friction": {"value": None, "unit": "N"}, "note": "x"},
    }
    second = result(12.0, 1.0)
    (row,) = compared(first, second)
    assert (row["difference"], row["changed"]) == (None, False)
    page = compare_view(first, second)
    assert "12.0 (11.0 to 13.0)" in page
    assert "None" not in page
