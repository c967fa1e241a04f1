"""Records on disk: CSV, Parquet and MAT by suffix, checked when read, whole when written."""

import json
import math
import warnings
from collections.abc import Collection, Mapping
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa

from plant.arrays import Array
from plant.atomic import replacing
from plant.errors import HydrostateError, LogError, LogWarning
from plant.log.arrow import from_arrow, to_arrow
from plant.log.cells import each_read, numbers
from plant.log.checks import REQUIRED, Clock, trusted
from plant.log.columns import TIME, Column, converted, resolve_columns
from plant.log.csv import Choose, read_csv, write_csv
from plant.log.mat import read_mat, write_mat
from plant.log.notes import LogCode
from plant.log.record import Record
from plant.notes import Note

Raw = tuple[dict[Column, Array], str | None]

SCHEMA_KEY = b"hydrostate"
SUFFIXES = {".csv": "csv", ".txt": "csv", ".gz": "csv", ".parquet": "parquet", ".mat": "mat"}
"""File formats by suffix."""


def read_record(
    path: str | Path, *, columns: Mapping[str, str] | None = None, required: Collection[str] = REQUIRED
) -> Record:
    """Read a log, convert its columns to SI, and refuse it if it cannot be trusted.

    Parameters
    ----------
    path : str or Path
        A ``.csv`` or ``.txt`` (also ``.gz``), ``.parquet``, or ``.mat`` (versions 5 to 7) file.
    columns : Mapping[str, str], optional
        Foreign columns by channel, with a unit where it is not SI: ``{"position_m": "POS_MM:mm"}``.
    required : Collection[str]
        Channels that must be there beside time; ``"position_m or velocity_m_s"`` asks for one of the two.

    Returns
    -------
    Record
        The log on a uniform clock, NaN where a sample is missing, with the metadata it was written with.

    Raises
    ------
    LogError
        If the file cannot be read, a column is missing, double, or in an unknown unit, or its values cannot
        be trusted: text, infinities, over 5 % missing, time that does not increase or is no clock's.

    Warns
    -----
    LogWarning
        If samples were masked or resampled, a channel was left out, or a unit looks wrong.
    """
    path = Path(path)
    choose = partial(resolve_columns, mapping=columns, source=str(path))
    raw, text = _raw(path, choose)
    document, notes = _document(text)
    clock = _clock(document)
    checked = trusted(converted(raw), source=str(path), required=required, clock=clock)
    for note in (*notes, *checked.notes):
        warnings.warn(LogWarning(note, str(path)), stacklevel=2)
    return Record(checked.sample_time, checked.channels, document.get("metadata", {}), checked.start_time)


def write_record(record: Record, path: str | Path) -> None:
    """Write a record so that `read_record` gives it back, metadata and clock included.

    Metadata goes into the Parquet schema, into the MAT struct, or into ``NAME.csv.json`` beside ``NAME.csv``.

    Parameters
    ----------
    path : str or Path
        Where to: the suffix says the format. An older file is replaced when the new one is complete.

    Raises
    ------
    LogError
        If the suffix is unknown, the metadata are not JSON values, or the file cannot be written.
    """
    path = Path(path)
    kind = _kind(path)
    document = _encoded(record, path)
    table = {TIME: record.time, **record.channels}
    try:
        if kind == "csv":
            with replacing(sidecar(path)) as notes, replacing(path) as file:
                notes.write(document.encode())
                write_csv(table, file, compressed=path.suffix.lower() == ".gz")
        elif kind == "parquet":
            with replacing(path) as file:
                _write_parquet(table, document, file)
        else:
            with replacing(path) as file:
                write_mat(table, document, file, str(path))
    except OSError as error:
        raise LogError(f"cannot be written: {error.strerror or error}", str(path)) from error


def sidecar(path: Path) -> Path:
    """Return the file beside a CSV that holds its metadata.

    Returns
    -------
    Path
        ``run.csv.json`` for ``run.csv``.
    """
    return path.with_name(path.name + ".json")


def _kind(path: Path) -> str:
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise LogError(f"a log ends in {', '.join(SUFFIXES)}, got {path.suffix or 'no suffix'}", str(path))
    return kind


def _raw(path: Path, choose: Choose) -> Raw:
    try:
        if path.is_dir():
            raise LogError("a file is wanted, got a directory", str(path))
        if not path.exists():
            raise LogError("there is no such file", str(path))
        kind = _kind(path)
        if kind == "csv":
            notes = sidecar(path)
            return read_csv(path, choose), notes.read_text(errors="replace") if notes.is_file() else None
        with path.open("rb") as file:
            if not file.read(1):
                raise LogError("the file is empty", str(path))
        return _read_parquet(path, choose) if kind == "parquet" else read_mat(path, choose)
    except HydrostateError:
        raise
    except PermissionError as error:
        raise LogError("there is no permission to read it", str(path)) from error
    except Exception as error:  # parsers of damaged files raise whatever they stumble over
        said = " ".join(str(error).split())[:200] or type(error).__name__
        raise LogError(f"cannot be read as {path.suffix.lower()[1:]}: {said}", str(path)) from error


def _read_parquet(path: Path, choose: Choose) -> Raw:
    import pyarrow.parquet as pq

    file = pq.ParquetFile(path)
    names = file.schema_arrow.names
    text = (file.schema_arrow.metadata or {}).get(SCHEMA_KEY)

    def read(column: Column) -> Array:
        return _floats(file.read([names[column.position]]).column(0), column, str(path))

    return each_read(choose(names), read), None if text is None else text.decode(errors="replace")


def _write_parquet(columns: Mapping[str, Array], metadata: str, file: BinaryIO) -> None:
    import pyarrow.parquet as pq

    table = pa.table({name: to_arrow(values) for name, values in columns.items()})
    pq.write_table(table.replace_schema_metadata({SCHEMA_KEY: metadata.encode()}), file)


def _floats(values: "pa.ChunkedArray[Any]", column: Column, source: str) -> Array:
    kind = values.type
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind):
        return from_arrow(values if kind == pa.float64() else values.cast(pa.float64(), safe=False))
    return numbers(np.array(values.to_pylist(), dtype=object), column.name, source)


def _encoded(record: Record, path: Path) -> str:
    document = {
        "hydrostate_record": 1,
        "sample_time_s": record.sample_time,
        "start_time_s": record.start_time,
        "metadata": dict(record.metadata),
    }
    try:
        return json.dumps(document, allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise LogError(f"metadata must be JSON values: {error}", str(path)) from error


def _plain(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"got {type(value).__name__}")


def _document(text: str | None) -> tuple[dict[str, Any], list[Note]]:
    """Return the document that `write_record` left, empty where there is none or another's."""
    if text is None:
        return {}, []
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        return {}, [LogCode.METADATA_UNREADABLE.note(wanted="JSON")]
    if not isinstance(document, dict) or "hydrostate_record" not in document:
        return {}, []
    if not isinstance(document.get("metadata"), dict):
        return {}, [LogCode.METADATA_UNREADABLE.note(wanted="JSON object")]
    return document, []


def _clock(document: Mapping[str, Any]) -> Clock | None:
    try:
        clock = Clock(float(document["sample_time_s"]), float(document["start_time_s"]))
    except (KeyError, TypeError, ValueError):
        return None
    return clock if 0.0 < clock.sample_time < math.inf and math.isfinite(clock.start_time) else None
