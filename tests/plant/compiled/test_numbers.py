"""Texts and operation counts of compiled formulas and loops, kept in `numbers.json`.

Other tests check that a kernel computes what its formula states; this one checks with which operations.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any
from unittest.mock import MagicMock, patch

import pytest

from plant.compiled.c99.loops import Translation
from plant.compiled.c99.precision import DOUBLE, FLOAT
from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import Expression, jacobian, symbol
from plant.compiled.functions import absolute, log, maximum, sign, sqrt, tanh, where
from plant.compiled.gather import gather_factors
from plant.compiled.hints import affine_form, frozen, waypoint, with_derivatives
from plant.compiled.hoist import hoisted
from plant.compiled.late_last import late_last
from plant.compiled.native.program import Module
from plant.compiled.native.signature import signature
from plant.compiled.pack import packed_source
from plant.compiled.simplify import fused, share_ratios, share_reciprocals, simplified
from plant.compiled.source import lines_source, operations_source, symbols_in
from plant.eha.circuit import circuit_derivative
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.model import EhaParameters, lumped_step
from plant.solvers import adaptive_kernel, fixed_step_kernel
from plant.solvers.adaptive_kernel import compile_adaptive
from plant.solvers.fixed_step_kernel import compile_fixed_step
from plant.solvers.steps import parameter_symbols
from tests.numbers import Numbers
from tests.plant.compiled.c99.test_loops import GIVEN, doubled, spread, work
from tests.plant.compiled.native.test_entry import TAKES, TEXT

NUMBERS = Numbers(__file__)

X, Y, K, M = symbol("x"), symbol("y"), symbol("k"), symbol("m")
SHARED = K * X / 3.0
FORMULAS: dict[str, Expression] = {
    "sum": 2.0 * X + 0.5 * (K * Y) - (0.0 - X) + 4.0,
    "product": (0.1 * X) * (K * (Y / 7.0)) * 3.0,
    "choice": where(X > Y, 0.2 * X, 0.0 * Y) * where(Y >= X, 0.0 * X, 5.0 * Y),
    "shared": SHARED * SHARED + sqrt(absolute(-2.0 * SHARED)) * sign(-3.0 * Y),
    "twins": X * Y - Y * X + (X + Y) * (Y + X),
    "fixed": K + 2.0 * K - M / (K * M),
    "ratios": X / (K + M) - Y / (K + M) + (X / Y) / (Y / X) + X**3 / Y**2,
    "negative": (1.0 - X) - (Y + K) * -1.0 - (X - Y * M),
}


def text(outputs: Mapping[str, Expression]) -> list[str]:
    return lines_source("lines", outputs).splitlines()


@NUMBERS.case()
def formulas_rewritten() -> dict[str, Any]:
    constants, rest = hoisted(FORMULAS, {"x", "y"}, "c")
    return {
        "as they stand": text(FORMULAS),
        "gathered": text(gather_factors(FORMULAS, {"k", "m"})),
        "simplified": text(simplified(FORMULAS, {"k", "m"})),
        "fused": text(fused(simplified(FORMULAS, {"k", "m"}))),
        "reciprocals": text(share_reciprocals(FORMULAS, {"k", "m"})),
        "ratios": text(share_ratios(FORMULAS)),
        "once": text(constants),
        "at every step": text(rest),
        "packed": packed_source("lines", FORMULAS).splitlines(),
        "operations": operations_source(
            {"lines": lines_source("lines", {"y": FORMULAS["sum"]})}, {"k": 0, "x": 1, "y": 2}, 4
        ).splitlines(),
        "symbols": sorted(symbols_in(list(FORMULAS.values()))),
        "constants folded": text(
            {
                "sums": (X + 0.0) - 0.0 + (0.0 + X) + (0.0 - Y),
                "products": (X * 1.0) * (1.0 * Y) + X * 0.0 + X / 1.0 + 0.0 / K,
                "powers": X**0 + X**1 + X**2 + X**-1 + X**4,
                "numbers": X * (2.0 * 3.0) - absolute(-Y) + (-X) * -1.0,
                "compared": where(X < 1.0, where(X <= K, X, Y), where(X > 2.0, Y, K)),
            }
        ),
    }


@NUMBERS.case()
def what_comes_late() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, arrival in {
        "x": {"x": 0.0},
        "y after x": {"x": 0.0, "y": 9.0},
        "m long after": {"m": 100.0, "k": 3.0},
        "nothing": dict[str, float](),
    }.items():
        made, times = late_last(FORMULAS, arrival)
        told[name] = {"text": text(made), "times": times}
    lone = {"a": X * Y * K, "b": X * Y * M - K * M, "c": tanh(X) * Y + sqrt(K * X) / M, "d": (X + Y + K) * (M - Y)}
    told["small ones"] = [
        {"text": text(made), "times": times}
        for made, times in (late_last(lone, arrival) for arrival in ({"x": 0.0}, {"k": 2.0, "y": 4.0}))
    ]
    told["affine"] = text({"y": affine_form((X - K) * M + X * 2.0 - (Y - X / M), X)})
    return told


@NUMBERS.case()
def slopes() -> dict[str, Any]:
    inputs = [X, Y, K]
    outputs = [
        *list(FORMULAS.values())[:4],
        tanh(X * Y) * log(K) - maximum(X, Y * K) / (X * X + 1.0),
        with_derivatives(sqrt(X * X + K), (X * X + K - frozen(sqrt(X * X + K)) ** 2, 0.5 / sqrt(X * X + K))) * Y,
        waypoint(X * Y) + waypoint(X * Y) * K,
    ]

    def named(rows: list[list[Expression]]) -> list[str]:
        return text({f"j{i}_{j}": one for i, row in enumerate(rows) for j, one in enumerate(row)})

    state = x0, x1, x2, x3, x4, x5, x6 = [symbol(f"x{i}") for i in range(7)]
    rates = list(circuit_derivative((x0, x1, x2, x3, x4, x5, x6), Y, parameter_symbols(CircuitParameters)))
    return {
        "forward": named(jacobian(outputs, inputs)),
        "by elimination": named(eliminated_jacobian(outputs, inputs)),
        "lines of a circuit": [len(named(found(rates, [*state, Y]))) for found in (jacobian, eliminated_jacobian)],
    }


@NUMBERS.case()
def loops_in_c() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for precision in (DOUBLE, FLOAT):
        functions = {one.__name__: one for one in (spread, work, doubled)}
        written = Translation(functions, {"SHIFT": 2}, {}, precision, "mine")
        translate = written.translate("work", GIVEN)
        told[precision.name] = {
            "text": written.text.splitlines(),
            "operations": dict(sorted(translate.operations.items())),
            "written": list(translate.written),
            "numbers": [precision.literal(one) for one in (0.0, -1.5, 1e30, 1.0 / 3.0, float("-inf"), float("nan"))],
        }
    return told


@NUMBERS.case()
def loops_for_machines() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, source, takes in (("add", TEXT, TAKES), ("mixed", MIXED, MIXED_TAKES)):
        module = Module(source)
        compiled = module.enter(name, tuple(argument.kind for argument in signature(takes)))
        told[name] = {"written": sorted(compiled.written), "text": module.ir().splitlines()}
    return told


def written(module: Any, compiled: Callable[[], Any]) -> tuple[str, Mapping[str, Any]]:
    """Return the text of a kernel for processors with four lanes, and its signatures."""
    found: list[Any] = []

    def load(_: str, text: Callable[[], str], entries: Mapping[str, Any], *__: Any) -> Any:
        found.extend([text(), entries])
        return MagicMock()

    with patch.multiple(module, load_native=load, native_width=lambda: 4):
        compiled()
    text, entries = found
    return text, entries


def unkept(cached: Any, given: tuple[Any, ...]) -> Callable[[], Any]:
    return partial(cached.__wrapped__, *given)


@NUMBERS.case()
def kernels_of_plants() -> dict[str, Any]:
    """Return how often each instruction occurs in the code from which machine code is made."""
    told: dict[str, Any] = {}
    for lanes in (1, 8):
        plant: Any = "lumped", lumped_step, 3, EhaParameters, lanes
        adaptive: Any = "circuit", circuit_derivative, 7, CircuitParameters, lanes
        for name, (text, entries) in {
            "fixed steps": written(fixed_step_kernel, unkept(compile_fixed_step, plant)),
            "controlled error": written(adaptive_kernel, unkept(compile_adaptive, adaptive)),
        }.items():
            module = Module(text)
            for entry, takes in entries.items():
                module.enter(entry, tuple(argument.kind for argument in takes))
            words = Counter(word for line in module.ir().splitlines() for word in line.split())
            told[f"{name}, {lanes} side by side"] = {
                "lines": len(text.splitlines()),
                "numbers": [line for line in text.splitlines() if line[:1].isupper() and "SLOTS" not in line],
                "instructions": {
                    word: count for word, count in sorted(words.items()) if word.strip("@").isalpha() and count > 1
                },
            }
    return told


MIXED = """
LIMIT = 3

def part(values, k):
    return values[k] if values[k] > 0.0 else -values[k]

def mixed(values, room, count):
    total, last = 0.0, 1
    for i in range(1, count, 2):
        if i == LIMIT and not values[i] < 0.5:
            continue
        total += part(values, i) ** 2 / (1.0 + i // 2)
        last = i % 4
    while last > 0:
        last -= 1
        room[last] = min(total, 2.0) - max(values[0], values[-1])
    made = np.zeros(3)
    made[:] = room[:3]
    return made[0] + made[2], last
"""
MIXED_TAKES = """
values : ndarray, shape (n,)
room : ndarray, shape (m,)
count : int
"""


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
