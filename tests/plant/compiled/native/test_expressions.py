"""Each expression on its own is compiled to what Python computes, or refused with a message."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from plant.compiled.native.kinds import KernelError
from plant.compiled.native.load import load_native
from plant.compiled.native.operators import _integer_division
from plant.compiled.native.signature import signature

TAKES = "x : float\nn : int\nflag : bool\nvalues : ndarray, shape (k,)\nwhole : ndarray of int, shape (k,)"
GIVEN = (-1.75, 6, True, np.array([0.5, -2.0, 3.0]), np.array([4, -7, 9]))


def kernel(body: str, name: str = "asked") -> Any:
    text = f"import math\n\nimport numpy as np\n\n\ndef {name}(x, n, flag, values, whole):\n    {body}\n"
    return getattr(load_native(name, text, {name: signature(TAKES)}), name)


COMPUTED = [
    "n & 3, n | 8, n ^ 5, flag & True, flag | False",
    "math.copysign(3.0, x), math.copysign(x, 2.0)",
    "abs(n - 9), abs(x), int(x), int(flag), +x, +n, -n",
    "n + flag, x * flag, flag * 2, 7 // 2, -7 // 2, -7 % 3",
    "n ** 0, n ** 3, x ** 3, abs(x) ** x, 2 ** x",
    "math.isfinite(x), math.isnan(x), not x, not n, 1.0 if n else 2.0",
    "(values + whole)[1], (whole * whole)[1], (whole / whole)[2], (-values)[0], (-whole)[2]",
    "np.abs(values)[1], np.abs(whole)[1], np.sqrt(np.abs(whole))[0], np.exp(values)[1]",
    "((x + 2j) * (n - 1j)).real, ((x + 2j) * (n - 1j)).imag, (2j * x).imag, (x * 2j).imag, ((x + 2j) / n).imag",
    "np.exp(1j * x).real, np.exp(1j * x).imag, np.conj(x + 2j).imag, np.conj(x), (1j - x).real, -(x + 2j).imag",
    "((x, n) + (2.0,))[2], ((x, 4.0, 2.0))[n - 5], (x, 3.0)[-1], len((x, n))",
    "values[-1], values[1:].size, values[:-1][1], values[n - 5], values.copy()[0], values.shape[0]",
    "np.ascontiguousarray(values)[1], np.zeros(3, dtype=np.int64)[1], np.zeros((2, 2)).T[0, 1]",
    "math.pi * x, np.inf, -np.inf, max(n, x), min(n, 2, x), max(n, 2)",
    "x < n <= 6 < 7, x != n, flag == True, n >= 6 and x < 0.0, n < 6 or flag or x > 0.0",
]


@pytest.mark.parametrize("expression", COMPUTED)
def test_an_expression_has_the_same_value_as_in_python(expression: str) -> None:
    names = dict(zip(("x", "n", "flag", "values", "whole"), GIVEN, strict=True))
    wanted = eval(expression, {"math": math, "np": np}, names)  # noqa: S307  our own text
    assert kernel(f"return {expression}")(*GIVEN) == pytest.approx(wanted, rel=1e-15)


def test_integer_division_by_a_constant_is_that_of_python_and_by_constant_zero_gives_zero() -> None:
    assert kernel("return n // 4, n % 4, -n // 4, -n % 4, n // -4, n % -4", "known")(*GIVEN) == (1, 2, -2, 2, -2, -2)
    assert kernel("return n // 0, n % 0, 7 // 0, 7 % 0", "nothing")(*GIVEN) == (0, 0, 0, 0)


@pytest.mark.parametrize(("divisor", "guarded"), [("0", True), ("%k", True), ("4", False), ("-4", False)])
def test_integer_division_is_guarded_against_zero_unless_the_divisor_is_a_nonzero_constant(
    divisor: str, guarded: bool
) -> None:
    lines: list[str] = []

    def op(text: str) -> str:
        lines.append(text)
        return f"%{len(lines)}"

    for rest in (False, True):
        lines.clear()
        _integer_division(SimpleNamespace(op=op), "%n", divisor, rest=rest)  # type: ignore[arg-type]
        (asked,) = [line for line in lines if line.startswith("sdiv")]
        assert (asked == f"sdiv i64 %n, {divisor}") is not guarded
        assert (f"icmp eq i64 {divisor}, 0" in lines) is guarded


REFUSED = {
    "return [a for a in values]": "ListComp is not compiled",
    "return ~n": "Invert is not compiled",
    "return values[::2][0]": "a slice with a step",
    "return np.euler_gamma * x": "euler_gamma is no number",
    "return values.ndim": "ndim of .* is not compiled",
    "return math.sqrt(x=x)": "by place",
    "return math.gamma(x)": "math.gamma is not compiled",
    "return values.mean()": "mean of .* is not compiled",
    "return np.zeros(3, dtype=str)[0]": "arrays of str are not compiled",
    "return (x / (x + 2j)).real": "Div of .* and .* is not compiled",
    "return np.sqrt(x + 2j).real": "sqrt of a complex number",
    "return x & n": "BitAnd of float and int",
    "return x << n": "not compiled",
    "return x // 2.0": "FloorDiv of float and float",
    "return values[0, 1]": "kernel asked",
    "return nowhere": "nowhere",
    "a, b = x, n, 2\n    return a": "kernel asked",
    "while n > 3:\n        n -= 1\n    else:\n        x = 0.0\n    return x": "else of a loop",
    "for k in values:\n        x += k\n    else:\n        x = 0.0\n    return x": "else of a loop",
    "return elsewhere(x)": "elsewhere",
    "return (x, n).size": "kernel asked",
    'return "text"': "kernel asked",
    "return int(values)": "kernel asked",
    "values[0] = x + 2j\n    return x": "kernel asked",
    "lambda: x\n    return x": "kernel asked",
}


@pytest.mark.parametrize("body", REFUSED)
def test_an_unsupported_expression_is_refused_with_a_message(body: str) -> None:
    with pytest.raises(KernelError, match=REFUSED[body]):
        kernel(body)
