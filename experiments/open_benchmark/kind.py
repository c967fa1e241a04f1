"""Kind of a log: its peculiarity, its random draw, and the expected answer."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experiments.open_benchmark.drives import OPEN
from experiments.open_benchmark.setup import Setup
from faults.conditions import CONDITIONS

OWN = "condition"
"""Stands for the condition that a log is in, among verdicts that are right."""

UNKNOWN = "unknown"

MAYBE = (OWN, UNKNOWN)
"""Right is the condition, and that it is not known."""

Draw = Callable[[Setup, np.random.Generator], Setup]


def unchanged(setup: Setup, rng: np.random.Generator) -> Setup:
    """Return a setup as it is."""
    del rng
    return setup


@dataclass(frozen=True)
class Kind:
    """A kind of log.

    Parameters
    ----------
    name : str
        Of its set.
    strange : str
        What is strange, for the truth's notes.
    draw : callable
        From a plain setup to one of this kind.
    accept : tuple of str
        Verdicts that are right: conditions, `OWN`, `UNKNOWN`.
    named : str
        A regular expression; what a tool says of a log must match it. Empty where nothing need be said.
    drives : tuple of str
        What the logs are driven with, in turn.
    conditions : tuple of str
        Conditions of the logs, in turn.
    severity : bool
        Whether the severities of the condition are those of the log, where its condition is a right verdict.
    draws_anew : bool
        Whether ``draw`` draws another machine, and keeps of the plain setup its condition and drive alone.
    """

    name: str
    strange: str
    draw: Draw = unchanged
    accept: tuple[str, ...] = (OWN,)
    named: str = ""
    drives: tuple[str, ...] = tuple(OPEN)
    conditions: tuple[str, ...] = tuple(CONDITIONS)
    severity: bool = True
    draws_anew: bool = False

    def accepted(self, condition: str) -> tuple[str, ...]:
        """Return the verdicts that are right for a log in this condition."""
        return tuple(condition if verdict == OWN else verdict for verdict in self.accept)
