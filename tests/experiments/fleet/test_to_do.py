"""What to do about an actuator follows from the verdict on its last log."""

from typing import Any

import numpy as np
import pytest

from experiments.eha.plain_verdict import WORK_ON_FRICTION, WORK_ON_LEAKAGE
from experiments.fleet.actuator_page import actuator_page
from experiments.fleet.actuators import ActuatorRow, actuator_rows
from experiments.fleet.rows import log_rows
from experiments.fleet.to_do import BLEED, DIAGNOSE_IT, READ_ITS_PAGE, what_to_do
from tests.experiments.fleet.conftest import beside, between, store_row


def one(leakage: float, **more: Any) -> ActuatorRow:
    (row,) = actuator_rows(log_rows([store_row("a.csv", leakage, **more)], {}, {}))
    return row


@pytest.mark.parametrize(
    ("leakage", "found", "wanted"),
    [
        (1.0, "normal", []),
        (4.0, "minor_leakage", [WORK_ON_LEAKAGE["minor"]]),
        (2.0, "minor_leakage", []),  # within a limit that was set higher
        (9.0, "major_leakage_minor_friction", [WORK_ON_LEAKAGE["major"], WORK_ON_FRICTION["minor"]]),
        (3.1, "normal", [WORK_ON_LEAKAGE["minor"]]),  # past a limit that was set lower
        (4.0, "air_doubled", []),  # of another kind of actuator
    ],
)
def test_work_follows_from_the_condition_if_a_limit_is_passed(leakage: float, found: str, wanted: list[str]) -> None:
    row = one(leakage, found_condition=found)
    assert what_to_do(row, has_page=True) == wanted
    page = actuator_page(row, {})
    assert ("What to do" in page) is bool(wanted)


def test_a_growing_leak_is_to_be_checked_before_it_reaches_its_limit() -> None:
    rows = [store_row(f"a_{place}.csv", 1.0 + 0.05 * place) for place in range(30)]
    logs = log_rows(rows, {}, {})
    row = ActuatorRow("a", tuple(logs))
    assert row.state == "alarm"
    assert what_to_do(row, has_page=True) == [WORK_ON_LEAKAGE["minor"]]


@pytest.mark.parametrize("against", [between(0.5, 2.0), beside(0.5, 2.0)])
def test_work_on_a_fault_between_two_conditions_rests_on_rig_file_and_sensors(against: str) -> None:
    row = one(2.0, outcome="mismatch", found_condition=None, reason="so", against=against)
    first, second = what_to_do(row, has_page=True)
    assert first.startswith("If rig file and sensors are right: plan a check of pump")
    assert second == f"If rig file and sensors are right: c{WORK_ON_FRICTION['major'][1:]}"


@pytest.mark.parametrize(("has_page", "wanted"), [(True, READ_ITS_PAGE), (False, DIAGNOSE_IT)])
def test_a_log_without_a_verdict_is_to_be_read(has_page: bool, wanted: str) -> None:
    row = one(2.0, outcome="mismatch", found_condition=None, reason="the pump is worn")
    assert what_to_do(row, has_page=has_page) == [wanted]


def test_soft_oil_is_to_be_bled() -> None:
    row = one(1.0)
    (log,) = row.logs
    soft = {
        **log.amounts,
        "bulk_modulus": type(log.amounts["bulk_modulus"])(
            "bulk_modulus", "Pa", *np.array([1.2, 1.1, 1.3, 2.07, 1.656]) * 1e8
        ),
    }
    changed = ActuatorRow("a", (type(log)(log.file, log.named, "over", "normal", "", soft),))
    assert what_to_do(changed, has_page=True) == [BLEED]
