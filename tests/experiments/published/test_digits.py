"""The largest difference between a printed number and the number that was rounded to it."""

import pytest

from experiments.published.digits import digits_half
from plant.errors import HydrostateError


@pytest.mark.parametrize("exact", [2.345678, -0.0123456, 98765.4321])
@pytest.mark.parametrize("form", [".0f", ".2f", ".5f", ".3e"])
def test_a_rounded_number_is_within_half_its_last_digit_of_the_exact_one(exact: float, form: str) -> None:
    printed = f"{exact:{form}}".replace("e+0", "e")
    assert abs(float(printed) - exact) <= digits_half(printed)


@pytest.mark.parametrize("printed", ["3.4.5", "about 3", "1e", "12 %"])
def test_a_printed_number_with_other_characters_than_digits_is_refused(printed: str) -> None:
    with pytest.raises(HydrostateError, match="a printed number must be digits"):
        digits_half(printed)
