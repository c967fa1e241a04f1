"""A severity as a row of a page: in a reader's unit, or left out if the log does not determine it."""

import math
from dataclasses import replace

import pytest

from estimation.finding import Quantity
from experiments.page.severity_rows import severity_row


@pytest.mark.parametrize(
    "one",
    [
        Quantity(None, "N"),
        Quantity(3.0, "N"),
        Quantity(math.inf, "N", (1.0, 2.0)),
        Quantity(3.0, "N", (1.0, math.inf)),
        Quantity(3.0, "N", (math.nan, 4.0)),
    ],
)
def test_a_severity_without_value_or_finite_interval_has_no_row(one: Quantity) -> None:
    assert severity_row("added_friction", "added friction", one, 0.0, 10.0) is None


def test_the_bar_covers_zero_and_the_limit_which_has_three_digits() -> None:
    row = severity_row("added_friction", "added friction", Quantity(3.0, "N", (1.0, 5.0)), 0.0, 10.0)
    assert row is not None
    assert row.first <= 0.0
    assert row.last >= 10.0
    assert row.limit_text == "10"
    assert replace(row, limit=1184.0).limit_text == "1180"
    assert replace(row, limit=0.01234).limit_text == "0.0123"
    open_row = severity_row("added_friction", "added friction", Quantity(3.0, "N", (1.0, 5.0)), 0.0, None)
    assert open_row is not None
    assert open_row.limit_text == ""
