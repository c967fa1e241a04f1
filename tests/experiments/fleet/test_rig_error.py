"""Forecasts with the doubt about the rig file, which all logs of an actuator share."""

import json
from typing import Any

import pytest

from experiments.fleet.actuator_page import actuator_page
from experiments.fleet.actuators import ActuatorRow, actuator_rows
from experiments.fleet.naming import by_pattern
from experiments.fleet.rows import log_rows
from tests.experiments.fleet.conftest import store_row


def growing(reach: tuple[float, float] | None) -> ActuatorRow:
    """Return an actuator whose leakage grows, with a total interval that reaches down and up, or without one."""
    files = [f"P-1_{place}.csv" for place in range(30)]
    rows: list[dict[str, Any]] = []
    for place, file in enumerate(files):
        row = dict(store_row(file, 1.0 + 0.05 * place))
        amounts = json.loads(row["quantities"])
        value = amounts["leakage_flow"]["value"]
        if reach:
            amounts["leakage_flow"]["ci95_total"] = [value - reach[0], value + reach[1]]
        rows.append({**row, "quantities": json.dumps(amounts)})
    (row,) = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {}))
    return row


def test_the_interval_of_a_date_includes_the_doubt_about_the_rig_file() -> None:
    """Before, an error common to all logs was left out: of 90 % intervals, 60 to 80 % covered."""
    row = growing((0.8, 0.5))
    outlook = row.outlook
    assert outlook is not None
    assert outlook.left is not None
    assert outlook.total_quantiles is not None
    assert outlook.logs[-1].amounts["leakage_flow"].common == pytest.approx((0.3952, 0.2338), abs=1e-3)
    assert outlook.total_quantiles[0] < outlook.left[0] - 3.0
    assert outlook.total_quantiles[2] == outlook.left[1]
    assert outlook.total_quantiles[4] > outlook.left[2] + 3.0
    low, high = (round(outlook.total_quantiles[place]) for place in (0, 4))
    assert f"({low} to {high})" in outlook.words
    page = actuator_page(row, {}).replace("\N{NO-BREAK SPACE}", " ")
    exact = outlook.when(0, 4)
    assert f"90 %: {low} to {high} logs; 90 % if the rig file is exact: {exact})" in page
    assert "90 % if the rig file is exact</th>" in page
    assert "90 % if the rig file is exact" not in actuator_page(growing(None), {})


def test_the_interval_of_the_level_includes_the_doubt_about_the_rig_file() -> None:
    """Before, it was that of the scatter of the logs alone: 2.36 to 2.54 L/min, where no log tells it that well."""
    plain, doubted = (
        actuator_page(growing(reach), {}).replace("\N{NO-BREAK SPACE}", " ") for reach in (None, (0.8, 0.5))
    )
    assert "2.45 L/min (2.36 to 2.54)" in plain
    assert "2.5 L/min (1.7 to 2.9)" in doubted
    assert "Dots and band take the rig file as exact" in doubted
    assert "Dots and band take the rig file as exact" not in plain
