"""Rewrites a graph so that it costs less if the last digits do not matter; a kernel asks for it.

Factors are gathered, divisions by the same divisor share its reciprocal (a division takes as long as five to ten
products), and sums of products are rounded once. Each function takes the outputs, by name, and the symbols that seldom
change; it returns the same values, to rounding, under the same names.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from typing import TypeAlias

from plant.compiled.expression import ONE, Expression, node, ordered
from plant.compiled.gather import gather_factors
from plant.compiled.hoist import settled_nodes

Nodes: TypeAlias = Mapping[int, Expression]
"""Replacement of each processed node, by its id."""

FUSED = ("fma", "fnma", "fms")
"""Products with a sum, rounded once: ``a * b + c``, ``c - a * b`` and ``a * b - c``."""


def simplified(outputs: Mapping[str, Expression], fixed: Collection[str]) -> dict[str, Expression]:
    """Gather factors, then share reciprocals."""
    return share_reciprocals(gather_factors(outputs, fixed), fixed)


def share_reciprocals(outputs: Mapping[str, Expression], fixed: Collection[str]) -> dict[str, Expression]:
    """Replace divisions by products with a reciprocal if it is used twice or changes seldom.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> from plant.compiled.source import lines_source
    >>> x, y, z = symbol("x"), symbol("y"), symbol("z")
    >>> print(lines_source("lines", share_reciprocals({"a": x / z, "b": y / z, "c": z / x}, ())))
    def lines(x, y, z):
        t0_ = 1.0 / z
        t1_ = x * t0_
        t2_ = y * t0_
        t3_ = z / x
        return {"a": t1_, "b": t2_, "c": t3_}
    """
    order = ordered(outputs.values())
    settled = settled_nodes(order, fixed)
    uses = Counter(id(item.arguments[1]) for item in order if item.operation == "/")

    def shared(item: Expression, new: Nodes) -> Expression | None:
        if item.operation != "/" or id(item) in settled:
            return None
        above, below = item.arguments
        serves = uses[id(below)] > 1 or id(below) in settled
        return new[id(above)] * (ONE / new[id(below)]) if serves else None

    return rewritten(outputs, shared)


def share_ratios(outputs: Mapping[str, Expression]) -> dict[str, Expression]:
    """Compute a ratio and its inverse with one division, by the product of the two; neither may be zero.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> from plant.compiled.source import lines_source
    >>> x, y = symbol("x"), symbol("y")
    >>> print(lines_source("lines", share_ratios({"a": x / y, "b": y / x})))
    def lines(x, y):
        t0_ = x * y
        t1_ = 1.0 / t0_
        t2_ = x * t1_
        t3_ = x * t2_
        t4_ = y * t1_
        t5_ = y * t4_
        return {"a": t3_, "b": t5_}
    """
    order = ordered(outputs.values())
    places = {id(item): place for place, item in enumerate(order)}
    pairs = {tuple(map(id, item.arguments)): item.arguments for item in order if item.operation == "/"}
    partner = {divisor: above for (number, divisor), (above, _) in pairs.items() if (divisor, number) in pairs}

    def shared(item: Expression, new: Nodes) -> Expression | None:
        if item.operation != "/" or id(item.arguments[1]) not in partner:
            return None
        pair = item.arguments[1], partner[id(item.arguments[1])]
        first, second = (new[id(one)] for one in sorted(pair, key=lambda one: places[id(one)]))
        return new[id(item.arguments[0])] * (new[id(pair[1])] * (ONE / (first * second)))

    return rewritten(outputs, shared)


def fused(outputs: Mapping[str, Expression]) -> dict[str, Expression]:
    """Round a sum with a product once if the product has no other use: ``fma``, as `source` writes it.

    Written explicitly, it is the same on every machine and in every form of kernel; a compiler's own choice would not
    be. The result can no longer be differentiated.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> from plant.compiled.source import lines_source
    >>> x, y, z = symbol("x"), symbol("y"), symbol("z")
    >>> print(lines_source("lines", fused({"a": x * y + z, "b": z - x * z, "c": y * z - x})))
    def lines(x, y, z):
        t0_ = fma(x, y, z)
        t1_ = fma(-x, z, z)
        t2_ = fma(y, z, -x)
        return {"a": t0_, "b": t1_, "c": t2_}
    """
    order = ordered(outputs.values())
    uses = Counter(id(argument) for item in order for argument in item.arguments)
    uses.update(id(output) for output in outputs.values())

    def joined(item: Expression, new: Nodes) -> Expression | None:
        lone = [argument.operation == "*" and uses[id(argument)] == 1 for argument in item.arguments]
        if item.operation not in ("+", "-") or not any(lone):
            return None
        place = int(lone[1]) if item.operation == "-" else lone.index(True)
        kind = FUSED[0] if item.operation == "+" else FUSED[2 - place]
        product, other = (new[id(item.arguments[i])] for i in (place, 1 - place))
        return node(kind, *product.arguments, other)

    return rewritten(outputs, joined)


def rewritten(
    outputs: Mapping[str, Expression], rule: Callable[[Expression, Nodes], Expression | None]
) -> dict[str, Expression]:
    """Replace every node by the result of a rule, operands first; if the rule gives none, keep the operation."""
    new: dict[int, Expression] = {}
    for item in ordered(outputs.values()):
        made = rule(item, new)
        same = (new[id(argument)] for argument in item.arguments)
        new[id(item)] = node(item.operation, *same, value=item.value) if made is None else made
    return {name: new[id(output)] for name, output in outputs.items()}
