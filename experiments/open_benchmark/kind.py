"""Kind of a log: its peculiarity, its random draw, and the expected answer."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experiments.open_benchmark.drives import OPEN
from experiments.open_benchmark.setup import Setup
from faults.conditions import CONDITIONS

OWN_CONDITION = "condition"
"""Among the right verdicts, stands for the log's own condition."""

UNKNOWN = "unknown"

OWN_OR_UNKNOWN = (OWN_CONDITION, UNKNOWN)
"""Both the condition and unknown are right."""

Draw = Callable[[Setup, np.random.Generator], Setup]


def unchanged(setup: Setup, rng: np.random.Generator) -> Setup:
    """Return a setup unchanged."""
    del rng
    return setup


@dataclass(frozen=True)
class Kind:
    """A kind of log.

    Parameters
    ----------
    name : str
        Name of its set.
    strange : str
        The peculiarity in words, for the truth's notes.
    draw : callable
        Function from a plain setup to a setup of this kind.
    accept : tuple of str
        Right verdicts: conditions, `OWN_CONDITION`, `UNKNOWN`.
    named : str
        A regular expression that a tool's messages about a log must match; empty if no message is needed.
    drives : tuple of str
        Drives of the logs, in turn.
    conditions : tuple of str
        Conditions of the logs, in turn.
    severity : bool
        Whether the log has the severities of its condition, if the condition is a right verdict.
    draws_anew : bool
        Whether ``draw`` draws a new machine and keeps only the condition and drive of the plain setup.
    """

    name: str
    strange: str
    draw: Draw = unchanged
    accept: tuple[str, ...] = (OWN_CONDITION,)
    named: str = ""
    drives: tuple[str, ...] = tuple(OPEN)
    conditions: tuple[str, ...] = tuple(CONDITIONS)
    severity: bool = True
    draws_anew: bool = False

    def right_verdicts(self, condition: str) -> tuple[str, ...]:
        """Return the right verdicts for a log in this condition."""
        return tuple(condition if verdict == OWN_CONDITION else verdict for verdict in self.accept)
