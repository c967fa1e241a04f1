"""Choices of which one side is much work, as blocks that are gone through only where that side is chosen."""

from collections.abc import Sequence
from dataclasses import dataclass

from plant.compiled.expression import Expression

LEAST = 8
"""A side that needs so many operations for itself makes a block [operations]; judged: a few cost less than a jump."""


@dataclass(frozen=True, eq=False)
class Block:
    """Choices by one condition.

    Parameters
    ----------
    condition : Expression
        What they choose by.
    choices : list of Expression
        The choices, none of which hangs on another.
    sides : tuple of list of Expression
        What only one side of them needs, operands before results: where the condition holds, and where not.
    """

    condition: Expression
    choices: list[Expression]
    sides: tuple[list[Expression], list[Expression]]


def blocks_of(order: Sequence[Expression], kept: Sequence[Expression]) -> dict[int, Block]:
    """Find choices that are worth a block.

    Parameters
    ----------
    order : sequence of Expression
        All nodes, operands before results.
    kept : sequence of Expression
        Nodes that are wanted whatever is chosen.

    Returns
    -------
    dict[int, Block]
        The block of each choice that belongs to one, by the choice's id.
    """
    users: dict[int, list[tuple[Expression, int]]] = {id(one): [] for one in order}
    for item in order:
        for place, one in enumerate(item.arguments):
            users[id(one)].append((item, place))
    wanted = {id(one) for one in kept}
    found: dict[int, Block] = {}
    for choices in _apart(order):
        true, false = (_alone(order, users, wanted, choices, place) for place in (1, 2))
        if max(len(true), len(false)) >= LEAST:
            block = Block(choices[0].arguments[0], choices, (true, false))
            found |= {id(one): block for one in choices}
    return found


def _apart(order: Sequence[Expression]) -> list[list[Expression]]:
    """Return choices by the same condition together, without those that hang on another of them."""
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


def _alone(
    order: Sequence[Expression],
    users: dict[int, list[tuple[Expression, int]]],
    wanted: set[int],
    choices: Sequence[Expression],
    place: int,
) -> list[Expression]:
    """Return the operations that serve one side of the choices and nothing else."""
    chosen, alone = {id(one) for one in choices}, set[int]()
    for item in reversed(order):
        if item.arguments and id(item) not in wanted:
            serves = users[id(item)]
            if all(id(user) in alone or (id(user) in chosen and at == place) for user, at in serves):
                alone.add(id(item))
    return [item for item in order if id(item) in alone]
