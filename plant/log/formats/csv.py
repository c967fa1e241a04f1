"""CSV logs as numbers: read quickly by pyarrow, or cell by cell to name the cell that is wrong."""

import gzip
import io
import warnings
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, TextIO, cast

import pyarrow as pa
from pyarrow import csv as arrow_csv

from plant.arrays import Array
from plant.errors import LogWarning
from plant.log.clock.stamps import read_stamps
from plant.log.columns import TIME, TRUTH_PREFIX, Column
from plant.log.formats.arrow import from_arrow, to_arrow
from plant.log.formats.cells import MISSING
from plant.log.formats.csv_cells import read_cells
from plant.log.formats.csv_layout import Layout, layout_of
from plant.log.formats.csv_lines import BLANKS, cells_of
from plant.log.formats.lvm_segments import joined_segments
from plant.log.formats.packed import open_unpacked, packing_of
from plant.log.formats.thousands import may_group_thousands, require_none_grouped
from plant.log.notes import LogCode
from plant.log.table import Table

_BLOCK = 1 << 20
"""Bytes that are unpacked at a time."""


def open_csv(path: Path, metadata: str | None) -> Table:
    """Open a text log: CSV, or with tabs, semicolons or blanks; plain or compressed by gzip or zstd.

    Parameters
    ----------
    metadata : str or None
        What stands beside it.

    Raises
    ------
    LogError
        If the file is empty or no text.
    OSError
        If the file cannot be read.

    Warns
    -----
    LogWarning
        If names stand above the columns, but not as many.
    """
    layout = layout_of(path)
    if layout.unplaced:
        told = {
            "count": len(layout.unplaced),
            "columns": len(layout.headings),
            "names": ", ".join(layout.unplaced)[:120],
        }
        warnings.warn(LogWarning(LogCode.NAMES_UNPLACED.note(**told), str(path)), stacklevel=2)

    def read(chosen: Sequence[Column]) -> dict[Column, Array]:
        return _read(path, layout, chosen)

    return Table(str(path), layout.headings, read, metadata, step=layout.step)


def _read(path: Path, layout: Layout, chosen: Sequence[Column]) -> dict[Column, Array]:
    """Return columns as logged, NaN in empty cells. Refuse a row of another width, or a cell without a number."""
    found: dict[Column, Array] | None = None
    if layout.delimiter != BLANKS:
        # if this fails, the log is read line by line, and stray bytes spoil only their own cell
        with suppress(pa.ArrowInvalid, UnicodeError, _NotFastError):
            found = _read_fast(path, layout, chosen)
    found = _read_cells(path, layout, chosen) if found is None else found
    for column in (one for one in chosen if one.position in layout.scales and not one.channel.startswith(TRUTH_PREFIX)):
        factor, offset = layout.scales[column.position]
        note = LogCode.SCALE_IN_HEADER.note(column=column.name[:60], factor=factor, offset=offset)
        warnings.warn(LogWarning(note, str(path)), stacklevel=2)
    for column, values in found.items():
        if column.channel != TIME and column.position not in layout.stamped and may_group_thousands(values):
            require_none_grouped(_texts(path, layout, column), column.name, str(path))
    return found


def write_csv(columns: Mapping[str, Array], file: BinaryIO, *, compressed: bool) -> None:
    """Write columns as CSV, with the shortest digits that read back exactly; missing samples are empty cells.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        Values by column name.
    file : BinaryIO
        Where to, open for writing.
    """
    table = pa.table({name: to_arrow(values) for name, values in columns.items()})
    if not compressed:
        arrow_csv.write_csv(table, file)
        return
    with gzip.GzipFile(filename="", fileobj=file, mode="wb", mtime=0) as packed:
        arrow_csv.write_csv(table, cast(BinaryIO, packed))


class _NotFastError(Exception):
    """A log that must be read line by line."""


@contextmanager
def _text(path: Path, layout: Layout, errors: str = "replace") -> Generator[TextIO]:
    encoding = "utf-8-sig" if layout.encoding == "utf-8" else layout.encoding
    with open_unpacked(path) as file, io.TextIOWrapper(file, encoding=encoding, errors=errors, newline=None) as text:
        yield text


def _source(path: Path, layout: Layout) -> Path | bytes:
    """Return the input for pyarrow: the file itself, which it reads in parallel, or its text in UTF-8.

    No thread of pyarrow may call Python: an error raised there, such as for too large a file, ends or hangs the
    process.
    """
    if layout.encoding.startswith("utf-16"):
        with _text(path, layout, errors="strict") as text:
            return text.read().encode()
    if packing_of(path) is None:
        return path
    with open_unpacked(path) as file:
        return b"".join(iter(lambda: file.read(_BLOCK), b""))


def _read_fast(path: Path, layout: Layout, chosen: Sequence[Column]) -> dict[Column, Array]:
    wanted = [str(column.position) for column in chosen]
    texts = {str(place) for place in layout.stamped}
    kinds: dict[str, Any] = {one: pa.string() if one in texts else pa.float64() for one in wanted}
    source = _source(path, layout)
    table = _arrow_table(source, layout, kinds)
    if (lines := _lines_if_quoted(source, layout)) is not None and lines != table.num_rows:
        raise _NotFastError  # an unclosed quote turned all that follows into one cell
    out: dict[Column, Array] = {}
    for column, label in zip(chosen, wanted, strict=True):
        if label in texts:
            found: Any = read_stamps([cell or "" for cell in table.column(label).to_pylist()], _not_fast_error)
            out[column] = found
        else:
            out[column] = from_arrow(table.column(label))
        table = table.drop_columns([label])  # frees each column before the next one is copied
    return out


def _arrow_table(source: Path | bytes, layout: Layout, kinds: Mapping[str, Any]) -> Any:
    """Return columns as Arrow reads them, each with its own type; the names are positions as text."""
    return arrow_csv.read_csv(
        cast("Any", source if isinstance(source, Path) else pa.BufferReader(source)),
        read_options=arrow_csv.ReadOptions(
            column_names=[str(place) for place in range(len(layout.headings))], skip_rows=layout.skipped
        ),
        parse_options=arrow_csv.ParseOptions(delimiter=layout.delimiter),
        convert_options=arrow_csv.ConvertOptions(
            include_columns=list(kinds),
            column_types=dict(kinds),
            null_values=list(MISSING),
            decimal_point=layout.decimal_point,
        ),
    )


def _texts(path: Path, layout: Layout, column: Column) -> list[str]:
    """Return the cells of a column as written."""
    if layout.delimiter != BLANKS:
        with suppress(pa.ArrowInvalid, UnicodeError):
            label = str(column.position)
            table = _arrow_table(_source(path, layout), layout, {label: pa.string()})
            return [cell.strip() for cell in table.column(label).to_pylist() if cell]
    with _rows(path, layout) as rows:
        return [row[column.position].strip() for row in rows if len(row) > column.position]


def _not_fast_error(row: int, cell: str) -> Exception:
    return _NotFastError(f"{cell!r} in row {row}")


def _lines_if_quoted(source: Path | bytes, layout: Layout) -> int | None:
    """Return the number of lines below the header that are not blank; None if they contain no quote."""
    with source.open("rb") if isinstance(source, Path) else io.BytesIO(source) as file:
        for _ in range(layout.skipped):
            file.readline()
        begin = file.tell()
        if not any(b'"' in part for part in iter(lambda: file.read(_BLOCK), b"")) and file.tell() > begin:
            return None
        file.seek(begin)
        return sum(1 for line in file if line.strip(b"\r\n"))


def _read_cells(path: Path, layout: Layout, chosen: Sequence[Column]) -> dict[Column, Array]:
    """Read line by line what pyarrow cannot read, or name the row and column that is not a number."""
    moved: list[float] = []
    with _rows(path, layout, moved) as rows:
        found = read_cells(rows, layout, chosen, str(path))
    if moved:
        warnings.warn(LogWarning(LogCode.SEGMENTS_JOINED.note(count=len(moved)), str(path)), stacklevel=2)
    return found


@contextmanager
def _rows(path: Path, layout: Layout, moved: list[float] | None = None) -> Generator[Iterator[list[str]]]:
    """Open the lines below the header, as lists of cells."""
    with _text(path, layout) as text:
        # concatenated files have byte order marks in the middle
        lines = (line.rstrip("\n").removeprefix("\ufeff") for line in islice(text, layout.skipped, None))
        rows = (cells_of(line, layout.delimiter) if line else [] for line in lines)
        yield joined_segments(rows, layout, [] if moved is None else moved) if layout.began else rows
