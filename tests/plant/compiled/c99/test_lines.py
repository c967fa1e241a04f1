import re
from pathlib import Path

import numpy as np
import pytest

from plant.compiled.c99.files import checked_name
from plant.compiled.c99.lines import KINDS, c_lines, operations_of
from plant.compiled.c99.precision import DOUBLE, FLOAT, precision_of
from plant.compiled.expression import Expression, node, symbol, unary
from plant.compiled.functions import arctan, cos, exp, log, maximum, sign, sin, sqrt, tanh, where
from plant.errors import HydrostateError
from tests.c_compiler import compiled, ran

X, Y = symbol("x"), symbol("y")
EVERY: dict[str, Expression] = {
    "sum": X + Y,
    "difference": X - Y,
    "product": X * Y,
    "quotient": X / Y,
    "fused": node("fma", X, Y, X),
    "less_product": node("fnma", X, Y, X),
    "product_less": node("fms", X, Y, X),
    "larger": maximum(X, Y),
    "least": where(X <= Y, X, -Y),
    "not_less": where(X >= Y, X, 3.0),
    "sign": sign(X),
    "size": abs(X),
    "root": sqrt(Y),
    "power": exp(X),
    "logarithm": log(Y),
    "bend": tanh(X),
    "up": sin(X),
    "along": cos(X),
    "angle": arctan(X),
    "there": where(unary("present", X), X, Y),
}


def values(x: float, y: float) -> list[float]:
    a, b = np.float64(x), np.float64(y)
    return [
        *(a + b, a - b, a * b, a / b, a * b + a, a - a * b, a * b - a, max(a, b), a if a <= b else -b),
        *(a if a >= b else 3.0, np.sign(a), abs(a), np.sqrt(b), np.exp(a), np.log(b), np.tanh(a)),
        *(np.sin(a), np.cos(a), np.arctan(a), a),
    ]


@pytest.mark.parametrize("using", ["gcc", "clang"])
def test_every_operation_of_a_graph_is_the_same_in_c(tmp_path: Path, using: str) -> None:
    places = {name: f"out[{i}]" for i, name in enumerate(EVERY)}
    lines = c_lines(EVERY, {"x": "0.7", "y": "1.3"}, places, DOUBLE)
    heads = "#include <math.h>\n#include <stdio.h>\n#define FUSED(a, b, c) ((a) * (b) + (c))\nint main(void) {"
    show = f'for (int i = 0; i < {len(EVERY)}; ++i) {{ printf("%.17g\\n", out[i]); }}'
    text = "\n".join([heads, f"double out[{len(EVERY)}];", *lines, show, "return 0;", "}\n"])
    out, _ = ran(compiled(tmp_path, {"lines.c": text}, using=using), [""])
    np.testing.assert_allclose([float(one) for one in out.split()], values(0.7, 1.3), rtol=1e-15)


def test_each_line_is_one_operation_so_that_no_compiler_fuses_two() -> None:
    lines = c_lines({"z": X * Y + X / Y}, {"x": "x", "y": "y"}, {"z": "z"}, DOUBLE)
    assert lines == ["const double t0 = x * y;", "const double t1 = x / y;", "const double t2 = t0 + t1;", "z = t2;"]


def test_all_inputs_are_read_before_any_output_is_written() -> None:
    lines = c_lines({"a": Y + 0.0, "b": X + 1.0}, {"x": "s[0]", "y": "s[1]"}, {"a": "s[0]", "b": "s[1]"}, DOUBLE)
    assert max(i for i, line in enumerate(lines) if "= s[" in line) < min(
        i for i, line in enumerate(lines) if line.startswith("s[")
    )


def test_operations_are_counted_by_kind() -> None:
    counted = operations_of(EVERY)
    assert counted["fused products"] == 3
    assert counted["divisions"] == 1
    assert counted["calls of exp, log, tanh"] == 6
    assert set(counted) == set(KINDS.values())


@pytest.mark.parametrize("value", [0.1, 1.0, -2.5e-300, 1e22, 5e-324, 123456789.0, float("inf"), -float("inf")])
def test_a_literal_in_c_has_exactly_the_value_of_its_number(value: float) -> None:
    spelt = DOUBLE.literal(value)
    assert float(spelt.replace("INFINITY", "inf")) == value
    assert re.search(r"[.eI]", spelt)
    short = FLOAT.literal(np.clip(value, -1e30, 1e30))
    assert short.endswith("F")
    assert np.float32(short[:-1]) == np.float32(np.clip(value, -1e30, 1e30))


def test_an_invalid_name_in_c_is_refused() -> None:
    for name in ("2fast", "while", "Upper", "a-b", "", "a" * 32):
        with pytest.raises(HydrostateError, match="name in C"):
            checked_name(name)


def test_an_unknown_precision_is_refused() -> None:
    with pytest.raises(HydrostateError, match="precision must be one of double, float, got 'half'"):
        precision_of("half")
