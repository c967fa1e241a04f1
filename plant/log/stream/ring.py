"""Rows of numbers in a ring: a file, best in shared memory, that one program writes and another reads as it grows.

Layout, little-endian: at 0 the magic ``HYDRING1``; at 8 columns and at 12 slots (32 bits each); at 16 rows written and
at 24 rows read (64 bits each); at 32 whether it has ended and at 36 how many bytes the header has (32 bits each); at
64 the header, a line of CSV. Rows stand from 4096 on, each of so many doubles, row n in slot ``n mod slots``. A row
counts as written when its numbers are there.

A writer that must not wait writes over the oldest rows; those that the reader had not taken are counted there as lost.
One that may wait does so until there is room: that is back-pressure. No row can come late, since the rows are in order.
"""

import mmap
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.errors import HydrostateError, LogError

MAGIC, ROWS_AT, HEADER_AT = b"HYDRING1", 4096, 64
COLUMNS_AT, WRITTEN_AT, READ_AT, ENDED_AT, LENGTH_AT = 8, 16, 24, 32, 36

PAUSE = 2e-3
"""Time between two looks where nothing is new [s]."""

MOST_ROWS = 4096
"""Rows that are taken at a time."""


def _whole(held: mmap.mmap, place: int) -> int:
    return int(struct.unpack_from("<Q", held, place)[0])


class RingWriter:
    """Writes rows into a ring file, and replaces an older file.

    Parameters
    ----------
    path : Path
        The file; on Linux a name under ``/dev/shm`` is in memory.
    header : str
        Names of the columns, separated by commas.
    slots : int
        Rows that it holds: at least what comes while the reader is away.

    Raises
    ------
    HydrostateError
        If the header is too long, there are too few slots, or the file cannot be written.
    """

    def __init__(self, path: Path, header: str, slots: int) -> None:
        text = header.encode()
        if not 0 < len(text) <= ROWS_AT - HEADER_AT or slots < 2:
            raise HydrostateError(f"a ring needs a header of 1 to {ROWS_AT - HEADER_AT} bytes and two slots or more")
        columns = header.count(",") + 1
        try:
            path.unlink(missing_ok=True)  # a reader of the old file keeps it
            with path.open("xb+") as file:
                file.truncate(ROWS_AT + 8 * columns * slots)
                self._held = mmap.mmap(file.fileno(), 0)
        except OSError as error:
            raise HydrostateError(f"{path}: the ring cannot be written: {error.strerror or error}") from error
        self._rows = np.frombuffer(self._held, np.float64, columns * slots, ROWS_AT).reshape(slots, columns)
        self.written = 0
        """Rows written so far."""
        struct.pack_into("<II", self._held, COLUMNS_AT, columns, slots)
        struct.pack_into("<I", self._held, LENGTH_AT, len(text))
        self._held[HEADER_AT : HEADER_AT + len(text)] = text
        self._held[: len(MAGIC)] = MAGIC

    def room(self) -> int:
        """Return the number of rows that can be written before an unread row is lost."""
        return len(self._rows) - 1 - (self.written - _whole(self._held, READ_AT))

    def write(self, rows: Array, *, wait: bool = False) -> None:
        """Write rows.

        Parameters
        ----------
        rows : ndarray, shape (n, columns)
            Values, in the units that the header names.
        wait : bool
            Whether to wait for the reader where there is no room.
        """
        for row in rows:
            while wait and self.room() < 1:
                time.sleep(PAUSE)
            self._rows[self.written % len(self._rows)] = row
            self.written += 1
            struct.pack_into("<Q", self._held, WRITTEN_AT, self.written)

    def __enter__(self) -> "RingWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        struct.pack_into("<I", self._held, ENDED_AT, 1)
        del self._rows
        self._held.close()


class RingReader:
    """Reads rows of a ring as they arrive, from the position of its last reader.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    LogError
        If it is no ring.
    """

    def __init__(self, path: Path) -> None:
        try:
            with path.open("rb+") as file:
                self._held = mmap.mmap(file.fileno(), 0)
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            raise LogError(f"the ring cannot be read: {why}", str(path)) from error
        if len(self._held) < ROWS_AT or self._held[: len(MAGIC)] != MAGIC:
            raise LogError("a ring is needed, the file is none", str(path))
        columns, slots = struct.unpack_from("<II", self._held, COLUMNS_AT)
        (length,) = struct.unpack_from("<I", self._held, LENGTH_AT)
        if not columns or not slots or len(self._held) != ROWS_AT + 8 * columns * slots or length > ROWS_AT - HEADER_AT:
            raise LogError(f"a ring of {columns} columns and {slots} rows has another size than the file", str(path))
        self.header = self._held[HEADER_AT : HEADER_AT + length].decode("utf-8", errors="replace")
        self._slots = np.frombuffer(self._held, np.float64, columns * slots, ROWS_AT).reshape(slots, columns)
        self.lost = 0
        """Rows that were written over before they were read."""

    def take(self) -> NDArray[np.float64]:
        """Return the new rows, shape (n, columns); empty if there are none."""
        size, begin, written = len(self._slots), _whole(self._held, READ_AT), _whole(self._held, WRITTEN_AT)
        oldest = max(begin, written - size + 1)  # the row before may be in the middle of being overwritten
        end = min(written, oldest + MOST_ROWS)
        rows = self._slots[np.arange(oldest, end) % size]
        # older rows were overwritten while they were read
        kept = min(end, max(oldest, _whole(self._held, WRITTEN_AT) - size + 1))
        self.lost += kept - begin
        struct.pack_into("<Q", self._held, READ_AT, end)
        return rows[kept - oldest :]

    @property
    def ended(self) -> bool:
        """Whether the stream has ended."""
        over = bool(struct.unpack_from("<I", self._held, ENDED_AT)[0])
        return over and _whole(self._held, READ_AT) == _whole(self._held, WRITTEN_AT)


def ring_lines(path: Path, lost: Callable[[int, int], None]) -> Iterator[str]:
    """Yield header and rows of a ring as lines of CSV, as they arrive.

    Parameters
    ----------
    path : Path
        The ring.
    lost : callable
        Is told how many rows were read and lost so far.

    Raises
    ------
    LogError
        If it is no ring.
    """
    reader = RingReader(path)
    yield f"{reader.header}\n"
    count = 0
    while True:
        over, rows = reader.ended, reader.take()
        count += len(rows)
        lost(count, reader.lost)
        for row in rows.tolist():
            yield ",".join("" if value != value else repr(value) for value in row) + "\n"
        if over:
            return
        if not len(rows):
            time.sleep(PAUSE)
