"""One row per actuator: its last log, and the trend of its worst severity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

from experiments.fleet.outlook import Outlook, outlook_of
from experiments.fleet.rows import RANKS, LogRow
from faults.trend.trend import FEWEST


@dataclass(frozen=True)
class ActuatorRow:
    """An actuator with its logs, or a log of an unknown actuator.

    Parameters
    ----------
    name : str
        Name of the actuator, or of the log's file.
    logs : tuple of LogRow
        In order of date, the latest last.
    maintained : tuple of float
        Times of repairs, in the form of `experiments.fleet.naming.place_of` [day].
    """

    name: str
    logs: tuple[LogRow, ...]
    maintained: tuple[float, ...] = ()

    @cached_property
    def last(self) -> LogRow:
        """The last log that could be read; if none could, the last log."""
        read = [one for one in self.logs if one.state != "failed"]
        return (read or self.logs)[-1]

    @cached_property
    def outlook(self) -> Outlook | None:
        """Outlook for the worst severity of the last log; None if there are too few logs."""
        if self.last.worst is None or len(self.logs) < FEWEST:
            return None
        return outlook_of(self.logs, self.last.worst.name, self.maintained)

    @cached_property
    def state(self) -> str:
        """The state of the last log, or an alarm if it is within its limits but is not expected to stay there."""
        growing = self.last.has_verdict and self.outlook is not None and self.outlook.alarm
        return "alarm" if growing and self.last.state in ("open", "within", "unknown") else self.last.state

    @property
    def order(self) -> tuple[int, float]:
        """Sort key: the sickest first."""
        return RANKS[self.state], self.last.order[1]


def actuator_rows(
    logs: Sequence[LogRow], maintained: Mapping[str, Sequence[float]] = MappingProxyType({})
) -> list[ActuatorRow]:
    """Return the actuators of a fleet, the sickest first.

    Parameters
    ----------
    logs : sequence of LogRow
        In any order; undated logs of one actuator keep their order.
    maintained : Mapping[str, sequence of float]
        Times of repairs, by actuator name [day].

    Returns
    -------
    list of ActuatorRow
        A log of an unknown actuator has its own row.
    """
    groups: dict[tuple[str, str], list[LogRow]] = {}
    for one in logs:
        known = one.named.actuator
        groups.setdefault(("actuator", known) if known else ("file", one.file), []).append(one)
    rows = [
        ActuatorRow(name, tuple(sorted(group, key=lambda one: one.named.place or 0.0)), tuple(maintained.get(name, ())))
        for (_, name), group in groups.items()
    ]
    return sorted(rows, key=lambda row: row.order)
