"""What an estimate of bulk modulus is: a number with its interval and verdict, or the outcome that stands instead."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from estimation.consistency import Gate
from estimation.run import Estimate
from estimation.tuning import Tuning

LARGEST_BOUND = 0.03
"""Relative Cramér-Rao bound above which bulk modulus is called not observable (errata E13) [fraction]."""

NORMAL_95 = 1.959963984540054
"""Half-width of a 95 % normal interval, in standard deviations."""


class Outcome(StrEnum):
    """How a log fared; the words that JSON prints."""

    OK = "ok"
    NOT_OBSERVABLE = "not_observable"
    MISMATCH = "mismatch"
    DIVERGED = "diverged"
    FAILED = "failed"


OUTCOMES: Mapping[Outcome, str] = {
    Outcome.OK: "The result stands, with the interval and the gate's verdict beside it.",
    Outcome.NOT_OBSERVABLE: (
        "This drive and these sensors hold too little about bulk modulus: the Cramér-Rao bound is over 3 %. "
        "Log differential pressure, or drive with larger, slower steps."
    ),
    Outcome.MISMATCH: (
        "The log is nothing like what the model does, so no number is given: the residuals are ten times larger than "
        "expected or more, or the estimate ran into its physical bound. Check units, rig and condition; log pressure."
    ),
    Outcome.DIVERGED: "The estimate stopped being finite; check units, rig parameters and the form.",
    Outcome.FAILED: "The log could not be read or used; the message says why.",
}
"""What each outcome means, as a sentence for a reader."""


@dataclass(frozen=True, eq=False)
class BulkModulusEstimate:
    """Effective bulk modulus of a log.

    Parameters
    ----------
    outcome : Outcome
        How it went.
    value : float or None
        Effective bulk modulus, convention of equation 5.8 (errata E2) [Pa]; None unless the outcome is ok.
    std : float or None
        Its standard deviation, from the log's noise and from what is not known of the rig [Pa].
    bound : float
        Relative Cramér-Rao bound [fraction].
    gate : Gate
        Whether value and interval can be believed.
    form : str
        What was believed of the actuator: ``flow``, ``motion``, ``pressure`` or ``acceleration``.
    channels : tuple of str
        Channels that were used beside motor speed.
    nis : Mapping[str, float]
        Mean squared normalised residual of each predicted channel; 1 where the model explains the log [dimensionless].
    others : Mapping[str, tuple of float]
        What was estimated along with it: value and standard deviation in SI, by parameter name.
    estimate : Estimate or None
        The filtered log, where a filter was used.
    first_pass : Estimate or None
        The pass that began at the first guess; the same one unless a second, begun where it ended, was likelier.
    rig_std : float
        The rig's part of the deviation [Pa]; zero where the rig has no uncertainties.
    tuning : Tuning or None
        Noise levels, where they were tuned to the log.
    method : str
        How it was estimated: ``least-squares``, or a filter of `estimation.run.METHODS`.
    """

    outcome: Outcome
    value: float | None
    std: float | None
    bound: float
    gate: Gate
    form: str
    channels: tuple[str, ...]
    nis: Mapping[str, float]
    others: Mapping[str, tuple[float, float]]
    estimate: Estimate | None
    first_pass: Estimate | None
    rig_std: float = 0.0
    tuning: Tuning | None = None
    method: str = "least-squares"

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval [Pa], or None where there is no value."""
        if self.value is None or self.std is None:
            return None
        return self.value - NORMAL_95 * self.std, self.value + NORMAL_95 * self.std


def too_wide(bound: float) -> str:
    """Return the sentence for a bound that is over the largest.

    Parameters
    ----------
    bound : float
        Relative Cramér-Rao bound of bulk modulus [fraction].

    Returns
    -------
    str
        The sentence.
    """
    return f"the Cramér-Rao bound is {100.0 * min(bound, 9.99):.0f} % of the value, over 3 %: not observable"
