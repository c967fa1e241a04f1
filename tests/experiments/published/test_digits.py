"""The largest difference between a printed number and the number that was rounded to it."""

import pytest

from experiments.published.digits import digits_half
from plant.errors import HydrostateError


@pytest.mark.parametrize("exact", [2.345678, -0.0123456, 98765.4321])
@pytest.mark.parametrize("form", [".0f", ".2f", ".5f", ".3e"])
def test_what_is_printed_is_within_half_a_digit_of_what_was_rounded(exact: float, form: str) -> None:
    printed = f"{exact:{form}}".replace("e+0", "e")
    assert abs(float(printed) - exact) <= digits_half(printed)


@pytest.mark.parametrize("printed", ["3.4.5", "about 3", "1e", "12 %"])
def test_what_is_no_number_has_no_last_digit(printed: str) -> None:
    with pytest.raises(HydrostateError, match="a printed number must be digits"):
        digits_half(printed)
