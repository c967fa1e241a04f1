"""Verdict of the fitted circuit and the filter banks on a log, as `faults.diagnosis.diagnose` builds it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from estimation.finding import Quantity
from faults.diagnosis.evidence import Scoreboard
from faults.diagnosis.severity import KnownFriction, KnownLosses
from faults.notes import AgainstCode
from plant.notes import Note


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Verdict of the fitted circuit and the filter banks at the end of a log.

    Parameters
    ----------
    probabilities : Mapping[str, float]
        Of each of the nine conditions, see `estimation.finding.Finding` [probability].
    against : tuple of Note
        Reasons against all nine.
    severity : Mapping[str, Quantity]
        Severities, by the names of `faults.diagnosis.severity.UNITS` [each in the unit given there].
    healthy : Mapping[str, float]
        The same for the healthy actuator [each in the same unit].
    limits : Mapping[str, float]
        Their limits, from `faults.diagnosis.severity.limits_of` [each in the same unit].
    not_told : tuple of Note
        What the log does not determine.
    scoreboard : Scoreboard
        The evidences, and the circuit that was fitted.
    severities_given : callable, optional
        ``severities_given(losses, rubbing)``: its severities if leakage and flow bias, or friction, are known from
        elsewhere.
    """

    probabilities: Mapping[str, float]
    against: tuple[Note, ...]
    severity: Mapping[str, Quantity]
    healthy: Mapping[str, float]
    limits: Mapping[str, float]
    not_told: tuple[Note, ...]
    scoreboard: Scoreboard
    severities_given: Callable[[KnownLosses | None, KnownFriction | None], Mapping[str, Quantity]] | None = None

    @property
    def condition(self) -> str:
        """The most probable of the nine conditions."""
        return max(self.probabilities, key=lambda name: self.probabilities[name])

    @property
    def circuit_follows(self) -> bool:
        """Whether the circuit follows the log closely enough."""
        return all(note.code is not AgainstCode.UNEXPLAINED for note in self.against)

    @property
    def unknown(self) -> bool:
        """Whether there is a reason against all nine."""
        return bool(self.against)
