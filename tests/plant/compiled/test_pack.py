"""Divisions and roots computed side by side give the same bits as one at a time."""

from collections.abc import Callable

import numpy as np
import pytest

from plant.compiled.expression import symbol, unary
from plant.compiled.pack import packed_source
from plant.compiled.source import lines_source
from tests.kernels import stepped

X, Y = symbol("x"), symbol("y")
SQUARES = unary("sqrt", X * X + Y * Y), unary("sqrt", X * X + 1.0)
OUTPUTS = {
    "a": X / Y + Y / X,
    "b": (X / (1.0 + Y * Y)) / SQUARES[0],
    "c": SQUARES[0] - SQUARES[1] / (X / Y),
    "d": 1.0 / SQUARES[1],
}
GIVEN = {"x": np.linspace(-2.0, 3.0, 8), "y": np.geomspace(1e-3, 1e3, 8)}


def of(write: Callable[..., str], width: int) -> dict[str, list[float]]:
    found = stepped(write("lines", OUTPUTS), "lines", GIVEN, "abcd", width)
    return {name: values.tolist() for name, values in found.items()}


@pytest.mark.parametrize("width", [1, 8])
def test_packed_lines_give_the_same_bits_as_unpacked_ones(width: int) -> None:
    found = of(packed_source, width)
    assert found == of(lines_source, 1)
    assert list(found) == list(OUTPUTS)


def test_a_quotient_that_depends_on_another_is_not_packed_with_it() -> None:
    text = packed_source("lines", OUTPUTS)
    assert text.count("ratios(") == 2
    assert text.count("roots(") == 1
