import inspect
import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from plant.arrays import Array
from plant.compiled.c99.loops import ExternalFunction, Translation
from plant.compiled.c99.precision import DOUBLE
from plant.compiled.c99.shapes import Block, Scalar, Thing
from tests.c_compiler import compiled, ran


def spread(values: Array) -> tuple[float, float]:
    """Return the mean of the values and the largest distance from it."""
    total = farthest = 0.0
    for value in values:
        total += value
    total /= values.shape[0]
    for i in range(values.shape[0]):
        away = values[i] - total if values[i] > total else total - values[i]
        if away > farthest and math.isfinite(away):
            farthest = away
    return total, farthest


def work(table: Array, room: tuple[Array, Array], *, SHIFT: int) -> float:
    """Fill both arrays of ``room`` from a table."""
    first, second = room
    second[:] = 0.0
    rows = table.shape[0]
    for i in range(rows):
        mean, most = spread(table[i])
        first[i] = mean
        for j in range(i, rows):
            second[j] += SHIFT * most**2
        doubled(table[i], first)
    first[0] = first[1] = np.nan if first[0] == first[0] else 0.0
    return math.sqrt(second[rows - 1]) - math.exp(-np.inf)


def doubled(row: Array, first: Array) -> None:
    """Mark a negative row, and overwrite any other row with ``first``."""
    if row[0] < 0.0 or not row[1] > 0.0:
        first[2] = -1.0
    else:
        row[:] = first


GIVEN: list[Thing] = [Block("table", (3, 3), "table"), (Block("first", (3,), "first"), Block("second", (3,), "second"))]


def translation() -> Translation:
    functions = {one.__name__: one for one in (spread, work, doubled)}
    return Translation(functions, {"SHIFT": 2}, {}, DOUBLE, "mine")


MAIN = """
int main(void)
{
    double table[9] = { 0.5, 1.5, 4.0, 2.0, -3.0, 1.0, 8.0, 0.25, 0.125 };
    double first[3] = { 0, 0, 0 };
    double second[3];
    printf("%.17g\\n", mine_work(table, first, second));
    for (int i = 0; i < 9; ++i) {
        printf("%.17g\\n", table[i]);
    }
    for (int i = 0; i < 3; ++i) {
        printf("%.17g\\n%.17g\\n", first[i], second[i]);
    }
    return 0;
}
"""


@pytest.mark.parametrize("using", ["gcc", "clang"])
def test_a_loop_gives_the_same_numbers_in_c_as_in_python(tmp_path: Path, using: str) -> None:
    written = translation()
    written.translate("work", GIVEN)
    text = f"#include <math.h>\n#include <stdio.h>\n{written.text}\n{MAIN}"
    out, _ = ran(compiled(tmp_path, {"loops.c": text}, using=using), [""])
    table = np.array([[0.5, 1.5, 4.0], [2.0, -3.0, 1.0], [8.0, 0.25, 0.125]])
    first, second = np.zeros(3), np.empty(3)
    result = work(table, (first, second), SHIFT=2)
    wanted = [result, *table.ravel(), *np.column_stack([first, second]).ravel()]
    np.testing.assert_array_equal([float(one) for one in out.split()], wanted)


def test_an_array_that_is_only_read_is_const() -> None:
    found = translation().translate("spread", [Block("values", (4,), "values")])
    assert "const double *values" in found.text
    assert found.written == (False,)
    assert found.results == (False, False)


def test_the_largest_operation_count_includes_all_loops_and_called_functions() -> None:
    counted = translation().translate("spread", [Block("values", (4,), "values")]).operations
    assert counted == Counter({"additions": 4 + 8, "divisions": 1, "choices and comparisons": 8})
    assert translation().translate("work", GIVEN).operations["square roots"] == 1


def test_a_function_already_written_in_c_is_called_by_its_c_name() -> None:
    outside = {"doubled": ExternalFunction("theirs", (True, False), Counter({"products": 5}))}
    written = Translation({"spread": spread, "work": work}, {"SHIFT": 2}, outside, DOUBLE, "mine")
    assert written.translate("work", GIVEN).operations["products"] >= 15
    assert "theirs(" in written.text


def endless(values: Array) -> float:
    """Loop a number of times that is not known in advance."""
    while values[0] > 0.0:
        values[0] -= 1.0
    return values[0]


def swapped(a: float, b: float) -> float:
    """Swap two numbers."""
    c = a
    d = b
    c, d = d, c
    return c - d


def test_a_while_loop_and_a_swap_of_two_numbers_are_refused() -> None:
    functions = {one.__name__: one for one in (endless, swapped)}
    written = Translation(functions, {}, {}, DOUBLE, "mine")
    with pytest.raises(NotImplementedError, match="while"):
        written.translate("endless", [Block("values", (2,), "values")])
    with pytest.raises(NotImplementedError, match="none of what is translated"):
        written.translate("swapped", [Scalar("a"), Scalar("b")])


def of_other_shape(values: Array, table: Array) -> None:
    values[:] = table


def of_a_number(values: Array, scale: float) -> None:
    values[:] = scale
    scale[:] = values  # type: ignore[index]


def true_or_not(values: Array) -> None:
    values[0] = True


def whole_division(values: Array) -> None:
    values[0] = 3 / 2


def unknown_function(values: Array) -> None:
    values[0] = max(values)


def method(values: Array, table: Array) -> None:
    values[0] = table.sum()


def over_a_number(values: Array, scale: float) -> None:
    for one in scale:  # type: ignore[attr-defined]
        values[0] = one


def over_rows(values: Array, table: Array) -> None:
    for row in table:
        values[0] = row


def array_in_a_sum(values: Array, table: Array) -> None:
    values[0] = table + 1.0  # type: ignore[call-overload]


def array_as_result(table: Array) -> Array:
    return table


def as_far_as_a_number(values: Array, scale: float) -> None:
    for i in range(scale):  # type: ignore[arg-type]
        values[i] = 0.0


def number_with_places(values: Array, scale: float) -> None:
    values[0] = scale[0]  # type: ignore[index]


def two_of_a_number(values: Array, scale: float) -> None:
    a, b = scale  # type: ignore[misc]
    values[0] = a + b


def a_pair_of_unlike(values: Array, table: Array, scale: float) -> None:
    a, b = scale, table
    values[0] = a + b


def deleted(scale: float) -> None:
    del scale


UNTRANSLATED = (
    of_other_shape,
    of_a_number,
    true_or_not,
    whole_division,
    unknown_function,
    method,
    over_a_number,
    over_rows,
    array_in_a_sum,
    array_as_result,
    as_far_as_a_number,
    number_with_places,
    two_of_a_number,
    a_pair_of_unlike,
    deleted,
)


@pytest.mark.parametrize("function", UNTRANSLATED, ids=lambda one: one.__name__)
def test_code_outside_the_translated_subset_is_refused(function: Callable[..., object]) -> None:
    written = Translation({"f": function}, {}, {}, DOUBLE, "mine")
    known: dict[str, Thing] = {
        "values": Block("values", (4,), "values"),
        "table": Block("table", (2, 3), "table"),
        "scale": Scalar("scale"),
    }
    with pytest.raises(NotImplementedError, match="none of what is translated to C"):
        written.translate("f", [known[name] for name in inspect.signature(function).parameters])


def scaled(values: Array, scale: float) -> float:
    """Write a number times pi, unless it is NaN."""
    if scale == scale:
        values[0] = math.pi * scale
    return float(values.shape[0])


def test_pi_an_array_length_and_a_test_for_nan_are_translated() -> None:
    written = Translation({"scaled": scaled}, {}, {}, DOUBLE, "mine")
    text = written.translate("scaled", [Block("values", (4,), "values"), Scalar("scale")]).text
    assert "!isnan(scale)" in text
    assert "3.141592653589793" in text
    assert "((double)4)" in text
    assert written.translate("scaled", [Block("other", (4,), "other"), Scalar("by")]).text == text
