"""Reads sets of logs into pandas, or into the arrays ``(X, y, groups)`` that scikit-learn takes."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from experiments.open_benchmark.folders import TRUTH
from experiments.open_benchmark.logger import DIFFERENCE, PLAIN_CHANNELS, PRESSURE_A, PRESSURE_B
from plant.arrays import Array
from plant.errors import HydrostateError


def read_truth(folder: Path) -> pd.DataFrame:
    """Return the truth of a set, one row for each log; missing entries are empty texts.

    Raises
    ------
    HydrostateError
        If there is none.
    """
    path = folder / TRUTH
    if not path.is_file():
        raise HydrostateError(f"{folder}: a folder with {TRUTH} is needed, as `hydrostate benchmark make` writes it")
    return pd.read_csv(path, keep_default_na=False)


def rows_of(truth: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a truth as dictionaries by column name."""
    return [{str(name): value for name, value in row.items()} for row in truth.to_dict("records")]


def read_logs(folder: Path) -> Iterator[tuple[dict[str, Any], pd.DataFrame]]:
    """Yield the truth of each log of a set, and the log as in its file."""
    for truth in rows_of(read_truth(folder)):
        yield truth, pd.read_csv(folder / str(truth["file"]))


def read_arrays(
    folders: Sequence[Path], duration: float = 10.0, sample_time: float = 1e-3
) -> tuple[Array, NDArray[np.str_], NDArray[np.str_]]:
    """Return logs as arrays for scikit-learn: the beginning of each on one clock.

    Parameters
    ----------
    folders : sequence of Path
        Folders of sets, each with `truth.csv`.
    duration, sample_time : float
        Duration and sample time to use from each log [s]; a shorter log is padded with its last values.

    Returns
    -------
    X : ndarray, shape (logs, 4 samples)
        Motor speed, position, velocity and differential pressure, concatenated, SI; NaN if not logged.
    y : ndarray, shape (logs,)
        Condition of each log.
    groups : ndarray, shape (logs,)
        Set of each log.
    """
    clock = np.arange(0.0, duration, sample_time)
    series, conditions, groups = list[Array](), list[str](), list[str]()
    for folder in folders:
        for truth, log in read_logs(folder):
            if DIFFERENCE not in log and PRESSURE_A in log:
                log[DIFFERENCE] = log[PRESSURE_A] - log[PRESSURE_B]
            channels = [log.get(name, pd.Series(np.nan, log.index)) for name in PLAIN_CHANNELS]
            series.append(np.concatenate([np.interp(clock, log["time_s"], one) for one in channels]))
            conditions.append(str(truth["condition"]))
            groups.append(folder.name)
    return np.array(series), np.array(conditions), np.array(groups)
