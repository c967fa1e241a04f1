"""If one side of a choice takes much work, it is computed only if it is chosen, and gives the same bits."""

import re
from pathlib import Path

import pytest

from plant.compiled.c99.branches import FEWEST_OPERATIONS, blocks_of
from plant.compiled.c99.lines import c_lines
from plant.compiled.c99.precision import DOUBLE
from plant.compiled.expression import Expression, ordered, select, symbol, unary
from plant.compiled.functions import sqrt, where
from tests.c_compiler import compiled, ran
from tests.kernels import computed

X, Y = symbol("x"), symbol("y")


def much(x: Expression) -> Expression:
    """Return an expression of eleven operations."""
    return sqrt(((x * 3.0 + 1.0) * x + 2.0) * x * x + 7.0) / (x * x + 5.0)


SHARED = Y * 0.25
POSITIVE = X > 0.0
CHOSEN: dict[str, Expression] = {
    "a": where(POSITIVE, much(SHARED + X), SHARED) + 1.0,
    "b": where(POSITIVE, much(SHARED + X) + X, Y),
    "c": where(POSITIVE, X, much(X - Y)) * 2.0,
    "d": SHARED,
}


def found(outputs: dict[str, Expression]) -> int:
    return len({id(block) for block in blocks_of(ordered(outputs.values()), list(outputs.values())).values()})


@pytest.mark.parametrize("using", ["gcc", "clang"])
def test_both_sides_of_a_choice_compute_the_same_in_c_as_in_python(tmp_path: Path, using: str) -> None:
    places = {name: f"out[{i}]" for i, name in enumerate(CHOSEN)}
    lines = c_lines(CHOSEN, {"x": "in[0]", "y": "in[1]"}, places, DOUBLE)
    assert sum(line.startswith("if (") for line in lines) == 1
    text = "\n".join(
        [
            "#include <math.h>\n#include <stdio.h>\nint main(void) {\ndouble in[2], out[4];",
            'while (scanf("%lf %lf", &in[0], &in[1]) == 2) {',
            *lines,
            'printf("%.17g %.17g %.17g %.17g\\n", out[0], out[1], out[2], out[3]); }\nreturn 0; }\n',
        ]
    )
    given = [(0.7, -1.3), (-0.4, 2.0), (0.0, 0.5)]
    out, _ = ran(compiled(tmp_path, {"lines.c": text}, using=using), [f"{x} {y}" for x, y in given])
    for line, (x, y) in zip(out.splitlines(), given, strict=True):
        wanted = computed(CHOSEN, x=x, y=y)
        assert dict(zip(CHOSEN, map(float, line.split()), strict=True)) == pytest.approx(wanted, rel=1e-15)


def test_operations_used_on_both_sides_or_elsewhere_are_computed_before_the_block() -> None:
    text = "\n".join(c_lines(CHOSEN, {"x": "x", "y": "y"}, {name: name for name in CHOSEN}, DOUBLE))
    before = text[: text.index("if (")]
    assert "y * 0.25" in before
    assert "sqrt" not in before


def test_a_choice_with_few_operations_stays_a_conditional_expression() -> None:
    little = {"a": where(POSITIVE, X * Y + 1.0, Y)}
    assert found(little) == 0
    assert not any(re.search(r"\bif\b", line) for line in c_lines(little, {"x": "x", "y": "y"}, {"a": "a"}, DOUBLE))
    grown = X
    for _ in range(FEWEST_OPERATIONS):
        grown = unary("abs", grown + 1.0)
    assert found({"a": where(POSITIVE, grown, Y)}) == 1


def test_operations_needed_in_every_case_are_in_no_block() -> None:
    work = much(X)
    assert found({"a": where(POSITIVE, work, Y), "b": work}) == 0


def test_a_choice_that_depends_on_another_of_the_same_condition_follows_its_block() -> None:
    first = where(POSITIVE, much(X), Y)
    second = select(POSITIVE, much(first * Y), X)
    lines = c_lines({"a": second}, {"x": "x", "y": "y"}, {"a": "a"}, DOUBLE)
    assert sum(line.startswith("if (") for line in lines) == 1
    assert lines.index("}") < next(i for i, line in enumerate(lines) if "?" in line)
