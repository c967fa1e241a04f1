"""What lines compute as instructions is what they compute in Python, to the bit, for one number and for several."""

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from plant.compiled.intrinsics import function_of, stepping
from plant.compiled.vector import exp, fma, log, present, sign, sqrt, tanh, where

Array = NDArray[np.float64]
X = np.array([0.7, -1.3, 0.0, 2.5e-8, -4e3, 1.0, 12.0, -0.1])
Y = np.array([-0.2, 0.4, 1.0, 3.0, 1e-3, 1.0, -12.0, 5e5])


def plain(x: Any, y: Any) -> Mapping[str, Any]:
    smooth = exp(-abs(x) / 7.0) + tanh(y - 0.5) * 2.0 - log(1.0 + y * y)
    chosen = where(x <= y, where(y > 1.0, 3.0, x), where(x >= 4.0, y, sign(x) - sign(0.1 - y)))
    return {"a": smooth, "b": chosen, "c": sqrt(x * x + 1.0), "d": 0.25, "e": where(x < 0.0, 1.0, 0.0)}


def fused(x: Any, y: Any) -> Mapping[str, Any]:
    return {"a": fma(x, y, 0.1), "b": fma(-x, 3.0, y), "c": where(present(0.0 / x), 1.0, 2.0)}


def stepped(what: Callable[..., Mapping[str, Any]], width: int) -> dict[str, list[float]]:
    """Step on slots of 8 numbers in memory, so many at a time."""
    slots = {name: 8 * i for i, name in enumerate("xyabcde")}
    step = stepping(slots, width, what)

    @numba.njit
    def every(work: Array) -> None:
        for lane in range(0, 8, width):
            step(work.ctypes.data + 8 * lane, 0.0)

    work = np.concatenate([X, Y, np.zeros(40)])
    every(work)
    return {name: work[slot : slot + 8].tolist() for name, slot in slots.items() if name not in "xy"}


@pytest.mark.parametrize("width", [1, 2, 8])
def test_lines_compute_what_python_does(width: int) -> None:
    wanted = [plain(x, y) for x, y in zip(X.tolist(), Y.tolist(), strict=True)]
    assert stepped(plain, width) == {name: [one[name] for one in wanted] for name in "abcde"}


@pytest.mark.parametrize("width", [1, 8])
def test_a_fused_product_is_rounded_once_and_what_is_no_number_is_seen(width: int) -> None:
    pairs = [(Fraction(x), Fraction(y)) for x, y in zip(X.tolist(), Y.tolist(), strict=True)]
    found = stepped(fused, width)
    assert found["a"] == [float(x * y + Fraction(0.1)) for x, y in pairs]
    assert found["b"] == [float(y - 3 * x) for x, y in pairs]
    assert found["c"] == [1.0 if x else 2.0 for x, _ in pairs]


def test_a_function_of_numbers_gives_a_tuple() -> None:
    function = function_of(plain, 5)

    @numba.njit
    def call(x: float, y: float) -> Any:
        return function((x, y))

    assert call(0.7, -0.2) == tuple(plain(0.7, -0.2).values())
