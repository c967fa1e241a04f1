"""Statements are compiled to what Python does; one that has no meaning in a kernel is refused with its line."""

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

TAKES = "x : float\nn : int\nflag : bool\nvalues : ndarray, shape (k,)"
GIVEN = (0.75, 3, True, np.array([0.5, -2.0, 3.0, 8.0]))


def compiled(takes: str, *functions: Callable[..., Any], above: str = "") -> Callable[..., Any]:
    name = functions[-1].__name__
    return getattr(load_native(name, above + functions_text(*functions), {name: signature(takes)}), name)


def kernel(body: str, above: str = "", takes: str = TAKES) -> Callable[..., Any]:
    text = f"import numpy as np\n\n{above}\n\ndef asked(x, n, flag, values):\n    {body}\n"
    return load_native("asked", text, {"asked": signature(takes)}).asked


def either(x: float, n: int, flag: bool, values: Array) -> tuple[float, float, float, float]:
    if flag:
        part, pair, number = values, (x, n), n
    else:
        part, pair, number = values[1:][:2], (n, x), x
    return part[0], pair[0], pair[1], number


@pytest.mark.parametrize("flag", [True, False])
def test_variables_assigned_in_both_branches_get_one_kind(flag: bool) -> None:
    x, n, _, values = GIVEN
    assert compiled(TAKES, either)(x, n, flag, values) == either(x, n, flag, values)


@pytest.mark.parametrize(("x", "n", "wanted"), [(2.0, 0, 2.0), (0.5, 3, 3.0), (0.5, 1, -1.0)])
def test_an_if_whose_branches_all_return_ends_the_function(x: float, n: int, wanted: float) -> None:
    inner = "if n > 2:\n            return float(n)\n            x = 5.0\n        else:\n            return -1.0"
    body = f"if x > 1.0:\n        return x\n    else:\n        {inner}\n    return 7.0"
    assert kernel(body)(x, n, True, GIVEN[3]) == wanted


def stepped(n: int, by: int, values: Array) -> float:
    total: float
    total = 0.0
    "a text on its own has no effect"
    for k in range(0, n, by):
        total += values[k]
    return total + values[-2:][0]


@pytest.mark.parametrize("by", [1, 2, 3])
def test_a_range_may_take_its_step_from_a_variable(by: int) -> None:
    assert compiled("n, by : int\nvalues : ndarray, shape (k,)", stepped)(4, by, GIVEN[3]) == stepped(4, by, GIVEN[3])


def filled(z: NDArray[np.complex128], x: float) -> complex:
    z[0] = x + 2j
    z[1] = x
    return z.T[0] * z[1]


def test_elements_of_complex_arrays_are_set() -> None:
    z = np.zeros(2, np.complex128)
    assert compiled("z : ndarray of complex, shape (n,)\nx : float", filled)(z, 3.0) == (3.0 + 2j) * 3.0
    assert z.tolist() == [3.0 + 2j, 3.0 + 0j]


def doubled(values: Array) -> Array:
    return 2.0 * values


def lent(values: Array) -> float:
    twice = doubled(values)
    return twice[0] + doubled(twice)[1]


def test_an_array_returned_by_a_function_stays_valid_in_its_caller() -> None:
    assert compiled("values : ndarray, shape (n,)", doubled, lent)(GIVEN[3]) == lent(GIVEN[3])


def twice(pair: tuple[float, float], k: int) -> float:
    return pair[k] + 10.0 * pair[1 - k]


def of_two(x: float, n: int) -> float:
    return twice((x, 2.0), n) - twice((2.0, x), n)


def test_a_tuple_may_be_indexed_more_than_once_by_a_variable() -> None:
    assert compiled("x : float\nn : int", twice, of_two)(0.5, 1) == of_two(0.5, 1)


def test_a_constant_may_be_a_tuple_of_numbers() -> None:
    assert kernel("return PAIR[1] + PAIR[0] * x", above="PAIR = (2.0, 3)")(*GIVEN) == 4.5


REFUSED = {
    "a, b = x\n    return a": "a tuple is wanted, got float",
    "values.size = 3\n    return x": r"an assignment to values\.size is not compiled",
    "values.size += 3\n    return x": r"an assignment to values\.size is not compiled",
    "return values[x]": "an index is a whole number or a slice, got float",
    "return values[x + 2j][0]": "an index is a whole number or a slice, got complex",
    "return np.zeros((n, x))[0, 0]": "a whole number is wanted, got float",
    "if flag:\n        y = x\n    else:\n        y = (x, x)\n    return y": "two names",
    "if flag:\n        y = values\n    else:\n        y = x\n    return y": "two names",
    "return other(x, n)": "other takes 1 arguments, got 2",
    "return other()": "other takes 1 arguments, got 0",
    "return made": "made",
    "return np.zeros((2, 3)).T": "asked returns a view that is not packed",
}


@pytest.mark.parametrize("body", REFUSED)
def test_an_invalid_statement_is_refused_with_a_message(body: str) -> None:
    with pytest.raises(KernelError, match=REFUSED[body]):
        kernel(body, above="made = somehow(1)\n\n\ndef other(y):\n    return y")


def test_an_unknown_decorator_is_refused() -> None:
    with pytest.raises(KernelError, match="the decorator cached means nothing here"):
        kernel("return other(x)", above="@cached\ndef other(y):\n    return y")


def test_variables_whose_kinds_do_not_settle_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    body = "y = 0\n    for k in range(n):\n        y += x\n    return y"
    assert kernel(body)(*GIVEN) == 2.25
    monkeypatch.setattr("plant.compiled.native.program.MOST_PASSES", 1)
    with pytest.raises(KernelError, match="the kinds of its variables are not settled"):
        kernel(body + " + 0.0")


def test_a_length_stated_in_the_signature_is_required() -> None:
    total = kernel("return values[0] + values[2]", takes=TAKES.replace("(k,)", "(3,)"))
    with pytest.raises(ValueError, match="axis 0 of values must have length 3, got 4"):
        total(*GIVEN)
    assert math.isclose(total(*GIVEN[:3], GIVEN[3][:3]), 3.5)
