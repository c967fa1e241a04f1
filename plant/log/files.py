"""Records on disk: CSV, Parquet and MAT by suffix, checked when read, and written atomically."""

import json
import math
import warnings
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from plant.atomic import replacing
from plant.errors import ClockError, LogError, LogWarning
from plant.log.checks import REQUIRED, Clock, checked_log
from plant.log.clock.uniform import MOST_MISSING
from plant.log.columns import TIME
from plant.log.formats.csv import write_csv
from plant.log.formats.detect import open_tables
from plant.log.notes import LogCode
from plant.log.record import Record
from plant.log.table import Table
from plant.log.tables import gather_channels
from plant.notes import Note

SUFFIXES = {".csv": "csv", ".txt": "csv", ".gz": "csv", ".parquet": "parquet", ".mat": "mat"}
"""File formats that are written, by suffix."""


def read_record(
    path: str | Path | Table | tuple[Table, ...],
    *,
    columns: Mapping[str, str] | None = None,
    required: Collection[str] = REQUIRED,
    sample_time: float | None = None,
    beside: Sequence[str | Path] = (),
    most_missing: float = MOST_MISSING,
) -> Record:
    """Read a log, convert its columns to SI, and refuse it if it fails a check.

    Parameters
    ----------
    path : str, Path, Table or tuple of Table
        Text with cells apart by commas, semicolons, tabs or blanks (also packed by gzip or zstd), Parquet, Feather or
        MAT; with the extra ``bench`` also XLSX, TDMS, MDF, HDF5 and MAT 7.3. The content says which, not the name.
        Or one that is open, as `open_log` or `plant.log.frames.frame_table` gives it.
    columns : Mapping[str, str], optional
        Foreign columns by channel, with a unit where the file gives none and it is not SI:
        ``{"position_m": "POS_MM:mm"}``.
    required : Collection[str]
        Channels that must be there beside time; ``"position_m or velocity_m_s"`` asks for one of the two.
    sample_time : float, optional
        Time between rows [s] of a log that has no time, or times that do not increase.
    beside : Sequence[str or Path]
        Files of other loggers of the same test, whose channels are put on one clock with these.
    most_missing : float
        Share of the samples that may be missing [fraction].

    Returns
    -------
    Record
        The log on a uniform clock, NaN where a sample is missing, with the metadata it was written with; where its
        stamps are dates, ``began`` among them says when the first row was taken.

    Raises
    ------
    LogError
        If the file cannot be read, a column is missing, double, or in an unknown unit, or its values cannot
        be trusted: text, infinities, time that does not increase or is no clock's.
    SparseLogError
        If over 5 % of the samples are missing, or the share that is told.

    Warns
    -----
    LogWarning
        If samples were masked or resampled, a channel was left out, or a unit looks wrong.
    """
    source = source_of(path)
    if sample_time is not None and not (math.isfinite(sample_time) and sample_time > 0.0):
        raise LogError(f"sample_time must be positive and finite, got {sample_time!r}", source)
    tables = [table for one in (path, *beside) for table in open_log(one)]
    found = gather_channels(tables, columns, required, source, sample_time)
    document, notes = _document(next((one.metadata for one in tables if one.metadata), None))
    clock = None if beside else _clock(document)
    trust = partial(checked_log, source=source, required=required, most_missing=most_missing)
    try:
        checked = trust(found.columns, clock=clock)
    except ClockError:
        if sample_time is None or beside:
            raise
        given = np.asarray(found.columns[TIME], dtype=np.float64)
        even = sample_time * np.arange(len(given), dtype=np.float64)
        checked = trust({**found.columns, TIME: even}, clock=Clock(sample_time, 0.0))
        held = np.flatnonzero(np.diff(given) <= 0.0)
        where = {"count": held.size, "row": int(held[0]) + 2 if held.size else 1}
        notes = (*notes, LogCode.TIME_REPLACED.note(channel=TIME, sample_time_s=sample_time, **where))
    for note in (*notes, *found.notes, *checked.notes):
        warnings.warn(LogWarning(note, source), stacklevel=2)
    began = {} if found.began is None else {"began": found.began}
    return Record(checked.sample_time, checked.channels, {**began, **document.get("metadata", {})}, checked.start_time)


def source_of(log: str | Path | Table | tuple[Table, ...]) -> str:
    """Return the name of a log for messages."""
    first = log[0] if isinstance(log, tuple) else log
    return first.source if isinstance(first, Table) else str(first)


def open_log(log: str | Path | Table | tuple[Table, ...]) -> tuple[Table, ...]:
    """Open a log that may be read more than once.

    Parameters
    ----------
    log : str, Path, Table or tuple of Table
        Its file; one that is open stays as it is.

    Raises
    ------
    LogError
        If the file is of no format that is read, damaged, or larger than a log is.
    """
    if isinstance(log, tuple):
        return log
    return (log,) if isinstance(log, Table) else open_tables(Path(log), _sidecar_text(Path(log)))


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
    kind = _written_format(path)
    document = _document_text(record, path)
    table = {TIME: record.time, **record.channels}
    try:
        if kind == "csv":
            with replacing(sidecar(path)) as notes, replacing(path) as file:
                notes.write(document.encode())
                write_csv(table, file, compressed=path.suffix.lower() == ".gz")
        elif kind == "parquet":
            from plant.log.formats.parquet import write_parquet

            with replacing(path) as file:
                write_parquet(table, document, file)
        else:
            from plant.log.formats.mat import write_mat

            with replacing(path) as file:
                write_mat(table, document, file, str(path))
    except OSError as error:
        raise LogError(f"cannot be written: {error.strerror or error}", str(path)) from error


def sidecar(path: Path) -> Path:
    """Return the path of the metadata file of a CSV.

    Returns
    -------
    Path
        ``run.csv.json`` for ``run.csv``.
    """
    return path.parent / f"{path.name}.json"


def _written_format(path: Path) -> str:
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise LogError(f"a log is written as {', '.join(SUFFIXES)}, got {path.suffix or 'no suffix'}", str(path))
    return kind


def _sidecar_text(path: Path) -> str | None:
    """Return the metadata of a CSV; None if it has no metadata file."""
    notes = sidecar(path)
    try:
        return notes.read_text(errors="replace") if notes.is_file() else None
    except (OSError, ValueError):
        return None


def _document_text(record: Record, path: Path) -> str:
    document = {
        "hydrostate_record": 1,
        "sample_time_s": record.sample_time,
        "start_time_s": record.start_time,
        "metadata": dict(record.metadata),
    }
    try:
        return json.dumps(document, allow_nan=False, default=_json_value)
    except (TypeError, ValueError) as error:
        raise LogError(f"metadata must be JSON values: {error}", str(path)) from error


def _json_value(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"got {type(value).__name__}")


def _document(text: str | None) -> tuple[dict[str, Any], list[Note]]:
    """Return the document that `write_record` wrote; empty if there is none or it is a different one."""
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
