"""Two peculiarities in one log: which kinds can be combined, and the kind that a pair makes."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import cache
from typing import Any

import numpy as np

from experiments.open_benchmark.draws import draw_plain
from experiments.open_benchmark.drives import OPEN
from experiments.open_benchmark.kind import OWN_CONDITION, UNKNOWN, Kind
from experiments.open_benchmark.setup import Setup
from plant.errors import HydrostateError

PAIR_SEPARATOR = "+"
"""Separator between the names of a pair."""


def pair_of(first: Kind, second: Kind) -> Kind:
    """Return the kind of log that combines two kinds, drawn one after the other.

    The right class is the one on which both agree; unknown is right if it is right for either. Both causes must be
    named. If one kind needs a position loop, the pair uses its drives.

    Parameters
    ----------
    first, second : Kind
        Two kinds that do not collide, see `collide`.

    Raises
    ------
    HydrostateError
        If they do.
    """
    if collide(first, second):
        raise HydrostateError(f"kinds of a pair must not collide, got {first.name} and {second.name}")
    patterns = [f"(?=.*(?:{kind.named}))" for kind in (first, second) if kind.named]
    return Kind(
        f"{first.name}{PAIR_SEPARATOR}{second.name}",
        f"{first.strange}; {second.strange}",
        lambda setup, rng: _with_both_changes(first, second, setup, rng),
        _right_verdicts(first.accept, second.accept),
        rf"\A(?s:{''.join(patterns)})" if patterns else "",
        first.drives if first.drives != tuple(OPEN) else second.drives,
        _shared_conditions(first, second),
        first.severity and second.severity,
    )


def _with_both_changes(first: Kind, second: Kind, setup: Setup, rng: np.random.Generator) -> Setup:
    """Return a plain log with the changes of both kinds; a kind that draws a new machine comes first."""
    for kind in (second, first) if second.draws_anew else (first, second):
        setup = kind.draw(setup, rng)
    return setup


def collide(first: Kind, second: Kind) -> bool:
    """Return whether two kinds cannot be in one log.

    They collide if both change the same part of machine, sensor, logger or rig file, if both have drives of their own,
    if they share no condition, or if one of them changes nothing.
    """
    changes = changed_parts(first), changed_parts(second)
    return not all(changes) or bool(changes[0] & changes[1]) or not _shared_conditions(first, second)


def _shared_conditions(first: Kind, second: Kind) -> tuple[str, ...]:
    return tuple(condition for condition in first.conditions if condition in second.conditions)


def _right_verdicts(first: Sequence[str], second: Sequence[str]) -> tuple[str, ...]:
    """Return the right verdicts for both; the classes that a kind names itself take precedence over the condition."""
    unknown = (UNKNOWN,) if UNKNOWN in (*first, *second) else ()
    classes = [[verdict for verdict in one if verdict != UNKNOWN] for one in (first, second)]
    own = [one for one in classes if one != [OWN_CONDITION]]
    shared = (OWN_CONDITION,) if not own else tuple(verdict for verdict in own[0] if all(verdict in one for one in own))
    return (*shared, *unknown)


@cache
def changed_parts(kind: Kind) -> frozenset[str]:
    """Return the parts of a plain log that a kind changes, including its drive."""
    plain = draw_plain(kind.conditions[0], kind.drives[0], np.random.default_rng(0))
    before, after = _parts(plain), _parts(kind.draw(plain, np.random.default_rng(1)))
    changed = {name for name in {*before, *after} if before.get(name) != after.get(name)}
    return frozenset(changed | ({"drive"} if kind.drives != tuple(OPEN) else set()))


def _parts(setup: Setup) -> Mapping[str, Any]:
    """Return all parts of a setup as values by name."""
    logger, change = setup.logger, setup.change
    parts: dict[str, Any] = {f"machine {name}": value for name, value in setup.machine._asdict().items()}
    parts |= {f"change {one.name}": getattr(change, one.name) for one in fields(change)}
    parts |= {
        f"{channel} {one.name}": getattr(sensor, one.name)
        for channel, sensor in logger.sensors.items()
        for one in fields(sensor)
    }
    parts |= {f"logger {one.name}": getattr(logger, one.name) for one in fields(logger) if one.name != "sensors"}
    parts |= {"rig": "said"} if setup.rig else {}
    return parts | {"travel": setup.travel, "duration": setup.duration, "forward": setup.forward_first}
