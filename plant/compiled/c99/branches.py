"""Choices with much work on one side, as blocks: the work is done only if that side is chosen."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from plant.compiled.expression import Expression

FEWEST_OPERATIONS = 8
"""Number of operations that one side needs alone for a block [operations]; judged: a few cost less than a jump."""


@dataclass(frozen=True, eq=False)
class Block:
    """Choices by one condition.

    Parameters
    ----------
    condition : Expression
        Condition of the choices.
    choices : list of Expression
        The choices; none depends on another.
    sides : tuple of list of Expression
        Nodes that only one side of them needs, operands before results: the side if the condition holds, and the other.
    """

    condition: Expression
    choices: list[Expression]
    sides: tuple[list[Expression], list[Expression]]


def blocks_of(order: Sequence[Expression], kept: Sequence[Expression]) -> dict[int, Block]:
    """Find choices that are worth a block; the nodes `kept` are always needed.

    Returns
    -------
    dict[int, Block]
        The block of each choice that belongs to one, by the choice's id.
    """
    places = {id(one): place for place, one in enumerate(order)}
    uses = Counter(id(one) for item in order for one in item.arguments)
    wanted = {id(one) for one in kept}
    found: dict[int, Block] = {}
    for choices in _choice_groups(order):
        true, false = (
            sorted(
                _one_sided_operations(uses, wanted, [one.arguments[side] for one in choices]),
                key=lambda one: places[id(one)],
            )
            for side in (1, 2)
        )
        if max(len(true), len(false)) >= FEWEST_OPERATIONS:
            block = Block(choices[0].arguments[0], choices, (true, false))
            found |= {id(one): block for one in choices}
    return found


def _choice_groups(order: Sequence[Expression]) -> list[list[Expression]]:
    """Return groups of choices by the same condition, without those that depend on another choice of the group."""
    groups: dict[int, list[Expression]] = {}
    below: dict[int, set[int]] = {}
    for item in order:
        choices = {id(item)} if item.operation == "where" else set[int]()
        below[id(item)] = choices.union(*(below[id(one)] for one in item.arguments))
        if choices:
            group = groups.setdefault(id(item.arguments[0]), [])
            if not any(id(one) in below[id(item)] for one in group):
                group.append(item)
    return list(groups.values())


def _one_sided_operations(uses: Mapping[int, int], wanted: set[int], sides: Sequence[Expression]) -> list[Expression]:
    """Return the operations that only one side of the choices uses."""
    alone: list[Expression] = []
    found, waiting = Counter[int](), [*sides]
    while waiting:
        item = waiting.pop()
        found[id(item)] += 1
        if item.arguments and found[id(item)] == uses[id(item)] and id(item) not in wanted:
            alone.append(item)
            waiting += item.arguments
    return alone
