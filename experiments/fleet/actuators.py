"""One row per actuator: its last log, and the trend of its worst severity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

from experiments.fleet.outlook import Outlook, outlook_of
from experiments.fleet.rows import RANKS, LogRow
from faults.trend.trend import FEWEST

CALM_STATES = ("open", "within")
"""States of a last log with a verdict in which an alarm tells something new."""


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
        """Outlook for the worst severity of the last log; None if there are too few logs.

        If that one raises no alarm but others do, it is the outlook for the one that reaches its limit first.
        """
        worst = self.last.worst
        if worst is None or len(self.logs) < FEWEST:
            return None
        found = outlook_of(self.logs, worst.name, self.maintained)
        if self.last.state not in CALM_STATES or (found is not None and found.alarm):
            return found
        others = (outlook_of(self.logs, name, self.maintained) for name in self.last.amounts if name != worst.name)
        nearing = [one for one in others if one is not None and one.alarm]
        return min(nearing, key=lambda one: one.left[1] if one.left else 0.0, default=found)

    @cached_property
    def state(self) -> str:
        """The state of the last log, or an alarm if it is within its limits but is not expected to stay there."""
        calm = self.last.state in CALM_STATES
        return "alarm" if calm and self.outlook is not None and self.outlook.alarm else self.last.state

    @property
    def deciding(self) -> str:
        """Name of the severity that decides: the one that raises the alarm, else the worst; empty if there is none."""
        if self.state == "alarm" and self.outlook is not None:
            return self.outlook.name
        return self.last.worst.name if self.last.worst else ""

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
