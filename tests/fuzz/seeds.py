"""A small log in every format, the starting point of mutated files."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from tests.log_formats import more_written, written
from tests.log_formats.written import SI

N = 240
"""Rows of each: with so many, two may be garbage [count]."""

KINDS: Mapping[str, str] = {
    "csv": "plain",
    "semicolons": "decimal_comma",
    "dates": "zones",
    "units": "units_row",
    "utf16": "utf16",
    "parquet": "parquet",
    "feather": "feather",
    "mat": "mat5",
    "mat73": "mat73",
    "simulink": "simulink",
    "tdms": "tdms",
    "xlsx": "xlsx",
    "hdf5": "hdf5",
    "mdf": "mdf4",
    "gzip": "gzipped",
    "zstd": "zstd",
    "labview": "labview_without_x",
    "dspace": "dspace",
    "fortran": "fortran",
    "day": "day_and_time",
    "npz": "archive",
    "npy": "records",
    "json lines": "json_lines",
    "json": "json_columns",
}
"""Function in `tests.log_formats` that writes each kind."""


def small_log(rows: int = N) -> pd.DataFrame:
    """Return a log of a sine, sampled at 1 kHz."""
    time = 1e-3 * np.arange(rows)
    wave = np.sin(200.0 * time)
    return pd.DataFrame(dict(zip(SI, (time, 90.0 * wave, 1e-3 * (1.0 - wave), 0.03 * wave, 3e5 * wave), strict=True)))


def seeds(folder: Path) -> dict[str, tuple[str, bytes]]:
    """Return the name and the content of a log of each kind."""
    log = small_log()
    made: dict[str, tuple[str, bytes]] = {}
    for kind, name in KINDS.items():
        path: Path = getattr(written if hasattr(written, name) else more_written, name)(log, folder)
        made[kind] = (path.name, path.read_bytes())
    return made
