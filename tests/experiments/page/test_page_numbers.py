"""Numbers on pages, at the ends of the range that a file may contain."""

import math

import pytest

from experiments.page.numbers import MINUS, MISSING, TIMES, number


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (5e-324, f"4.941{TIMES}10⁻³²⁴"),
        (-1.7976931348623157e308, f"{MINUS}179.8{TIMES}10³⁰⁶"),
        (9.9996e4, f"100.0{TIMES}10³"),
        (9.9996e-4, "0.001000"),
        (-1234.5678, f"{MINUS}1235"),
        (math.inf, MISSING),
    ],
)
def test_numbers_of_any_magnitude_are_shown_with_four_digits(value: float, text: str) -> None:
    assert number(value) == text
