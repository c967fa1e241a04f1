"""One row an actuator: its last log, and how its worst severity develops."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

from experiments.fleet.outlook import Outlook, outlook_of
from experiments.fleet.rows import RANKS, LogRow
from faults.trend.trend import FEWEST


@dataclass(frozen=True)
class ActuatorRow:
    """An actuator with its logs, or a log whose actuator is not known.

    Parameters
    ----------
    name : str
        Of the actuator, or of the log's file.
    logs : tuple of LogRow
        By date, the last one last.
    maintained : tuple of float
        When it was repaired, as `experiments.fleet.naming.place_of` gives dates [day].
    """

    name: str
    logs: tuple[LogRow, ...]
    maintained: tuple[float, ...] = ()

    @cached_property
    def last(self) -> LogRow:
        """The last log that could be read, else the last one."""
        read = [one for one in self.logs if one.state != "failed"]
        return (read or self.logs)[-1]

    @cached_property
    def outlook(self) -> Outlook | None:
        """Outlook of the worst severity of the last log; None for a few logs."""
        if self.last.worst is None or len(self.logs) < FEWEST:
            return None
        return outlook_of(self.logs, self.last.worst.name, self.maintained)

    @cached_property
    def state(self) -> str:
        """That of the last log, or an alarm where it is within its limits and will not stay so."""
        growing = self.last.told and self.outlook is not None and self.outlook.alarm
        return "alarm" if growing and self.last.state in ("open", "within", "unknown") else self.last.state

    @property
    def order(self) -> tuple[int, float]:
        """The sickest first."""
        return RANKS[self.state], self.last.order[1]


def actuator_rows(
    logs: Sequence[LogRow], maintained: Mapping[str, Sequence[float]] = MappingProxyType({})
) -> list[ActuatorRow]:
    """Return the actuators of a fleet, the sickest first.

    Parameters
    ----------
    logs : sequence of LogRow
        In any order; logs of one actuator without a date stay in their order.
    maintained : Mapping[str, sequence of float]
        When actuators were repaired, by name [day].

    Returns
    -------
    list of ActuatorRow
        A log whose actuator is not known stands alone.
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
