"""Divisions and roots side by side give the bits of divisions and roots alone."""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

from plant.compiled.expression import symbol, unary
from plant.compiled.intrinsics import stepping
from plant.compiled.pack import packed_source
from plant.compiled.source import lines_source
from plant.compiled.vector import fma, ratios, roots, sqrt, where

X, Y = symbol("x"), symbol("y")
SQUARES = unary("sqrt", X * X + Y * Y), unary("sqrt", X * X + 1.0)
OUTPUTS = {
    "a": X / Y + Y / X,
    "b": (X / (1.0 + Y * Y)) / SQUARES[0],
    "c": SQUARES[0] - SQUARES[1] / (X / Y),
    "d": 1.0 / SQUARES[1],
}


def lines(write: Callable[..., str]) -> Callable[..., Any]:
    scope: dict[str, Any] = {"ratios": ratios, "roots": roots, "sqrt": sqrt, "where": where, "fma": fma}
    exec(write("lines", OUTPUTS), scope)  # noqa: S102  # the text is what is under test
    return scope["lines"]


def stepped(write: Callable[..., str], width: int) -> np.ndarray:
    """Step on slots of 8 numbers in memory, so many at a time."""
    slots = {name: 8 * i for i, name in enumerate("xyabcd")}
    step = stepping(slots, width, lines(write))

    @numba.njit
    def every(work: np.ndarray) -> None:
        for lane in range(0, 8, width):
            step(work.ctypes.data + 8 * lane, 0.0)

    work = np.concatenate([np.linspace(-2.0, 3.0, 8), np.geomspace(1e-3, 1e3, 8), np.zeros(32)])
    every(work)
    return work[16:]


@pytest.mark.parametrize("width", [1, 8])
def test_packed_lines_give_the_bits_of_plain_ones(width: int) -> None:
    np.testing.assert_array_equal(stepped(packed_source, width), stepped(lines_source, 1))


def test_what_waits_for_another_quotient_is_not_packed_with_it() -> None:
    text = packed_source("lines", OUTPUTS)
    assert text.count("ratios(") == 2
    assert text.count("roots(") == 1
