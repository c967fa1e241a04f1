"""A watch kept over a restart: all that it remembers in one file, from which it continues to the last bit."""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from faults.watch.watch import Watch
from plant.arrays import Array
from plant.atomic import replacing
from plant.errors import HydrostateError

FORMAT = "hydrostate watch 1"


def save_watch(watch: Watch, path: Path, travelled: float = 0.0) -> None:
    """Write what a watch remembers, whole or not at all.

    Parameters
    ----------
    path : Path
        Where to.
    travelled : float
        How far the piston has come by its velocity, where position is not logged [m].

    Raises
    ------
    HydrostateError
        If the file cannot be written.
    """
    content = io.BytesIO()
    times = {"sample_time": np.array(watch.sample_time), "travelled": np.array(travelled)}
    values: dict[str, Any] = {"format": np.array(FORMAT), **times, **watch.remembered()}
    np.savez(content, **values)
    try:
        with replacing(path) as file:
            file.write(content.getvalue())
    except OSError as error:
        raise HydrostateError(f"{path}: the state cannot be written: {error.strerror or error}") from error


def load_state(path: Path) -> tuple[dict[str, Array], float, float]:
    """Read what a watch remembered.

    Parameters
    ----------
    path : Path
        A file of `save_watch`.

    Returns
    -------
    tuple of (dict[str, ndarray], float, float)
        What `Watch.resume` takes, the time between samples [s], and how far the piston had come [m].

    Raises
    ------
    HydrostateError
        If the file cannot be read or is none of a watch.
    """
    try:
        with np.load(path, allow_pickle=False) as kept:
            values = {name: kept[name] for name in kept.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise HydrostateError(f"{path}: a state of hydrostate watch is wanted: {error}") from error
    if str(values.pop("format", "")) != FORMAT:
        raise HydrostateError(f"{path}: a state of hydrostate watch is wanted, the file is none of this version")
    return values, float(values.pop("sample_time")), float(values.pop("travelled"))
