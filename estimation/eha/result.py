"""What an estimate of bulk modulus is: a number with its interval and verdict, or the outcome that stands instead."""

from collections.abc import Mapping
from dataclasses import dataclass

from estimation.filters.run import Estimate
from estimation.finding import Gate, Outcome, Quantity, interval_95
from estimation.notes import EstimateCode
from estimation.tuning.tuning import Tuning
from plant.notes import Note

LARGEST_BOUND = 0.03
"""Relative Cramér-Rao bound above which bulk modulus is called not observable (errata E13) [fraction]."""


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
        How it was estimated: ``least-squares``, or a filter of `estimation.filters.run.METHODS`.
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
    def quantity(self) -> Quantity:
        """Bulk modulus with its interval."""
        return Quantity(self.value, "Pa", self.interval, self.std)

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval [Pa], or None where there is no value."""
        if self.value is None or self.std is None:
            return None
        return interval_95(self.value, self.std)


def too_wide(bound: float) -> Note:
    """Return the note for a bound that is over the largest.

    Parameters
    ----------
    bound : float
        Relative Cramér-Rao bound of bulk modulus [fraction].

    Returns
    -------
    Note
        The note.
    """
    return EstimateCode.BOUND_TOO_WIDE.note(percent=100.0 * min(bound, 9.99))
