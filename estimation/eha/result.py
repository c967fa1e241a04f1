"""Estimate of bulk modulus: a number with its interval and verdict, or an outcome instead of a number."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

from estimation.eha.rig_share import Responses, rig_notes, with_total
from estimation.filters.run import Estimate
from estimation.finding import Gate, Outcome, Quantity, positive_interval_95
from estimation.fits.greybox.pump_ripple import NO_RIPPLE, Turning
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.notes import EstimateCode
from plant.eha.doubts import Spread
from plant.notes import Note

if TYPE_CHECKING:
    from estimation.tuning.tuning import Tuning

LARGEST_BOUND = 0.03
"""Relative Cramér-Rao bound above which bulk modulus is called not observable (errata E13) [fraction]."""

VAGUE_DEVIATION = 0.5
"""Relative standard deviation above which a value is not reported, whatever its bound [fraction]; judged. If a model
chatters, the bound may vanish: a log of chambers that leak empty within a sample had 147 % beside a bound of 1e-9."""


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
        Its standard deviation due to the log's noise, if the rig file is right [Pa].
    bound : float
        Relative Cramér-Rao bound [fraction].
    gate : Gate
        Whether value and interval can be believed.
    form : str
        The process model: ``flow``, ``motion``, ``pressure`` or ``acceleration``.
    channels : tuple of str
        Channels that were used beside motor speed.
    nis : Mapping[str, float]
        Mean squared normalised residual of each predicted channel; 1 if the model explains the log [dimensionless].
    others : Mapping[str, tuple of float]
        Further estimates: value and standard deviation in SI, by parameter name.
    estimate : Estimate or None
        The filtered log, if a filter was used.
    first_pass : Estimate or None
        The pass that began at the first guess; the same one unless a second was likelier.
    responses : Mapping[str, Responses]
        Response of bulk modulus and the others to the rig's entries, by quantity [dimensionless].
    spreads : Mapping[str, Spread]
        Uncertainty of each entry of the rig.
    tuning : Tuning or None
        Noise levels, if they were tuned to the log.
    explanation : Explanation or None
        The effects of rig, oil or logger that explain the log, if any were needed.
    remarks : tuple of Note
        What the log leaves undecided, which is no objection to the estimate.
    method : str
        How it was estimated: ``least-squares``, a filter of `estimation.filters.methods.METHODS`, or a method of
        `estimation.eha.named_methods.NAMED`.
    turning : Turning
        Pump ripple and offset of the speed that were corrected.
    mean_late : float
        How late an averaged pressure is logged after the middle of its rows [s].
    correlation : float
        Correlation of the errors of leakage coefficient and flow bias, if a fit balances flows [dimensionless].
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
    estimate: Estimate | None = None
    first_pass: Estimate | None = None
    responses: Mapping[str, Responses] = field(default_factory=lambda: MappingProxyType({}))
    spreads: Mapping[str, Spread] = field(default_factory=lambda: MappingProxyType({}))
    tuning: "Tuning | None" = None
    explanation: Explanation | None = None
    remarks: tuple[Note, ...] = ()
    method: str = "least-squares"
    turning: Turning = NO_RIPPLE
    mean_late: float = 0.0
    correlation: float = 0.0

    @property
    def quantity(self) -> Quantity:
        """Bulk modulus with its intervals."""
        return self.with_total("bulk_modulus", Quantity(self.value, "Pa", self.interval, self.std))

    @property
    def rig_notes(self) -> tuple[Note, ...]:
        """Notes for a bulk modulus that is known only as well as the rig."""
        return rig_notes("bulk_modulus", self.quantity, self.responses.get("bulk_modulus", {}), self.spreads)

    def with_total(self, name: str, one: Quantity) -> Quantity:
        """Return a quantity with its total interval, which includes the rig's uncertainty.

        Parameters
        ----------
        name : str
            Its name.
        one : Quantity
            With the interval that holds if the rig file is right [in its unit].
        """
        return with_total(one, self.responses.get(name), self.spreads)

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval if the rig file is right [Pa], or None if there is no value."""
        if self.value is None or self.std is None:
            return None
        return positive_interval_95(self.value, self.std)


def is_vague(value: float, std: float | None, share: float = VAGUE_DEVIATION) -> bool:
    """Return whether a value is too uncertain to be reported.

    Parameters
    ----------
    value : float
        The value [in its unit].
    std : float or None
        Its standard deviation [in its unit]; None if unknown.
    share : float
        Limit of the relative standard deviation [fraction].

    Examples
    --------
    >>> is_vague(2e8, 1.2e8), is_vague(2e8, 9e7), is_vague(2e8, 9e7, 0.1), is_vague(2e8, None)
    (True, False, True, True)
    """
    return std is None or not std <= share * abs(value)


def wide_bound_note(bound: float) -> Note:
    """Return the note for a bound above the limit.

    Parameters
    ----------
    bound : float
        Relative Cramér-Rao bound of bulk modulus [fraction].
    """
    return EstimateCode.BOUND_TOO_WIDE.note(percent=100.0 * min(bound, 9.99))


def without_number(
    outcome: Outcome, reasons: tuple[Note, ...], form: str, channels: tuple[str, ...], bound: float = float("nan")
) -> BulkModulusEstimate:
    """Return an estimate without a number.

    Parameters
    ----------
    outcome : Outcome
        Its outcome.
    reasons : tuple of Note
        The reasons.
    form : str
        The process model.
    channels : tuple of str
        Channels that were examined beside motor speed.
    bound : float
        Relative Cramér-Rao bound [fraction]; NaN where it was not asked for.
    """
    return BulkModulusEstimate(
        outcome=outcome,
        value=None,
        std=None,
        bound=bound,
        gate=Gate(False, reasons),
        form=form,
        channels=channels,
        nis={},
        others={},
    )
