"""TDMS logs, as LabVIEW writes them: groups of channels, each with its unit, and a time step in place of stamps."""

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from plant.errors import LogError
from plant.log.formats.extras import library
from plant.log.table import Table, table_of

UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit")
STEP, BEGAN = "wf_increment", "wf_start_time"


def open_tdms(path: Path) -> tuple[Table, ...]:
    """Open a TDMS file.

    Returns
    -------
    tuple of Table
        One for all channels of a group that have one length and one step.

    Raises
    ------
    LogError
        If npTDMS is not installed, or the file says that it is longer than it is.
    """
    nptdms = library("nptdms", "TDMS", str(path))
    size = path.stat().st_size
    groups: dict[Any, dict[str, Any]] = defaultdict(dict)
    units: dict[Any, dict[str, str | None]] = defaultdict(dict)
    began: dict[Any, Any] = {}
    with path.open("rb") as stream, nptdms.TdmsFile.open(stream) as file:
        for group in file.groups():
            for channel in group.channels():
                if len(channel) > size:
                    raise LogError(f"it ends before the {len(channel)} samples that {channel.name!r} has", str(path))
                said = channel.properties
                key = (group.name, len(channel), _number(said.get(STEP)))
                unit = next((str(said[name]) for name in UNITS if said.get(name)), None)
                groups[key][channel.name] = channel[:]
                units[key][channel.name] = unit
                began.setdefault(key, _stamp(said.get(BEGAN)))
    if not groups:
        raise LogError("it holds no channel", str(path))
    return tuple(
        table_of(str(path), columns, units=units[key], label=key[0], step=key[2], began=began[key])
        for key, columns in groups.items()
    )


def _number(value: Any) -> float | None:
    """Return a step, None where it is none."""
    try:
        step = float(value)
    except (TypeError, ValueError):
        return None
    return step if 0.0 < step < 1e6 else None


def _stamp(value: Any) -> Any:
    """Return when a channel begins, None where nothing is said; LabVIEW's zero of 1904 says nothing."""
    try:
        stamp = np.datetime64(value).astype("datetime64[ns]")
    except (TypeError, ValueError, OverflowError):
        return None
    return stamp if stamp > np.datetime64("1971-01-01") else None
