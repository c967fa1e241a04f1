"""Saves a watch to one file, from which it continues exactly after a restart."""

from pathlib import Path

import numpy as np

from faults.watch.kernel import INTERVALS
from faults.watch.memory import CLOCK, Memory
from faults.watch.watch import PAUSE, Watch
from plant.arrays import Array
from plant.kept import read_kept, write_kept

FORMAT = "hydrostate watch 4"

BEFORE_PAUSES = "hydrostate watch 3"
"""Format of a watch that did not learn again after a pause."""


def save_watch(watch: Watch, path: Path, travelled: float = 0.0) -> None:
    """Write the state of a watch to a file, atomically.

    Parameters
    ----------
    path : Path
        The file to write.
    travelled : float
        Distance that the piston has travelled by its velocity, if position is not logged [m].

    Raises
    ------
    HydrostateError
        If the file cannot be written.
    """
    times = {"sample_time": np.array(watch.sample_time), "travelled": np.array(travelled)}
    write_kept(path, FORMAT, {**times, **watch.remembered()})


def load_state(path: Path) -> tuple[dict[str, Array], float, float]:
    """Read the saved state of a watch.

    Parameters
    ----------
    path : Path
        A file written by `save_watch`.

    Returns
    -------
    tuple of (dict[str, ndarray], float, float)
        The state that `Watch.resume` takes, the time between samples [s], and the distance that the piston has
        travelled [m].

    Raises
    ------
    HydrostateError
        If the file cannot be read, or is not a saved watch.
    """
    values = read_kept(path, FORMAT, BEFORE_PAUSES)
    _count_pauses(values)
    return values, float(values.pop("sample_time")), float(values.pop("travelled"))


def _count_pauses(values: dict[str, Array]) -> None:
    """Give a state of a watch that counted no pauses the counters and the setting that it lacks."""
    clock, asked = f"memory_{Memory._fields.index('clock')}", values["asked"]
    if len(values[clock]) < CLOCK:
        values[clock] = np.pad(values[clock], (0, CLOCK - len(values[clock])))
        samples = asked[-4]
        values["asked"] = np.append(asked, round(PAUSE / (samples * INTERVALS * float(values["sample_time"]))))
