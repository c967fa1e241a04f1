"""All kinds of log by name, the splits, and the log for a given kind, split and index."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from experiments.open_benchmark.added_kinds import ADDED_KINDS
from experiments.open_benchmark.draws import course_of, draw_plain
from experiments.open_benchmark.fault_kinds import FAULT_KINDS
from experiments.open_benchmark.kind import Kind
from experiments.open_benchmark.logger_kinds import LOGGER_KINDS
from experiments.open_benchmark.machine import Machine
from experiments.open_benchmark.oil import stiffness
from experiments.open_benchmark.pairs import PAIR_SEPARATOR, collide, pair_of
from experiments.open_benchmark.rig_kinds import RIG_KINDS
from experiments.open_benchmark.run import run
from experiments.open_benchmark.setup import Setup
from plant.errors import HydrostateError, require_known

VERSION = "1.0"
"""Version of the open benchmark; any change of a log, however small, needs a new one."""

SPLITS = ("training", "validation", "test")
"""Splits: for learning, for choosing between methods, and for the final score."""

KINDS: Mapping[str, Kind] = {kind.name: kind for kind in (*LOGGER_KINDS, *RIG_KINDS, *FAULT_KINDS, *ADDED_KINDS)}
"""All kinds, by name."""

STRIDE = 4
"""Step through a kind's conditions from log to log, so that a few logs have different conditions; coprime to their
number."""


@dataclass(frozen=True, eq=False)
class MadeLog:
    """One log and its truth.

    Parameters
    ----------
    kind : Kind
        Its kind.
    setup : Setup
        The setup that the log was made from.
    log : pandas.DataFrame, shape (samples, channels)
        The log as in its file.
    states : ndarray, shape (m, 7)
        States of the run, named as in `STATES`, in their units; pressures are those that act.
    bulk_modulus : tuple of float
        Lowest and highest effective bulk modulus during the run [Pa].
    """

    kind: Kind
    setup: Setup
    log: pd.DataFrame
    states: NDArray[np.float64]
    bulk_modulus: tuple[float, float]


def kind_of(name: str) -> Kind:
    """Return a kind by its name; two names joined by a plus sign give the pair of both.

    Parameters
    ----------
    name : str
        One or two names from `KINDS`.

    Raises
    ------
    HydrostateError
        If there is no such kind, or the two collide.
    """
    first, both, second = name.partition(PAIR_SEPARATOR)
    for one in (first, second) if both else (first,):
        if one not in KINDS:
            near = get_close_matches(one, KINDS, n=1)
            hint = f"did you mean {near[0]!r}?" if near else "`hydrostate benchmark kinds` lists those that are there"
            raise HydrostateError(f"kind {one!r} is unknown, {hint}")
    return pair_of(KINDS[first], KINDS[second]) if both else KINDS[first]


def drawn_pairs(split: str, count: int) -> list[str]:
    """Return names of pairs of kinds that do not collide, drawn at random without replacement; a split fixes the draw.

    Pairs with a kind that was added later come last, so that the first pairs do not change.

    Parameters
    ----------
    split : str
        One of `SPLITS`.
    count : int
        Number of pairs, limited to all that exist; a larger number adds pairs and keeps the first ones.
    """
    require_known("split", split, SPLITS)
    pairs = [(a, b) for a, b in combinations(KINDS.values(), 2) if not collide(a, b)]
    rng = np.random.default_rng([zlib.crc32(PAIR_SEPARATOR.encode()), SPLITS.index(split)])
    drawn: list[str] = []
    for later in (False, True):
        names = [
            f"{a.name}{PAIR_SEPARATOR}{b.name}" for a, b in pairs if (a in ADDED_KINDS or b in ADDED_KINDS) is later
        ]
        drawn += [names[place] for place in rng.permutation(len(names))]
    return drawn[:count]


def seed_of(kind: str, split: str, index: int) -> list[int]:
    """Return the seed of a log, unique to kind, split and index.

    Examples
    --------
    >>> seed_of("plain", "test", 3)[1:]
    [2, 3]
    """
    kind_of(kind)
    require_known("split", split, SPLITS)
    if index < 0:
        raise HydrostateError(f"index must not be negative, got {index!r}")
    return [zlib.crc32(kind.encode()), SPLITS.index(split), index]


def make(kind: str, split: str, index: int) -> MadeLog:
    """Return a log; the same kind, split and index give the same bits.

    Parameters
    ----------
    kind : str
        One name from `KINDS`, or two joined by a plus sign.
    split : str
        One of `SPLITS`.
    index : int
        Index of the log, from 0.
    """
    drawing, driving, logging = np.random.default_rng(seed_of(kind, split, index)).spawn(3)
    one = kind_of(kind)
    condition = one.conditions[STRIDE * index % len(one.conditions)]
    drive = one.drives[index % len(one.drives)]
    setup = one.draw(draw_plain(condition, drive, drawing), drawing)
    course = course_of(setup, driving)
    states = run(setup.machine, course)
    states[:, 4:6] = np.maximum(states[:, 4:6], setup.machine.vapour)
    return MadeLog(one, setup, setup.logger.log(states, logging), states, _stiffnesses(setup, states, course[:, 3]))


def _stiffnesses(setup: Setup, states: NDArray[np.float64], air: NDArray[np.float64]) -> tuple[float, float]:
    """Return the range of bulk modulus over a run, excluding one percent of the pressures at either end.

    It is the oil's value at atmospheric pressure by the project's convention, unless air or a stiffening oil change it.
    """
    m = setup.machine
    if np.max(air) == 0.0 and m.stiffening == Machine().stiffening:
        return m.bulk_modulus, m.bulk_modulus
    pressures = np.maximum(np.quantile(states[:, 4:6], (0.01, 0.99)), m.vapour)
    ends = [stiffness(float(p), float(a), m) for p in pressures for a in (np.min(air), np.max(air))]
    return min(ends), max(ends)
