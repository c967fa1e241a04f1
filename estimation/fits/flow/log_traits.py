"""`LogTraits`: how a log begins and how it was logged, for the fit of the flow form."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LogTraits:
    """Traits of a log that a fit has to know: how it begins, and how its channels were logged.

    Parameters
    ----------
    loaded : bool
        Whether the log begins under load, and not at rest.
    moving : bool
        Whether the motor turns when it begins: both chambers may then stand at any pressure.
    filtered : bool
        Whether the pressure was filtered: it is then late, and by how much is fitted whatever that gains.
    speed_held : bool
        Whether motor speed came slower than the rest: of a log that the plain form does not explain the motor's course
        is then what is not known, and nothing is asked.
    """

    loaded: bool = False
    moving: bool = False
    filtered: bool = False
    speed_held: bool = False


AT_REST = LogTraits()
"""A log that begins at rest, each channel sampled in every row and as it is."""
