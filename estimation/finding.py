"""The finding: the result of a log for an actuator. Estimate, diagnosis, batch, page and stream are views of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from plant.notes import Note, distinct

if TYPE_CHECKING:
    from estimation.trust.whiteness import Whiteness

NORMAL_95 = 1.959963984540054
"""Half-width of a 95 % normal interval, in standard deviations."""

LARGE, WIDEST = 0.03, 100.0
"""Relative deviation above which the interval of a positive quantity is computed on its logarithm [fraction], and the
largest half-width on that logarithm, so that numbers stay finite [dimensionless]."""


def interval_95(value: float, std: float) -> tuple[float, float]:
    """Return a 95 % normal interval.

    Parameters
    ----------
    value : float
        Its centre [any unit].
    std : float
        Standard deviation [the same unit].

    Returns
    -------
    tuple of float
        Lower and upper end.
    """
    return value - NORMAL_95 * std, value + NORMAL_95 * std


def positive_interval_95(value: float, std: float) -> tuple[float, float]:
    """Return a 95 % interval of a positive quantity: on a logarithmic scale if it is wide.

    Parameters
    ----------
    value : float
        Its centre, positive [any unit].
    std : float
        Standard deviation [the same unit].

    Returns
    -------
    tuple of float
        Lower and upper end, both positive; those of `interval_95` for a deviation of `LARGE` or less, at which the two
        differ by 0.2 % of the value at most.

    Examples
    --------
    >>> [round(end, 1) for end in positive_interval_95(200.0, 4.0)]
    [192.2, 207.8]
    >>> [round(end, 1) for end in positive_interval_95(200.0, 200.0)]
    [28.2, 1419.8]
    """
    if not std > LARGE * value > 0.0:
        return interval_95(value, std)
    factor = math.exp(min(NORMAL_95 * std / value, WIDEST))
    return value / factor, value * factor


class Outcome(StrEnum):
    """Outcome of a log; its values are the words printed in JSON."""

    OK = "ok"
    NOT_OBSERVABLE = "not_observable"
    MISMATCH = "mismatch"
    DIVERGED = "diverged"
    FAILED = "failed"


NOT_OBSERVABLE_WITH_PRESSURE = (
    "With this drive, bulk modulus is not observable although differential pressure was used: the Cramér-Rao bound is "
    "over 3 %. Drive with larger, slower steps."
)
"""Meaning of that outcome for a log with pressure."""

OUTCOMES: Mapping[Outcome, str] = {
    Outcome.OK: "The result is given, with its interval and the verdict of the consistency check.",
    Outcome.NOT_OBSERVABLE: (
        "With this drive and these sensors, bulk modulus is not observable: the Cramér-Rao bound is over 3 %. "
        "Log differential pressure, or drive with larger, slower steps."
    ),
    Outcome.MISMATCH: (
        "The model does not describe the log, so no number is given: the residuals are at least ten times as large as "
        "expected, or the estimate reached its physical limit. Check units, rig file and condition; log pressure."
    ),
    Outcome.DIVERGED: "The estimate stopped being finite; check units, rig parameters and the form of the model.",
    Outcome.FAILED: "The log could not be read or used; the message says why.",
}
"""Meaning of each outcome, as a sentence."""


@dataclass(frozen=True)
class Quantity:
    """One number with its interval.

    Parameters
    ----------
    value : float or None
        The estimate [in its unit]; None if the log does not determine it.
    unit : str
        The unit; ``"1"`` for a number without one.
    ci95 : tuple of float, optional
        Ends of its 95 % interval if the rig file is right [in its unit].
    std : float, optional
        Its standard deviation, likewise [in its unit].
    ci95_total : tuple of float, optional
        Limits of its 95 % interval including the rig's uncertainty [in its unit]; None if it was not computed.

    Examples
    --------
    >>> print(Quantity(2.068e8, "Pa", (2.061e8, 2.076e8)))
    2.068e+08 (2.061e+08 to 2.076e+08) Pa
    >>> {"flow": Quantity(6.04, "L/min", (6.02, 6.06))}
    {'flow': <6.04 (6.02 to 6.06) L/min>}
    """

    value: float | None
    unit: str
    ci95: tuple[float, float] | None = None
    std: float | None = None
    ci95_total: tuple[float, float] | None = None

    def __str__(self) -> str:
        """Return the value with its 95 % interval and its unit, for a reader."""
        if self.value is None:
            return "not determined"
        within = "" if self.ci95 is None else f" ({self.ci95[0]:.4g} to {self.ci95[1]:.4g})"
        return f"{self.value:.4g}{within} {self.unit}"

    def __repr__(self) -> str:
        """Return the same in brackets, for mappings of quantities at a prompt."""
        return f"<{self}>"

    @staticmethod
    def normal(value: float, std: float, unit: str) -> "Quantity":
        """Return a quantity with the interval of a normal distribution.

        Parameters
        ----------
        value, std : float
            Estimate and standard deviation [in that unit].
        unit : str
            The unit.

        Returns
        -------
        Quantity
            With its 95 % interval.
        """
        return Quantity(value, unit, interval_95(value, std), std)

    def covers(self, truth: float) -> bool:
        """Return whether the interval contains a value.

        Parameters
        ----------
        truth : float
            The value [in its unit].

        Returns
        -------
        bool
            Also False if there is no interval.
        """
        return self.ci95 is not None and self.ci95[0] <= truth <= self.ci95[1]


@dataclass(frozen=True)
class Gate:
    """The verdict on an estimate.

    Parameters
    ----------
    passed : bool
        Whether the estimate and its interval can be believed.
    reasons : tuple of Note
        Reasons against it.
    inflation : float
        Factor by which the standard deviation must grow because the innovations are correlated [dimensionless]; 1 if
        they are not. It is an order of magnitude, right within a factor of about two on plants that the model does not
        describe, where it turns errors of 5 to 400 standard deviations into 0.1 to 3.
    whiteness : tuple of Whiteness
        The innovations of each channel; empty if they were not kept.
    """

    passed: bool
    reasons: tuple[Note, ...]
    inflation: float = 1.0
    whiteness: "tuple[Whiteness, ...]" = ()


@dataclass(frozen=True)
class Change:
    """A change of condition within a log.

    Parameters
    ----------
    since : float
        Time of the change [s].
    ci95 : tuple of float
        Its 95 % interval [s].
    before : str
        Condition before the change.
    """

    since: float
    ci95: tuple[float, float]
    before: str


@dataclass(frozen=True, eq=False)
class Finding:
    """Finding about an actuator at the end of a log.

    Parameters
    ----------
    actuator : str
        Kind of actuator, by its name in the registry.
    outcome : Outcome
        The outcome.
    quantities : Mapping[str, Quantity]
        Estimates, by name.
    gate : Gate
        Whether the quantities can be believed.
    channels : tuple of str
        Channels that were used.
    notes : tuple of Note
        Further notes for the reader: what was left out of the log, what an absent channel costs.
    condition : str or None
        The most probable condition or fault; None if none was requested, or none can be named.
    alike : tuple of str
        Conditions that the log does not distinguish from it.
    probabilities : Mapping[str, float]
        Probability of each condition [probability]. If another fault is as likely and a note names it, they sum to less
        than 1 by its probability; otherwise they hold for a log that is in one of them.
    unknown : bool
        Whether there is an objection to all of them.
    against : tuple of Note
        The objections.
    faults : tuple of Note
        Further faults.
    severities : Mapping[str, Quantity]
        Severities of faults, by name.
    healthy : Mapping[str, float]
        The severities of the healthy actuator [each in the same unit].
    not_told : tuple of Note
        What the log does not determine.
    since : Change or None
        When the condition began; None if it did so before the log.
    advice : tuple of Note
        What to do or measure next.
    evidence : object
        Results of the engines behind it, specific to the actuator.
    """

    actuator: str
    outcome: Outcome
    quantities: Mapping[str, Quantity]
    gate: Gate
    channels: tuple[str, ...]
    notes: tuple[Note, ...] = ()
    condition: str | None = None
    alike: tuple[str, ...] = ()
    probabilities: Mapping[str, float] = field(default_factory=dict[str, float])
    unknown: bool = False
    against: tuple[Note, ...] = ()
    faults: tuple[Note, ...] = ()
    severities: Mapping[str, Quantity] = field(default_factory=dict[str, Quantity])
    healthy: Mapping[str, float] = field(default_factory=dict[str, float])
    not_told: tuple[Note, ...] = ()
    since: Change | None = None
    advice: tuple[Note, ...] = ()
    evidence: Any = field(default=None, repr=False)

    @property
    def named(self) -> tuple[str, ...]:
        """The condition and those that cannot be distinguished from it; empty if none is named."""
        return () if self.condition is None else (self.condition, *self.alike)

    @property
    def all_notes(self) -> tuple[Note, ...]:
        """Every note, once: on the gate, the class, other faults, undetermined quantities, the log, and advice."""
        groups = (self.gate.reasons, self.against, self.faults, self.not_told, self.notes, self.advice)
        return distinct(note for group in groups for note in group)
