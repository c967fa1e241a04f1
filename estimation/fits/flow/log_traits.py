"""`LogTraits`: how a log begins and how it was logged, for the fit of the flow form."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LogTraits:
    """How a log begins, and how its channels were logged.

    Parameters
    ----------
    loaded : bool
        Whether the log begins under load, and not at rest.
    moving : bool
        Whether the motor turns when the log begins. Both chambers may then be at any pressure.
    filtered : bool
        Whether the pressure was filtered. Its delay is then fitted, whatever that gains.
    speed_held : bool
        Whether motor speed was logged at a lower rate than the rest. If the plain form does not explain such a log, the
        course of the speed is the likely cause, and no hypotheses are tested.
    averaged : int
        Rows of which each pressure is the mean, 1 if it was not averaged [count].
    """

    loaded: bool = False
    moving: bool = False
    filtered: bool = False
    speed_held: bool = False
    averaged: int = 1


AT_REST = LogTraits()
"""A log that begins at rest, with each channel sampled in every row and unfiltered."""
