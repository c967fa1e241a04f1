"""One row an actuator: its last log, and how many there are."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from experiments.fleet.rows import LogRow


@dataclass(frozen=True)
class ActuatorRow:
    """An actuator with its logs, or a log whose actuator is not known.

    Parameters
    ----------
    name : str
        Of the actuator, or of the log's file.
    logs : tuple of LogRow
        By date, the last one last.
    """

    name: str
    logs: tuple[LogRow, ...]

    @cached_property
    def last(self) -> LogRow:
        """The last log that could be read, else the last one."""
        read = [one for one in self.logs if one.state != "failed"]
        return (read or self.logs)[-1]


def actuator_rows(logs: Sequence[LogRow]) -> list[ActuatorRow]:
    """Return the actuators of a fleet, the sickest first.

    Parameters
    ----------
    logs : sequence of LogRow
        In any order; logs of one actuator without a date stay in their order.

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
        ActuatorRow(name, tuple(sorted(group, key=lambda one: one.named.place or 0.0)))
        for (_, name), group in groups.items()
    ]
    return sorted(rows, key=lambda row: row.last.order)
