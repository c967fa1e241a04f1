"""Rewrites a graph so that it costs less, where the last digits do not matter; a kernel asks for it.

Factors are gathered, divisions by one divisor share its reciprocal (a division takes as long as five to ten products),
and sums of products are rounded once.
"""

from collections import Counter
from collections.abc import Collection, Mapping

from plant.compiled.expression import ONE, Expression, node, ordered
from plant.compiled.gather import gathered
from plant.compiled.hoist import settled_nodes

FUSED = ("fma", "fnma", "fms")
"""Products with a sum, rounded once: ``a * b + c``, ``c - a * b`` and ``a * b - c``."""


def simplified(outputs: Mapping[str, Expression], fixed: Collection[str]) -> dict[str, Expression]:
    """Gather factors, then share reciprocals.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by name.
    fixed : collection of str
        Symbols that change seldom.

    Returns
    -------
    dict[str, Expression]
        The same values to rounding, by the same names.
    """
    return share_reciprocals(gathered(outputs, fixed), fixed)


def share_reciprocals(outputs: Mapping[str, Expression], fixed: Collection[str]) -> dict[str, Expression]:
    """Replace divisions by products with a reciprocal, wherever it serves twice or changes seldom.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by name.
    fixed : collection of str
        Symbols that change seldom.

    Returns
    -------
    dict[str, Expression]
        The same values to rounding, by the same names.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> from plant.compiled.source import statements
    >>> x, y, z = symbol("x"), symbol("y"), symbol("z")
    >>> print(statements(share_reciprocals({"a": x / z, "b": y / z, "c": z / x}, ()), ""))
    t0_ = 1.0 / z
    t1_ = x * t0_
    t2_ = y * t0_
    t3_ = z / x
    a, b, c = t1_, t2_, t3_
    """
    order = ordered(outputs.values())
    settled = settled_nodes(order, fixed)
    uses = Counter(id(item.arguments[1]) for item in order if item.operation == "/")
    new: dict[int, Expression] = {}
    for item in order:
        arguments = [new[id(argument)] for argument in item.arguments]
        shares = item.operation == "/" and (uses[id(item.arguments[1])] > 1 or id(item.arguments[1]) in settled)
        if shares and id(item) not in settled:
            new[id(item)] = arguments[0] * (ONE / arguments[1])
        else:
            new[id(item)] = node(item.operation, *arguments, value=item.value)
    return {name: new[id(output)] for name, output in outputs.items()}


def share_ratios(outputs: Mapping[str, Expression]) -> dict[str, Expression]:
    """Let a ratio and its reverse take one division, by the product of the two; neither may be zero.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by name.

    Returns
    -------
    dict[str, Expression]
        The same values to rounding, by the same names.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> from plant.compiled.source import statements
    >>> x, y = symbol("x"), symbol("y")
    >>> print(statements(share_ratios({"a": x / y, "b": y / x}), ""))
    t0_ = x * y
    t1_ = 1.0 / t0_
    t2_ = x * t1_
    t3_ = x * t2_
    t4_ = y * t1_
    t5_ = y * t4_
    a, b = t3_, t5_
    """
    order = ordered(outputs.values())
    places = {id(item): place for place, item in enumerate(order)}
    pairs = {tuple(map(id, item.arguments)): item.arguments for item in order if item.operation == "/"}
    partner = {divisor: above for (number, divisor), (above, _) in pairs.items() if (divisor, number) in pairs}
    new: dict[int, Expression] = {}
    for item in order:
        arguments = [new[id(argument)] for argument in item.arguments]
        if item.operation == "/" and id(item.arguments[1]) in partner:
            pair = item.arguments[1], partner[id(item.arguments[1])]
            first, second = (new[id(one)] for one in sorted(pair, key=lambda one: places[id(one)]))
            new[id(item)] = arguments[0] * (new[id(pair[1])] * (ONE / (first * second)))
        else:
            new[id(item)] = node(item.operation, *arguments, value=item.value)
    return {name: new[id(output)] for name, output in outputs.items()}


def fused(outputs: Mapping[str, Expression]) -> dict[str, Expression]:
    """Round a sum with a product once, where the product serves nothing else: ``fma``, as `source` spells it.

    Written out, it is the same on every machine and in every shape of kernel, which is not so where a compiler chooses.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by name.

    Returns
    -------
    dict[str, Expression]
        The same values to rounding, by the same names; they cannot be differentiated any more.

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
    new: dict[int, Expression] = {}
    for item in order:
        arguments = [new[id(argument)] for argument in item.arguments]
        lone = [argument.operation == "*" and uses[id(argument)] == 1 for argument in item.arguments]
        if item.operation in ("+", "-") and any(lone):
            place = int(lone[1]) if item.operation == "-" else lone.index(True)
            kind = FUSED[0] if item.operation == "+" else FUSED[2 - place]
            new[id(item)] = node(kind, *arguments[place].arguments, arguments[1 - place])
        else:
            new[id(item)] = node(item.operation, *arguments, value=item.value)
    return {name: new[id(output)] for name, output in outputs.items()}
