"""CSV logs: commas, semicolons or tabs; fast through pyarrow, and cell by cell to name what is wrong."""

import csv
import gzip
from array import array
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, TextIO, cast

import numpy as np
import pyarrow as pa
from pyarrow import csv as arrow_csv

from plant.arrays import Array
from plant.errors import LogError
from plant.log.arrow import from_arrow, to_arrow
from plant.log.cells import MISSING, not_a_number, number, wrong_width
from plant.log.columns import TRUTH, Column

Choose = Callable[[Sequence[str]], Sequence[Column]]

LONGEST_HEADER = 1 << 20


@dataclass(frozen=True)
class Layout:
    """How a CSV is written.

    Parameters
    ----------
    names : tuple[str, ...]
        Column names, as the header gives them.
    header_lines : int
        Lines down to the header, with it.
    delimiter, decimal_point : str
        One character each.
    """

    names: tuple[str, ...]
    header_lines: int
    delimiter: str
    decimal_point: str


def read_csv(path: Path, choose: Choose) -> dict[Column, Array]:
    """Return the columns of a CSV log that ``choose`` picks by name.

    Parameters
    ----------
    path : Path
        A CSV with a header line, plain or compressed by gzip.

    Returns
    -------
    dict[Column, ndarray, shape (n,)]
        Values as logged, NaN in empty cells.

    Raises
    ------
    LogError
        If the file is empty or no text, a row has too few or too many cells, or a number is none.
    OSError
        If the file cannot be read.
    """
    layout = _layout(path)
    chosen = list(choose(layout.names))
    try:
        return _read_fast(path, layout, chosen)
    except pa.ArrowInvalid:
        return _read_cells(path, layout, chosen)


def write_csv(columns: Mapping[str, Array], file: BinaryIO, *, compressed: bool) -> None:
    """Write columns as CSV, shortest digits that read back exactly, missing samples as empty cells.

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


@contextmanager
def _text(path: Path) -> Generator[TextIO]:
    opener = gzip.open if path.suffix.lower() == ".gz" else Path.open
    with opener(path, "rt", encoding="utf-8-sig", errors="replace") as text:
        yield cast(TextIO, text)


def _layout(path: Path) -> Layout:
    with _text(path) as text:
        lines = 0
        while True:
            header = text.readline(LONGEST_HEADER)
            lines += 1
            if not header:
                raise LogError("a header line is wanted, the file is empty", str(path))
            if header.strip():
                break
        first = text.readline(LONGEST_HEADER)
    if "\0" in header + first or header.count("\ufffd") > 0.1 * len(header):
        raise LogError("a text file is wanted for a CSV log, got binary data", str(path))
    delimiter = max(",;\t", key=header.count)
    comma = delimiter != "," and "," in first and "." not in first
    names = next(csv.reader([header], delimiter=delimiter))
    return Layout(tuple(names), lines, delimiter, "," if comma else ".")


def _read_fast(path: Path, layout: Layout, chosen: Sequence[Column]) -> dict[Column, Array]:
    labels = [str(position) for position in range(len(layout.names))]
    wanted = [labels[column.position] for column in chosen]
    table = arrow_csv.read_csv(
        path,
        read_options=arrow_csv.ReadOptions(column_names=labels, skip_rows=layout.header_lines),
        parse_options=arrow_csv.ParseOptions(delimiter=layout.delimiter),
        convert_options=arrow_csv.ConvertOptions(
            include_columns=wanted,
            column_types=dict.fromkeys(wanted, pa.float64()),
            null_values=list(MISSING),
            decimal_point=layout.decimal_point,
        ),
    )
    out: dict[Column, Array] = {}
    for column, label in zip(chosen, wanted, strict=True):
        out[column] = from_arrow(table.column(label))
        table = table.drop_columns([label])  # hands each column's memory back before the next is copied
    return out


def _read_cells(path: Path, layout: Layout, chosen: Sequence[Column]) -> dict[Column, Array]:
    """Read what pyarrow will not, or say in which row and column it is no number."""
    cells = {column: array("d") for column in chosen}
    try:
        with _text(path) as text:
            rows = csv.reader(islice(text, layout.header_lines, None), delimiter=layout.delimiter)
            for row, values in enumerate(values for values in rows if values):
                if len(values) != len(layout.names):
                    raise wrong_width(str(path), len(layout.names), len(values), row)
                for column in list(cells):
                    _append(cells, column, values[column.position], layout, path, row)
    except csv.Error as error:
        raise LogError(f"cannot be read as CSV: {error}", str(path)) from error
    return {column: np.frombuffer(values, dtype=np.float64) for column, values in cells.items()}


def _append(cells: dict[Column, Any], column: Column, cell: str, layout: Layout, path: Path, row: int) -> None:
    try:
        cells[column].append(number(cell.replace(layout.decimal_point, ".")))
    except ValueError as error:
        if not column.channel.startswith(TRUTH):
            raise not_a_number(str(path), column.name, row, cell) from error
        del cells[column]
