"""MDF logs, version 3 and 4, as INCA, CANape and others write them: groups of channels, each with its clock."""

import gc
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from plant.errors import HydrostateError, LogError
from plant.log.formats.extras import library
from plant.log.formats.packed import most_unpacked, too_large
from plant.log.table import Table, table_of

VIRTUAL = (3, 6)
"""Types of channels of version 4 that are counted, and have no bytes in a record."""


def open_mdf(path: Path) -> tuple[Table, ...]:
    """Open an MDF file.

    Returns
    -------
    tuple of Table
        One a group of channels, with its clock as ``time`` in seconds.

    Raises
    ------
    LogError
        If asammdf is not installed, or there is no channel.
    """
    asammdf = library("asammdf", "MDF", str(path))
    hook, said = sys.unraisablehook, ""
    sys.unraisablehook = lambda _: None  # a file that breaks off leaves objects that cannot be closed, and complain
    try:
        with redirect_stdout(StringIO()):  # asammdf prints what it makes of some damaged files, into our JSON
            return _tables(asammdf, path)
    except HydrostateError:
        raise
    except Exception as error:
        said = " ".join(str(error).split())[:200] or type(error).__name__
    finally:
        gc.collect()
        sys.unraisablehook = hook
    raise LogError(f"cannot be read as mdf: {said}", str(path))


def _tables(asammdf: Any, path: Path) -> tuple[Table, ...]:
    made: list[Table] = []
    most = most_unpacked(path.stat().st_size)
    with path.open("rb") as stream, asammdf.MDF(stream) as file:
        for number, group in enumerate(file.groups):
            if max(8, _record_bytes(group)) * group.channel_group.cycles_nr > most:
                raise too_large(str(path), most)
            _require_within(group, str(path))
            columns: dict[str, Any] = {}
            units: dict[str, str | None] = {}
            master = file.masters_db.get(number)
            for place, channel in enumerate(group.channels):
                if place == master:
                    continue
                # by itself it leaves invalid samples out, of each channel others
                signal = file.get(group=number, index=place, raw=False, ignore_invalidation_bits=True)
                columns.setdefault("time", signal.timestamps)
                columns.setdefault(_last(channel.name), _valid(signal))
                units.setdefault(_last(channel.name), signal.unit or None)
            if columns:
                label = str(getattr(group.channel_group, "acq_name", "") or f"group {number}")
                made.append(table_of(str(path), columns, units={**units, "time": "s"}, label=label))
    if not made:
        raise LogError("it holds no channel", str(path))
    return tuple(made)


def _valid(signal: Any) -> Any:
    """Return the samples of a channel, NaN where the logger called them invalid."""
    samples, invalid = signal.samples, signal.invalidation_bits
    if invalid is None or samples.dtype.kind not in "fiub" or samples.shape != np.shape(invalid):
        return samples
    return np.where(invalid, np.nan, samples)


def _record_bytes(group: Any) -> int:
    """Return the bytes of a record of a group, with those that say which samples are invalid."""
    return group.channel_group.samples_byte_nr + getattr(group.channel_group, "invalidation_bytes_nr", 0)


def _require_within(group: Any, source: str) -> None:
    """Refuse a group with a channel outside its records: asammdf copies from there unchecked, and the process ends."""
    bits = 8 * _record_bytes(group)
    for channel in group.channels:
        if getattr(channel, "channel_type", 0) in VIRTUAL:
            continue
        if hasattr(channel, "byte_offset"):
            begin = 8 * channel.byte_offset + channel.bit_offset
        else:  # version 3
            begin = channel.start_offset + 8 * getattr(channel, "additional_byte_offset", 0)
        if not 0 <= begin <= begin + channel.bit_count <= bits:
            raise LogError(f"channel {channel.name[:80]!r} lies outside its records; the file is damaged", source)


def _last(name: str) -> str:
    """Return a channel's name without the device that INCA puts behind it."""
    return name.split("\\")[0]
