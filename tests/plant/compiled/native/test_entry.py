"""A kernel has one signature, and an error states what is wrong with an argument."""

import threading
import time
from typing import Any

import numpy as np
import pytest

from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature, signature_of

TEXT = """
def add(values, more, times, total):
    for k in range(values.shape[0]):
        for j in range(values.shape[1]):
            total[k, j] = values[k, j] + times * more[k]
    return total[0, 0]
"""
TAKES = """
values : ndarray, shape (n, m)
more : ndarray, shape (n,)
times : float
total : ndarray, shape (n, m)
"""


@pytest.fixture(scope="module")
def add() -> Any:
    return load_native("add", TEXT, {"add": signature(TAKES)}).add


VALUES, MORE = np.arange(6.0).reshape(3, 2), np.array([1.0, 2.0, 3.0])


def test_integers_and_single_precision_are_converted_to_floats(add: Any) -> None:
    total = np.empty((3, 2))
    assert add(VALUES.astype(np.float32), np.array([1, 2, 3]), 2, total) == 2.0
    np.testing.assert_array_equal(total, VALUES + 2.0 * MORE[:, None])


def test_strided_arrays_are_copied_and_results_written_back(add: Any) -> None:
    room = np.zeros((3, 4))
    add(np.asfortranarray(VALUES), np.repeat(MORE, 2)[::2], 1.0, room[:, 1:3])
    np.testing.assert_array_equal(room[:, 1:3], VALUES + MORE[:, None])
    assert not room[:, [0, 3]].any()


@pytest.mark.parametrize(
    ("given", "error", "told"),
    [
        ((VALUES, MORE, 1.0), TypeError, r"add\.add takes 4 arguments \(values, more, times, total\), got 3"),
        ((VALUES[0], MORE, 1.0, VALUES), TypeError, "values must be an array of float, 2-dimensional, got 1-dim"),
        ((VALUES, [1.0, 2.0, 3.0], 1.0, VALUES), TypeError, "more must be .* got list"),
        ((VALUES * 1j, MORE, 1.0, VALUES), TypeError, "values must be an array of float64, got one of complex128"),
        ((VALUES, MORE, "1", VALUES), TypeError, r"times must be a number \(float\), got '1'"),
        ((VALUES, MORE[:2], 1.0, VALUES + 0.0), ValueError, r"axis 0 of more must have length 3 \(n, as of values\)"),
        (
            (VALUES, MORE, 1.0, np.zeros((3, 2), np.int64)),
            TypeError,
            "total must be an array of float64, got one of int64",
        ),
        ((VALUES, MORE, 1.0, VALUES), ValueError, "total and values must not share memory"),
        ((VALUES, MORE, 1.0, np.broadcast_to(0.0, (3, 2))), TypeError, "total must be .* changed, got .* read-only"),
    ],
)
def test_an_argument_of_the_wrong_kind_or_shape_is_named_in_the_error(
    add: Any, given: tuple[Any, ...], error: type[Exception], told: str
) -> None:
    with pytest.raises(error, match=told):
        add(*given)


def test_a_repeated_call_on_the_same_arrays_sees_their_new_values() -> None:
    text = "def double(values, result):\n    for i in range(len(values)):\n        result[i] = 2.0 * values[i]\n"
    entry = load_native("doubling", text, {"double": signature("values, result : ndarray, shape (n,)")}).double
    values, result = np.array([1.0, 2.0]), np.empty(2)
    call = entry.prepared_call(values, result)
    for size in (1.0, 3.0):
        values[:] = size
        call()
        assert result.tolist() == [2.0 * size] * 2
    with pytest.raises(TypeError, match="takes arrays as they are and returns nothing"):
        entry.prepared_call(values[::-1], result)


def test_python_runs_on_while_a_kernel_runs() -> None:
    text = "def turn(n):\n    x = 0.5\n    for k in range(n):\n        x = 3.7 * x * (1.0 - x)\n    return x\n"
    turn = load_native("turn", text, {"turn": signature("n : int")}).turn
    begin = time.perf_counter()
    turn(10_000_000)
    count = int(1e7 * max(1.0, 0.2 / (time.perf_counter() - begin)))
    thread = threading.Thread(target=turn, args=(count,))
    thread.start()
    ticks = 0
    while thread.is_alive():
        time.sleep(0.001)
        ticks += 1
    assert ticks > 5


def test_a_signature_is_read_from_the_docstring() -> None:
    def scaled(
        kernel: object, rows: object, drive: object, near: object, far: object, step: float, states: object
    ) -> None:
        """Scale.

        Parameters
        ----------
        rows : ndarray of int, shape (1 or n, lanes)
            Rows.
        drive, states : ndarray, shape (n, width)
            Drive: with a colon.
        near, far : ndarray, shapes (n,) and (n, 4), or longer
            Two.
        step : float
            Step [s].

        Returns
        -------
        nothing : int
        """

    rows, drive, near, far, step, states = signature_of(scaled, width=3)
    assert (near.lengths, far.lengths) == (("n",), ("n", 4))
    assert rows.lengths == (None, "lanes")
    assert drive.lengths == states.lengths == ("n", 3)
    assert (rows.kind.name, step.kind.name) == ("array of int, 2-dimensional", "float")


def test_an_undocumented_parameter_is_refused() -> None:
    def bare(x: float, y: np.ndarray[Any, Any]) -> None:
        """Do.

        Parameters
        ----------
        x : float
        """

    with pytest.raises(ValueError, match=r"takes \['x', 'y'\], its documentation has \['x'\]"):
        signature_of(bare)


def test_slices_of_a_read_only_array_are_read_correctly() -> None:
    total = load_native("total_of_parts", TOTAL_OF_PARTS, {"total": signature("values : ndarray, shape (n,)")}).total
    values = np.arange(10.0)
    values.flags.writeable = False
    assert (total(values[3:]), total(values[::3]), total(values[:0])) == (42.0, 18.0, 0.0)


TOTAL_OF_PARTS = """
def total(values):
    result = 0.0
    for value in values:
        result += value
    return result
"""


@pytest.mark.parametrize(("moved", "turns"), [("c = b", 2), ("c = d\n        d = b", 3)])
def test_an_array_that_a_loop_writes_through_an_alias_counts_as_written(moved: str, turns: int) -> None:
    turn = f"        c[0] = 1.0 + k\n        {moved}\n"
    text = f"def fill(a, b, n):\n    c = a\n    d = a\n    for k in range(n):\n{turn}"
    fill = load_native("fill_by_turns", text, {"fill": signature("a, b : ndarray, shape (k,)\nn : int")}).fill
    a, b = np.zeros(1), np.zeros(1)
    fill(a, b, turns)
    assert (a[0], b[0]) == (turns - 1.0, turns)
    b.flags.writeable = False
    with pytest.raises(TypeError, match=r"b must be .* changed, got .* read-only"):
        fill(a, b, turns)
