"""Lines compiled to instructions give the same bits as in Python, for one number and for several at a time."""

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from plant.compiled.native.kinds import KernelError
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature
from plant.compiled.paste import functions_text, kernel_text
from tests.kernels import OPERATIONS, in_python, stepped

exp, fma, log, present, sign, sqrt, tanh, where = (
    OPERATIONS[name] for name in ("exp", "fma", "log", "present", "sign", "sqrt", "tanh", "where")
)

X = np.array([0.7, -1.3, 0.0, 2.5e-8, -4e3, 1.0, 12.0, -0.1])
Y = np.array([-0.2, 0.4, 1.0, 3.0, 1e-3, 1.0, -12.0, 5e5])


def plain(x: Any, y: Any) -> Mapping[str, Any]:
    smooth = exp(-abs(x) / 7.0) + tanh(y - 0.5) * 2.0 - log(1.0 + y * y)
    chosen = where(x <= y, where(y > 1.0, 3.0, x), where(x >= 4.0, y, sign(x) - sign(0.1 - y)))
    return {"a": smooth, "b": chosen, "c": sqrt(x * x + 1.0), "d": 0.25, "e": where(x < 0.0, 1.0, 0.0)}


def fused(x: Any, y: Any) -> Mapping[str, Any]:
    return {"a": fma(x, y, 0.1), "b": fma(-x, 3.0, y), "c": where(present(0.0 / x), 1.0, 2.0)}


def of(lines: Callable[..., Mapping[str, Any]], width: int) -> dict[str, list[float]]:
    """Return what the lines compute from `X` and `Y`, with ``width`` numbers at a time."""
    found = stepped(functions_text(lines), lines.__name__, {"x": X, "y": Y}, "abcde", width)
    return {name: values.tolist() for name, values in found.items()}


@pytest.mark.parametrize("width", [1, 2, 8])
def test_lines_compute_what_python_does(width: int) -> None:
    wanted = [in_python(plain)(x, y) for x, y in zip(X.tolist(), Y.tolist(), strict=True)]
    assert of(plain, width) == {name: [one[name] for one in wanted] for name in "abcde"}


@pytest.mark.parametrize("width", [1, 8])
def test_a_fused_product_is_rounded_once_and_nan_is_detected(width: int) -> None:
    pairs = [(Fraction(x), Fraction(y)) for x, y in zip(X.tolist(), Y.tolist(), strict=True)]
    found = of(fused, width)
    assert found["a"] == [float(x * y + Fraction(0.1)) for x, y in pairs]
    assert found["b"] == [float(y - 3 * x) for x, y in pairs]
    assert found["c"] == [1.0 if x else 2.0 for x, _ in pairs]


@pytest.mark.parametrize("width", [1, 2, 8])
def test_the_sign_of_nan_and_of_either_zero_is_positive_zero(width: int) -> None:
    numbers = np.array([np.nan, -0.0, 0.0, np.inf, -np.inf, 5e-324, -5e-324, -2.0])
    found = stepped("def lines(x):\n    return {'a': 1.0 / sign(x)}", "lines", {"x": numbers}, "a", width)
    assert found["a"].tolist() == [np.inf, np.inf, np.inf, 1.0, -1.0, 1.0, -1.0, -1.0]  # sign gives a positive zero


def both(x: float, y: float, *, of_both: Callable[[tuple[float, float]], tuple[float, ...]]) -> tuple[float, ...]:
    return of_both((x, y))


def test_function_of_returns_the_outputs_of_lines_as_a_tuple() -> None:
    text = kernel_text(
        "lines of two numbers", functions_text(plain), "of_both = function_of(plain, 5)", functions_text(both)
    )
    kernel = load_native("lines_of_two", text, {"both": signature("x, y : float")})
    assert kernel.both(0.7, -0.2) == tuple(in_python(plain)(0.7, -0.2).values())


def wild(x: Any) -> Mapping[str, Any]:
    return {"a": OPERATIONS["sin"](x)}


def test_an_operation_that_cannot_be_compiled_is_refused() -> None:
    with pytest.raises(KernelError, match="is none of the operations that are compiled"):
        stepped(functions_text(wild), "wild", {"x": X}, "a", 1)


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("y = x + 1.0", "lines returns nothing"),
        ("while x > 0.0:\n        x = x - 1.0", "is none of the lines that are compiled"),
        ("y, z = ratios(x, x)\n    return {'a': y}", "a tuple is wanted, got x"),
        ("return {'a': gamma(x)}", "gamma is none of the operations that are compiled"),
    ],
)
def test_unsupported_statements_in_lines_are_refused_with_a_message(body: str, told: str) -> None:
    with pytest.raises(KernelError, match=told):
        stepped(f"def lines(x):\n    {body}", "lines", {"x": X}, "a", 1)


@pytest.mark.parametrize("width", [1, 8])
def test_an_output_without_a_slot_is_not_stored(width: int) -> None:
    found = stepped("def lines(x):\n    return {'a': x + 1.0, 'other': 2.0 * x}", "lines", {"x": X}, "a", width)
    assert found.keys() == {"a"}
    assert found["a"].tolist() == (X + 1.0).tolist()


def sums(values: Any, others: Any, found: Any) -> None:
    add(values.ctypes.data, 0.0, others.ctypes.data, found.ctypes.data)  # type: ignore[name-defined]  # noqa: F821


@pytest.mark.parametrize("width", [1, 2, 8])
def test_lines_read_and_write_numbers_at_several_addresses(width: int) -> None:
    slots = {"a": 8, "b": (0, 16), "c": (1, 8)}
    step = f"SLOTS = {slots}\n\nadd = stepping(SLOTS, {width}, lines)"
    lines = "def lines(a, b):\n    return {'c': a - b}"
    takes = {"sums": signature("values, others, found : ndarray, shape (24,)")}
    kernel = load_native("sums", kernel_text("sums", lines, step, functions_text(sums)), takes)
    values, others, found = np.arange(24.0), np.arange(24.0) ** 2, np.zeros(24)
    kernel.sums(values, others, found)
    wanted = np.zeros(24)
    wanted[8 : 8 + width] = values[8 : 8 + width] - others[16 : 16 + width]
    assert found.tolist() == wanted.tolist()


def whole(values: Any) -> bool:
    return there(values.ctypes.data)  # type: ignore[name-defined, no-any-return]  # noqa: F821


@pytest.mark.parametrize("width", [1, 2, 8])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_complete_detects_a_single_nan_at_any_place(width: int, count: int) -> None:
    text = kernel_text("whole", f"there = complete({width}, {count}, 80)", functions_text(whole))
    kernel = load_native("whole", text, {"whole": signature("values : ndarray, shape (30,)")})
    values = np.full(30, np.inf)
    assert kernel.whole(values)
    for place in range(30):
        one = values.copy()
        one[place] = np.nan
        vector, number = divmod(place, 10)
        assert kernel.whole(one) == (number >= width or vector >= count)


def turned(places: Any, offset: int, rows: Any) -> None:
    transpose(places.ctypes.data, offset, 64, rows.ctypes.data, 64)  # type: ignore[name-defined]  # noqa: F821


def test_transpose_copies_eight_samples_of_eight_logs_into_rows() -> None:
    logs = np.arange(8.0 * 24).reshape(8, 24)
    places = logs.ctypes.data + logs.strides[0] * np.arange(8)
    rows = np.zeros((8, 8))
    takes = {"turned": signature("places : ndarray of int, shape (8,)\noffset : int\nrows : ndarray, shape (8, 8)")}
    load_native("turned", kernel_text("turned", functions_text(turned)), takes).turned(places, 8 * 8, rows)
    np.testing.assert_array_equal(rows, logs[:, 8:16].T)
