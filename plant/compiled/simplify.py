"""Rewrites a graph so that it costs less: divisions by one divisor share its reciprocal.

A division takes as long as five to ten products. The result differs in the last digits, so a kernel asks for it.
"""

from collections import Counter
from collections.abc import Collection, Mapping

from plant.compiled.expression import ONE, Expression, node, ordered
from plant.compiled.hoist import settled_nodes


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
