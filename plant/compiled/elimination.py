"""The Jacobian of a graph by elimination of its inner nodes, cheapest first.

Forward differentiation carries every input through every operation. If many operations depend on few quantities, as
flows on pressures, it costs less to join the derivatives on both sides of such a quantity once. Each elimination of a
node joins its uses with its operands; taking the node with the fewest joins next is Markowitz's rule (Griewank and
Walther 2008, Evaluating Derivatives, section 9).
"""

from collections.abc import Sequence
from typing import TypeAlias

from plant.compiled.expression import ONE, ZERO, Expression, ordered, select, slopes_of

Edges: TypeAlias = dict[int, dict[int, Expression]]
"""For operands, ``edges[a][b]`` is the derivative of a by operand b; for uses, the derivative of b by operand a."""

_MINUS = -ONE


def eliminated_jacobian(outputs: Sequence[Expression], inputs: Sequence[Expression]) -> list[list[Expression]]:
    """Differentiate every output with respect to every input, with sign() and where() held constant.

    Parameters
    ----------
    inputs : sequence of Expression
        Symbols, or other nodes; the operands of such a node count as constant.

    Returns
    -------
    list of list of Expression
        ``result[i][j]`` is the derivative of output i by input j, equal to that of `plant.compiled.expression.jacobian`
        to rounding; `ZERO` where it vanishes structurally.
    """
    operands, uses = _local_edges(outputs, inputs)
    sources = {id(item) for item in inputs}
    inner = {item: order for order, item in enumerate(operands) if item >= 0 and item not in sources}
    while inner:
        item = min(inner, key=lambda one: (len(operands[one]) * len(uses[one]), inner[one]))
        del inner[item]
        _eliminate(item, operands, uses)
    return [[operands[-1 - i].get(id(source), ZERO) for source in inputs] for i in range(len(outputs))]


def _local_edges(outputs: Sequence[Expression], inputs: Sequence[Expression]) -> tuple[Edges, Edges]:
    """Return the edges between nodes that depend on an input; output i is the node -1 - i."""
    operands: Edges = {id(item): {} for item in inputs}
    uses: Edges = {id(item): {} for item in inputs}
    sources = set(operands)
    for item in ordered(outputs, by_slopes=True):
        for argument, slope in () if id(item) in sources else slopes_of(item):
            if id(argument) in uses and slope is not ZERO:
                _join(operands.setdefault(id(item), {}), id(argument), slope)
                uses.setdefault(id(item), {})
                uses[id(argument)][id(item)] = operands[id(item)][id(argument)]
    for i, output in enumerate(outputs):
        operands[-1 - i] = {id(output): ONE} if id(output) in uses else {}
        if id(output) in uses:
            uses[id(output)][-1 - i] = ONE
    return operands, uses


def _eliminate(item: int, operands: Edges, uses: Edges) -> None:
    for use, outer in uses.pop(item).items():
        del operands[use][item]
        for operand, inner in operands[item].items():
            _join(operands[use], operand, _product(outer, inner))
            uses[operand][use] = operands[use][operand]
    for operand in operands.pop(item):
        del uses[operand][item]


def _join(edges: dict[int, Expression], operand: int, slope: Expression) -> None:
    edges[operand] = _sum(edges[operand], slope) if operand in edges else slope


def _choice(a: Expression) -> bool:
    """Whether a node chooses between a value and zero."""
    return a.operation == "where" and (a.arguments[1] is ZERO or a.arguments[2] is ZERO)


def _product(a: Expression, b: Expression) -> Expression:
    """Multiply; a choice selects the product, since zero times the other value may not be finite."""
    if _choice(a):
        condition, chosen, other = a.arguments
        return select(condition, _product(chosen, b), _product(other, b))
    if _choice(b):
        return _product(b, a)
    if a is _MINUS:
        opposite = _negated(b)
        return -b if opposite is None else opposite
    return _product(b, a) if b is _MINUS else a * b


def _negated(a: Expression) -> Expression | None:
    """Return x if the node is ``0 - x``."""
    return a.arguments[1] if a.operation == "-" and a.arguments[0] is ZERO else None


def _sum(a: Expression, b: Expression) -> Expression:
    """Add; two choices by the same condition become one."""
    if _choice(a) and _choice(b) and a.arguments[0] is b.arguments[0]:
        condition = a.arguments[0]
        return select(condition, _sum(a.arguments[1], b.arguments[1]), _sum(a.arguments[2], b.arguments[2]))
    taken = _negated(b)
    return a + b if taken is None else a - taken
