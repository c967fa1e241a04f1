"""Cells of a batch's page: quantities of another actuator in words, and a dash where there is nothing."""

import json

import numpy as np

from experiments.batch.pages import _or_dash, _quantities
from experiments.page.numbers import MISSING


def test_quantities_are_told_with_their_intervals_and_those_without_a_value_are_left_out() -> None:
    entries = {
        "spring_stiffness": {"value": 1e4, "unit": "N/m", "ci95": [9e3, 1.1e4]},
        "gain": {"value": 2.0, "unit": "1", "ci95": None},
        "leakage": {"value": None, "unit": "L/min", "ci95": None},
    }
    first, second = _quantities(json.dumps(entries)).split("; ")
    assert first.startswith("spring stiffness ")
    assert "N/m (" in first
    assert " to " in first
    assert second.rstrip() == "gain 2.000"


def test_what_is_not_there_is_a_dash() -> None:
    assert _quantities(None) == _quantities(np.nan) == MISSING
    assert [_or_dash(one) for one in (None, np.nan, "", "normal")] == [MISSING] * 3 + ["normal"]
