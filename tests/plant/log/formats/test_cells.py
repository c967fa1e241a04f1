import math

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.formats.cells import MISSING, number, numbers


@pytest.mark.parametrize(("text", "value"), [(" 1.5 ", 1.5), ("+2e-3", 2e-3), ("-0", 0.0), ("1e999", math.inf)])
def test_numbers_as_loggers_write_them_are_read(text: str, value: float) -> None:
    assert number(text) == value


@pytest.mark.parametrize("text", MISSING)
def test_every_text_for_a_missing_value_is_read_as_missing(text: str) -> None:
    assert math.isnan(number(text))


@pytest.mark.parametrize("text", ["abc", "none", "1_000", "0x10", "1,5", "+-"])
def test_text_is_no_number(text: str) -> None:
    with pytest.raises(ValueError, match=r"\S"):
        number(text)


def test_a_column_of_texts_and_gaps_becomes_floats() -> None:
    column = numbers(np.array(["1.5", None, 2, "nan"], dtype=object), "speed", "a.csv")
    np.testing.assert_array_equal(column, [1.5, np.nan, 2.0, np.nan])


def test_the_first_text_in_a_column_is_named_with_its_row() -> None:
    with pytest.raises(LogError, match=r"a\.csv: column 'speed' must hold numbers, got 'x' in row 2"):
        numbers(np.array([1.0, "x", "y"], dtype=object), "speed", "a.csv")


def test_one_text_in_a_hundred_cells_is_missing_with_a_note() -> None:
    cells = np.array([*map(str, range(99)), "x"], dtype=object)
    with pytest.warns(LogWarning, match=r"column 'speed' has cells .*\(cells: 1, the first is 'x' in row 100\)"):
        assert np.flatnonzero(np.isnan(numbers(cells, "speed", "a.csv"))).tolist() == [99]


def test_a_table_is_no_column() -> None:
    with pytest.raises(LogError, match=r"one-dimensional, got shape \(2, 2\)"):
        numbers(np.eye(2), "speed", "a.csv")


def test_the_unicode_minus_sign_is_read_as_a_minus() -> None:
    assert number("\u22121.5e\u22123") == -1.5e-3
