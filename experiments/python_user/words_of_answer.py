"""Display of an answer. It is looked up by actuator and verb name, so that answers can be pickled."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.finding import Finding
    from experiments.actuator_kind import LogVerb
    from plant.eha.rig import Rig
    from plant.errors import LogWarning
    from plant.log.record import Record


@dataclass(frozen=True, eq=False)
class Words:
    """Data for the page and the terminal output of an answer.

    Parameters
    ----------
    plant, verb : str
        Kind of actuator, and the verb that was run.
    options : Mapping[str, Any]
        The verb's options.
    rig : Rig
        What the log was compared with.
    record : Record
        The log.
    said : sequence of LogWarning
        Remarks from reading the log.
    """

    plant: str
    verb: str
    options: Mapping[str, Any]
    rig: "Rig[Any]"
    record: "Record"
    said: "Sequence[LogWarning]"

    def _chosen(self) -> "LogVerb":
        from experiments.actuators import actuator, verb_of_kind

        return verb_of_kind(actuator(self.plant), self.verb)

    def screen(self, rows: Sequence[Mapping[str, Any]]) -> "Iterable[RenderableType]":
        """Return the terminal output for entries."""
        return self._chosen().screen(rows, self.options)

    def page(self, found: "Finding", entries: Mapping[str, Any], title: str) -> str:
        """Return the page of the log, as HTML."""
        from experiments.command.log_verb import page_of
        from experiments.command.logs import with_remarks

        about = {"file": title, "plant": self.plant, "rig": self.rig.name, "seed": 2024, "expected": None}
        return page_of(self._chosen(), with_remarks({**about, **entries}, self.said), found, self.record, self.rig)
