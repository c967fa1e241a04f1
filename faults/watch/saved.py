"""A watch kept over a restart: its memory in one file, from which it continues to the last bit."""

from pathlib import Path

import numpy as np

from faults.watch.watch import Watch
from plant.arrays import Array
from plant.kept import read_kept, write_kept

FORMAT = "hydrostate watch 2"


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
    times = {"sample_time": np.array(watch.sample_time), "travelled": np.array(travelled)}
    write_kept(path, FORMAT, {**times, **watch.remembered()})


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
    values = read_kept(path, FORMAT)
    return values, float(values.pop("sample_time")), float(values.pop("travelled"))
