"""Pages of logs or models: where each is written, and why some are missing."""

from collections.abc import Mapping
from pathlib import Path
from typing import Generic, TypeVar

from experiments.command.json_output import write_whole
from experiments.command.output_paths import pages_sentence
from experiments.command.terminal import note
from plant.errors import HydrostateError

Owner = TypeVar("Owner", Path, str)


class Pages(Generic[Owner]):
    """Pages that a command writes in addition to its answer.

    Parameters
    ----------
    places : Mapping[Path or str, Path]
        Path of the page, by log or by output of a model.
    """

    def __init__(self, places: Mapping[Owner, Path]) -> None:
        self.places = places
        self.written: list[Path] = []
        self.unwritten: list[str] = []

    def write(self, owner: Owner, page: str) -> None:
        """Write a page; if this fails, the error is reported at the end, and the answer is still shown."""
        try:
            write_whole(self.places[owner], page, "--report")
            self.written.append(self.places[owner])
        except HydrostateError as error:
            self.unwritten.append(str(error))

    def tell(self) -> None:
        """Print where the pages are, then why any missing one could not be written."""
        for said in [*([pages_sentence(self.written)] if self.written else []), *self.unwritten]:
            note(said)
