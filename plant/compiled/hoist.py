"""Splits a graph into a part that is the same at every step, computed once, and the rest."""

from collections.abc import Collection, Mapping, Sequence, Set

from plant.compiled.expression import Expression, ordered, symbol

COMPARISONS = ("<", "<=", ">", ">=", "present")
"""Operations whose result is a Boolean, not a number: an ``int`` in C."""


def hoisted(
    outputs: Mapping[str, Expression], varying: Set[str], prefix: str
) -> tuple[dict[str, Expression], dict[str, Expression]]:
    """Move the largest sub-expressions of constant symbols out of the outputs.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        Expressions that are computed at every step, by the variable that receives each.
    varying : set of str
        Symbols whose value changes from step to step.
    prefix : str
        Prefix of the new symbols' names; a number follows.

    Returns
    -------
    tuple of dict[str, Expression]
        The constants by their new names, to be computed once, and the outputs in terms of them.

    Examples
    --------
    >>> a, b, x = symbol("a"), symbol("b"), symbol("x")
    >>> constants, rest = hoisted({"y": x * (a / b) + a}, {"x"}, "c")
    >>> [c.operation for c in constants.values()], rest["y"].operation
    (['/', 'symbol'], '+')
    """
    order = ordered(outputs.values())
    symbols = {str(item.value) for item in order if item.operation == "symbol"}
    settled = settled_nodes(order, symbols - varying)
    constants: dict[str, Expression] = {}
    rewritten: dict[int, Expression] = {}

    def needed(item: Expression) -> Expression:
        """Return the replacement of an operand of a varying node, or of an output."""
        if id(item) not in rewritten:
            if item.operation == "constant":
                rewritten[id(item)] = item
            elif item.operation in COMPARISONS:  # a comparison gives no number that could be kept
                rewritten[id(item)] = Expression(item.operation, tuple(map(needed, item.arguments)), item.value)
            else:
                name = f"{prefix}{len(constants)}"
                constants[name] = item
                rewritten[id(item)] = symbol(name)
        return rewritten[id(item)]

    for item in order:
        if id(item) not in settled:
            moved = tuple(needed(argument) for argument in item.arguments)
            rewritten[id(item)] = item if not moved else Expression(item.operation, moved, item.value)
    return constants, {name: needed(value) for name, value in outputs.items()}


def settled_nodes(order: Sequence[Expression], fixed: Collection[str]) -> set[int]:
    """Return the ids of the nodes that depend only on certain fixed symbols and on constants.

    Parameters
    ----------
    order : sequence of Expression
        Nodes, operands before results.
    """
    settled: set[int] = set()
    for item in order:
        if item.value in fixed if item.operation == "symbol" else all(id(a) in settled for a in item.arguments):
            settled.add(id(item))
    return settled
