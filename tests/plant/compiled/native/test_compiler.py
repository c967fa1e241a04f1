"""Compiled code gives the same bits as Python; code that cannot be compiled is refused with its line."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from plant.arrays import Array
from plant.compiled.native.kinds import KernelError
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature
from plant.compiled.paste import functions_text


def compiled(takes: str, *functions: Callable[..., Any]) -> Callable[..., Any]:
    name = functions[-1].__name__
    return getattr(load_native(name, functions_text(*functions), {name: signature(takes)}), name)


def quotients(a: int, b: int) -> tuple[int, int, float]:
    return a // b, a % b, a / b


@pytest.mark.parametrize(("a", "b"), [(7, 2), (-7, 2), (7, -2), (-7, -2), (6, 3), (0, 5)])
def test_whole_numbers_are_divided_as_python_divides_them(a: int, b: int) -> None:
    assert compiled("a, b : int", quotients)(a, b) == quotients(a, b)


def test_division_by_zero_gives_zero_for_integers_and_infinity_for_floats() -> None:
    assert compiled("a, b : int", quotients)(3, 0) == (0, 0, math.inf)


def arithmetic(x: float, y: float, n: int, flag: bool) -> tuple[float, ...]:
    a = x * y - x / y + abs(y)
    b = -x if (flag and y > 0.0) or n == 3 else max(x, y, 0.5)
    c = math.sqrt(abs(x)) + math.exp(-y) + math.tanh(x) + math.log(2.0 + y * y)
    d = x**3 + y**2 - n**2 + float(n // 2)
    e = (1.0 if not flag else 0.0) + min(x, y) + (x <= y) * 1.0
    return a, b, c, d, e, x if 0.0 < x <= 2.0 else y


@pytest.mark.parametrize("given", [(0.3, -1.7, 3, True), (-2.5, 0.25, 4, False), (2.0, 2.0, -3, True)])
def test_arithmetic_is_the_same_compiled_and_in_python(given: tuple[Any, ...]) -> None:
    assert compiled("x, y : float\nn : int\nflag : bool", arithmetic)(*given) == pytest.approx(
        arithmetic(*given), rel=4e-16
    )


def loops(values: Array, most: int) -> tuple[float, int, int]:
    total, count, i = 0.0, 0, 0
    for k in range(values.size - 1, -1, -1):
        if values[k] != values[k]:
            continue
        total += values[k]
        count += 1
        if count == most:
            break
    while i < values.size and not (values[i] > 1.0):
        i += 1
    for value in values:
        if value < 0.0:
            total -= value
    return total, count, i


def test_break_continue_and_while_loops_run_as_in_python() -> None:
    values = np.array([0.5, np.nan, 0.25, 3.0, -1.0, 0.125])
    for most in (2, 100):
        assert compiled("values : ndarray, shape (n,)\nmost : int", loops)(values, most) == loops(values, most)


def widened(n: int) -> float:
    total = 0
    for k in range(n):
        if k == 2:
            total = 0.5 * total
        total += k
    return total


def test_a_variable_that_later_becomes_a_float_is_a_float_throughout() -> None:
    assert compiled("n : int", widened)(5) == widened(5)


def swapped(a: Array, steps: int) -> tuple[Array, Array, bool]:
    new, old = a.copy(), np.zeros(a.size)
    for _ in range(steps):
        old[:] = new
        new, old = old, new
        new += 1.0
        row = new[1:] - 0.5 * old[:-1]
        new[1:] = row
    return new, old, steps > 1


def test_swapped_arrays_are_returned_as_in_python() -> None:
    a = np.array([1.0, 2.0, 4.0])
    for steps in (0, 1, 4):
        found, wanted = compiled("a : ndarray, shape (n,)\nsteps : int", swapped)(a, steps), swapped(a, steps)
        np.testing.assert_array_equal(found[0], wanted[0])
        np.testing.assert_array_equal(found[1], wanted[1])
        assert found[2] is wanted[2]
    assert a.tolist() == [1.0, 2.0, 4.0]


def turned(a: Array, b: Array) -> float:
    total = 0.0
    for i in range(b.shape[0]):
        for j in range(b.shape[1]):
            total += (i + 2 * j) * a[i, j] * b[i, j]
    return total


def views(cube: Array, k: int) -> tuple[float, Array]:
    part = slice(1, 3)
    plane = cube[k]
    plane[0, part] = 7.0
    cube[0, 1] *= 2.0
    return turned(plane.T, cube[:, :, 1][:, 0:2].T), np.sqrt(plane[-1]) + plane[0, 1:].size


def test_views_read_and_write_their_array_as_in_python() -> None:
    cube = np.arange(24.0).reshape(2, 4, 3)[:, :3].copy()
    mine, theirs = cube.copy(), cube.copy()
    found = compiled("cube : ndarray, shape (a, b, c)\nk : int", turned, views)(mine, 1)
    wanted = views(theirs, 1)
    np.testing.assert_array_equal(mine, theirs)
    assert found[0] == wanted[0]
    np.testing.assert_array_equal(found[1], wanted[1])


def turning(z: NDArray[np.complex128], w: float) -> tuple[complex, float]:
    total = 0.0 + 0.0j
    for k in range(z.size):
        total += z[k] * np.exp(-1j * w * k) * np.conj(z[k] / 2.0) - 0.5
    return total, total.real * total.imag


def test_complex_numbers_are_the_same_compiled_and_in_python() -> None:
    z = np.exp(1j * np.arange(5.0)) * np.arange(1.0, 6.0)
    found, wanted = compiled("z : ndarray of complex, shape (n,)\nw : float", turning)(z, 0.3), turning(z, 0.3)
    assert found == pytest.approx(wanted, rel=1e-14)


def kept(flags: NDArray[np.bool_], counts: NDArray[np.int64]) -> int:
    total = 0
    for k in range(flags.size):
        if flags[k] and counts[k] > 1:
            total += counts[k]
            flags[k] = False
    return total


def test_arrays_of_booleans_and_of_integers_are_read_and_written() -> None:
    flags, counts = np.array([True, False, True, True]), np.array([1, 2, 3, 4])
    takes = "flags : ndarray of bool, shape (n,)\ncounts : ndarray of int, shape (n,)"
    assert compiled(takes, kept)(flags, counts) == 7
    assert flags.tolist() == [True, False, False, False]


def item(values: tuple[float, ...], k: int) -> float:
    return values[k] + values[-1]


def counted(n: int, x: float) -> float:
    total, spread = 0.0, (x, 2.0 * x, 1.0)
    for k in range(n):
        total += item((*spread, float(k)), k) * len(spread)
    return total


def test_tuples_are_unpacked_and_indexed_as_in_python() -> None:
    assert compiled("n : int\nx : float", item, counted)(4, 0.7) == counted(4, 0.7)


def unknown(x: float) -> float:
    y = x
    with open("x") as file:  # noqa: PTH123  never run
        y += len(file.read())
    return y


def twofold(x: float) -> float:
    y = 0.5
    if x > 0.0:
        y = x > 1.0
    return 1.0 if y else 0.0


@pytest.mark.parametrize(
    ("function", "told"),
    [
        (unknown, r"kernel unknown: unknown, line 3: with open\('x'\) as file:: With is not compiled"),
        (twofold, "two names"),
    ],
)
def test_code_that_cannot_be_compiled_is_refused_with_its_line(function: Callable[..., Any], told: str) -> None:
    with pytest.raises(KernelError, match=told):
        compiled("x : float", function)
