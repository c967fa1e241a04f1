"""TDMS logs, as LabVIEW writes them: groups of channels, each with its unit and a time step instead of stamps."""

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from plant.errors import LogError
from plant.log.formats.extras import library
from plant.log.table import Table, table_of

UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit")
STEP, BEGAN, OFFSET = "wf_increment", "wf_start_time", "wf_start_offset"


def open_tdms(path: Path) -> tuple[Table, ...]:
    """Open a TDMS file.

    Returns
    -------
    tuple of Table
        One for all channels of a group that have one length, one step and one beginning.

    Raises
    ------
    LogError
        If npTDMS is not installed, or the file says that it is longer than it is.
    """
    nptdms = library("nptdms", "TDMS", str(path))
    size = path.stat().st_size
    groups: dict[Any, dict[str, Any]] = defaultdict(dict)
    units: dict[Any, dict[str, str | None]] = defaultdict(dict)
    with path.open("rb") as stream, nptdms.TdmsFile.open(stream) as file:
        for group in file.groups():
            starts: dict[Any, Any] = {}
            for channel in group.channels():
                if len(channel) > size:
                    raise LogError(f"it ends before the {len(channel)} samples that {channel.name!r} has", str(path))
                said = channel.properties
                alike = (group.name, len(channel), _number(said.get(STEP)))
                began = _stamp(said.get(BEGAN))
                if began is None:
                    began = starts.get(alike)  # perhaps only the first of a group states it
                starts.setdefault(alike, began)
                key = (*alike, began, _offset(said.get(OFFSET)))
                groups[key][channel.name] = channel[:]
                units[key][channel.name] = next((str(said[name]) for name in UNITS if said.get(name)), None)
    if not groups:
        raise LogError("it holds no channel", str(path))
    return tuple(
        table_of(str(path), columns, units=units[key], label=key[0], step=key[2], began=key[3], offset=key[4])
        for key, columns in groups.items()
    )


def _number(value: Any) -> float | None:
    """Return a time step; None if it is not one."""
    try:
        step = float(value)
    except (TypeError, ValueError):
        return None
    return step if 0.0 < step < 1e6 else None


def _offset(value: Any) -> float:
    """Return the delay of the first sample after the start [s]."""
    try:
        offset = float(value)
    except (TypeError, ValueError):
        return 0.0
    return offset if abs(offset) < 1e9 else 0.0


def _stamp(value: Any) -> Any:
    """Return the start of a channel; None if it is not given or is LabVIEW's zero in 1904."""
    try:
        stamp = np.datetime64(value).astype("datetime64[ns]")
    except (TypeError, ValueError, OverflowError):
        return None
    return stamp if stamp > np.datetime64("1971-01-01") else None
