"""Parquet and Feather logs, read as Arrow tables."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa

from plant.arrays import Array
from plant.errors import LogError
from plant.log.columns import Column
from plant.log.formats.arrow import from_arrow, to_arrow
from plant.log.formats.cells import numbers, read_each
from plant.log.formats.packed import most_unpacked, too_large
from plant.log.headings import Heading
from plant.log.table import Table
from plant.units import USUAL

SCHEMA_KEY = b"hydrostate"

SECONDS: Mapping[str, float] = {**{unit: factor for unit, (of, factor) in USUAL.items() if of == "s"}, "h": 3600.0}
"""Units of time [s]."""

COLUMNS_AT_A_TIME = 200
"""Columns that are read one by one, and so many at a time of a wider file [count]."""


def open_parquet(path: Path) -> Table:
    """Open a Parquet file.

    Raises
    ------
    LogError
        If it holds more rows than a log of its size.
    pyarrow.ArrowException
        If it is damaged.
    """
    import pyarrow.parquet as pq

    file = pq.ParquetFile(path, page_checksum_verification=True)
    most = most_unpacked(path.stat().st_size)
    if 8 * file.metadata.num_rows > most:
        raise too_large(str(path), most)
    schema = file.schema_arrow
    before = _earlier_namesakes(schema.names)

    def column(place: int) -> Any:
        name = schema.names[place]
        return _column_by_occurrence(
            file.read([name]), name, before[place]
        )  # a.b also selects field b of a structure a

    table = _table(path, schema, column)
    if len(schema.names) <= COLUMNS_AT_A_TIME:
        return table

    def read(chosen: Sequence[Column]) -> dict[Column, Array]:
        return table.read(chosen) if len(chosen) <= COLUMNS_AT_A_TIME else _read_in_parts(path, file, chosen, before)

    return replace(table, read=read)


def _read_in_parts(path: Path, file: Any, chosen: Sequence[Column], before: Sequence[int]) -> dict[Column, Array]:
    """Return a very large number of columns in parts, because each read of the file examines all names."""
    names, out = file.schema_arrow.names, dict[Column, Array]()
    for first in range(0, len(chosen), COLUMNS_AT_A_TIME):
        part = chosen[first : first + COLUMNS_AT_A_TIME]
        held = file.read(list(dict.fromkeys(names[column.position] for column in part)))

        def values(column: Column, held: Any = held) -> Array:
            return _values(
                _column_by_occurrence(held, names[column.position], before[column.position]), column, str(path)
            )

        out |= read_each(part, values)
    return out


def _earlier_namesakes(names: Sequence[str]) -> list[int]:
    """Return for each column how many earlier columns have the same name."""
    seen, out = Counter[str](), list[int]()
    for name in names:
        out.append(seen[name])
        seen[name] += 1
    return out


def _column_by_occurrence(table: Any, name: str, before: int) -> Any:
    """Return the column of a name that follows so many others of that name."""
    places = table.schema.get_all_field_indices(name)
    return table.column(places[min(before, len(places) - 1)])


def open_feather(path: Path) -> Table:
    """Open a Feather file, the format of Arrow.

    Raises
    ------
    LogError
        If it unpacks to more than a log of its size.
    pyarrow.ArrowException
        If it is damaged.
    """
    import pyarrow.feather as feather

    most = most_unpacked(path.stat().st_size)
    table = feather.read_table(str(path), memory_map=False)
    table.validate(full=True)
    if table.nbytes > most:
        raise too_large(str(path), most)
    return _table(path, table.schema, table.column)


def _table(path: Path, schema: pa.Schema, read: Any) -> Table:
    kinds = [schema.field(place).type for place in range(len(schema.names))]
    headings = tuple(
        Heading(name, _field_unit(schema.field(place)), pa.types.is_timestamp(kind) or pa.types.is_time(kind))
        for place, (name, kind) in enumerate(zip(schema.names, kinds, strict=True))
    )
    text = (schema.metadata or {}).get(SCHEMA_KEY)

    def values(column: Column) -> Array:
        return _values(read(column.position), column, str(path))

    return Table(
        str(path), headings, partial(read_each, read=values), None if text is None else text.decode(errors="replace")
    )


def _field_unit(field: "pa.Field[Any]") -> str | None:
    """Return the unit that a field gives; for a duration the unit in its name, or seconds."""
    if pa.types.is_duration(field.type):
        return _unit_of_duration(field.name)
    metadata: Mapping[bytes, bytes] = field.metadata or {}
    said = metadata.get(b"unit") or metadata.get(b"units")
    return None if said is None else said.decode(errors="replace")


def _unit_of_duration(name: str) -> str:
    unit = Heading(name).unit or name.rpartition("_")[2]
    return unit if SECONDS.get(unit) else "s"


def _values(values: "pa.ChunkedArray[Any]", column: Column, source: str) -> Any:
    kind = values.type
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind):
        return from_arrow(values if kind == pa.float64() else values.cast(pa.float64(), safe=False))
    if pa.types.is_timestamp(kind):
        whole: Any = values.cast(pa.timestamp("ns", kind.tz)).cast(pa.int64())
        return np.array(whole.fill_null(np.iinfo(np.int64).min).to_numpy(), dtype=np.int64).view("datetime64[ns]")
    if pa.types.is_time(kind):
        from plant.log.clock.stamps import continue_over_midnight

        of_day: Any = values.cast(pa.time64("ns")).cast(pa.int64())
        stamps = np.array(of_day.fill_null(np.iinfo(np.int64).min).to_numpy(), dtype=np.int64)
        return continue_over_midnight(stamps).view("datetime64[ns]")
    if pa.types.is_duration(kind):
        unit = SECONDS[_unit_of_duration(column.name)]
        whole = values.cast(pa.duration("ns")).cast(pa.int64())
        return from_arrow(whole.cast(pa.float64(), safe=False)) * (1e-9 / unit)
    if len(values) and isinstance(values[0].as_py(), str):
        from plant.log.clock.stamps import is_stamp, read_stamps

        texts = [cell or "" for cell in values.to_pylist()]
        if is_stamp(texts[0]):
            wrong = f"column {column.name!r} must hold times"
            return read_stamps(
                texts, lambda row, cell: LogError(f"{wrong}, got {cell[:40]!r} in row {row + 1}", source)
            )
    return numbers(np.array(values.to_pylist(), dtype=object), column.name, source)


def write_parquet(columns: Mapping[str, Array], metadata: str, file: BinaryIO) -> None:
    """Write columns as a Parquet file, with metadata in its schema.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        Values by column name.
    metadata : str
        JSON text.
    file : BinaryIO
        Where to, open for writing.
    """
    import pyarrow.parquet as pq

    table = pa.table({name: to_arrow(values) for name, values in columns.items()})
    pq.write_table(table.replace_schema_metadata({SCHEMA_KEY: metadata.encode()}), file)
