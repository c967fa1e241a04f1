"""MDF logs, versions 3 and 4, as INCA, CANape and others write them: groups of channels, each with its clock."""

import gc
import sys
from collections import Counter
from collections.abc import Mapping
from contextlib import redirect_stdout
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from plant.errors import HydrostateError, LogError
from plant.log.formats.extras import library
from plant.log.formats.mdf_formula import evaluate_formula
from plant.log.formats.packed import most_unpacked, too_large
from plant.log.table import Table, table_of

VIRTUAL_CHANNELS = (3, 6)
"""Types of channels of version 4 that are counted, and have no bytes in a record."""

MOST_NESTED = 3
"""How deeply one conversion may refer to another [count]."""

TIME_MASTERS = (0, 1)
"""What a master channel of version 4 says that it counts: nothing, or seconds; others count angle, distance, rows."""


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
    # objects of a truncated file cannot be closed, and would print errors
    sys.unraisablehook = lambda _: None
    try:
        # asammdf prints remarks on some damaged files, which would end up in our JSON
        with redirect_stdout(StringIO()):
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
            clock, unit = _clock(group, master)
            names = _names(group)
            for place, channel in enumerate(group.channels):
                formula, within = _take_formula(channel)
                if place == master:
                    if formula is not None:
                        raise LogError(f"its clock {channel.name[:80]!r} is converted by a formula", str(path))
                    continue
                # by default asammdf leaves out invalid samples, different ones in each channel
                signal = file.get(group=number, index=place, raw=False, ignore_invalidation_bits=True)
                columns.setdefault(clock, signal.timestamps)
                columns.setdefault(names[place], _valid_samples(signal, formula, str(path)))
                units.setdefault(names[place], signal.unit or within)
            if columns:
                label = str(getattr(group.channel_group, "acq_name", "") or f"group {number}")
                made.append(table_of(str(path), columns, units={**units, clock: unit}, label=label))
    if not made:
        raise LogError("it holds no channel", str(path))
    return tuple(made)


def _clock(group: Any, master: int | None) -> tuple[str, str | None]:
    """Return name and unit of the master channel of a group."""
    if master is None or getattr(group.channels[master], "sync_type", TIME_MASTERS[1]) in TIME_MASTERS:
        return "time", "s"
    return _name_without_device(group.channels[master].name), group.channels[master].unit or None


def _names(group: Any) -> list[str]:
    """Return the names of channels, without their device unless two would then have the same name."""
    short = Counter(_name_without_device(one.name) for one in group.channels)
    return [
        _name_without_device(one.name) if short[_name_without_device(one.name)] == 1 else one.name
        for one in group.channels
    ]


def _take_formula(channel: Any) -> tuple[str | None, str | None]:
    """Return the formula and unit of a channel, and make asammdf return its raw numbers."""
    conversion = channel.conversion
    formula = _formula_in(conversion)
    if formula is None:
        return None, None
    channel.conversion = None
    return formula, str(getattr(conversion, "unit", "") or "").strip() or None


def _formula_in(conversion: Any, depth: int = 0) -> str | None:
    """Return the formula of a conversion. The formula of a conversion that another refers to is not evaluated."""
    if own := str(getattr(conversion, "formula", "") or "").strip(" \t\r\n\0"):
        return own if depth == 0 else f"{own[:80]} in a part of its range"
    within: Mapping[str, Any] = getattr(conversion, "referenced_blocks", None) or {}
    if depth > MOST_NESTED:
        return "formulas within formulas"
    return next((said for one in within.values() if (said := _formula_in(one, depth + 1)) is not None), None)


def _valid_samples(signal: Any, formula: str | None, source: str) -> Any:
    """Return the samples of a channel, NaN where the logger marked them invalid, or the error."""
    samples, invalid = signal.samples, signal.invalidation_bits
    if formula is not None:
        try:
            if samples.dtype.kind not in "fiub":
                raise ValueError("its raw samples are not numbers")
            samples = evaluate_formula(formula, samples)
        except ValueError as error:
            name, said = _name_without_device(signal.name)[:80], str(error)
            return partial(_refuse, f"channel {name!r} is converted by {formula[:80]!r}: {said}", source)
    if invalid is None or samples.dtype.kind not in "fiub" or samples.shape != np.shape(invalid):
        return samples
    return np.where(invalid, np.nan, samples)


def _refuse(message: str, source: str) -> Any:
    raise LogError(message, source)


def _record_bytes(group: Any) -> int:
    """Return the bytes of a group's record, including those that mark invalid samples."""
    return group.channel_group.samples_byte_nr + getattr(group.channel_group, "invalidation_bytes_nr", 0)


def _require_within(group: Any, source: str) -> None:
    """Refuse a group with a channel outside its records. asammdf copies from there unchecked, and the process ends."""
    bits = 8 * _record_bytes(group)
    for channel in group.channels:
        if getattr(channel, "channel_type", 0) in VIRTUAL_CHANNELS:
            continue
        if hasattr(channel, "byte_offset"):
            begin = 8 * channel.byte_offset + channel.bit_offset
        else:  # version 3
            begin = channel.start_offset + 8 * getattr(channel, "additional_byte_offset", 0)
        if not 0 <= begin <= begin + channel.bit_count <= bits:
            raise LogError(f"channel {channel.name[:80]!r} lies outside its records; the file is damaged", source)


def _name_without_device(name: str) -> str:
    """Return a channel's name without the device that INCA appends."""
    return name.split("\\")[0]
