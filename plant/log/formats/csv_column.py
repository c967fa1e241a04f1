"""A column of a text log during reading. The whole column decides what its points and commas mean."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from plant.log.columns import Column
from plant.log.formats.cells import MISSING, MOST_STRANGE
from plant.log.formats.thousands import is_grouped, thousands_error, without_thousands

_PARTS = re.compile(r"[.,]")
_DECIMAL = re.compile(r"[-+]?\d*,\d+")


@dataclass
class Cells:
    """A column during reading.

    Parameters
    ----------
    values : array of float, or list of str
        What its rows hold.
    bad : dict[int, str]
        Cells that are no numbers, by their row from 0.
    parted : dict[int, str]
        Numbers with the sign that is no decimal sign of the log, and with no other.
    parts_thousands : bool
        Whether another number of the column has that sign and can be nothing but whole thousands.
    """

    values: Any
    bad: dict[int, str] = field(default_factory=dict[int, str])
    parted: dict[int, str] = field(default_factory=dict[int, str])
    parts_thousands: bool = False

    def note_parted(self, cells: Sequence[str], first: int, point: str) -> None:
        """Keep numbers of further rows that may contain separators of thousands.

        Parameters
        ----------
        cells : sequence of str
            Of those rows.
        first : int
            The first of them, from 0.
        point : str
            Decimal sign of the log.
        """
        other = "," if point == "." else "."
        for place, cell in enumerate(cells):
            if other not in cell or (plain := cell.strip()) in MISSING:
                continue
            if without_thousands(plain, point) is not None:
                self.parts_thousands = True
            elif point not in plain:
                self.parted[first + place] = plain

    def settle(self, column: Column, point: str, source: str) -> None:
        """Read the numbers that were kept: as thousands if another number of the column can be nothing else.

        If none can, a column with another decimal sign than the log's is read so, where all beside are whole numbers.

        Parameters
        ----------
        column : Column
            The column, for messages.
        point : str
            Decimal sign of the log.
        source : str
            What messages call the log.

        Raises
        ------
        LogError
            If points may part thousands or decimals.
        """
        thousands = [row for row, cell in self.parted.items() if is_grouped(cell)]
        if self.parts_thousands:
            for row in thousands:
                self.values[row] = float(_PARTS.sub("", self.parted[row]).replace("\u2212", "-"))
                self.bad.pop(row, None)
            self.bad.update({row: cell for row, cell in self.parted.items() if not is_grouped(cell)})
        elif len(thousands) < len(self.parted):
            if point == "." and self.bad.keys() == self.parted.keys() and self._has_other_decimal_sign():
                for row, cell in self.parted.items():
                    self.values[row] = float(cell.replace(",", "."))
                self.bad.clear()
        elif thousands and point == ",":
            raise thousands_error(column.name, self.parted[thousands[0]], source)

    def _has_other_decimal_sign(self) -> bool:
        """Return whether many cells are decimals with the other decimal sign, and all others whole numbers."""
        many = len(self.parted) > MOST_STRANGE * len(self.values)
        if not many or not all(map(_DECIMAL.fullmatch, self.parted.values())):
            return False
        known = np.array(self.values)
        known = known[np.isfinite(known)]
        return bool((known == np.trunc(known)).all())
