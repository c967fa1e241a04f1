"""Features of logs and cycles in one call, from which a user's own classes are learnt."""

from collections.abc import Iterable, Sequence
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.python_user.fitted_equations import record_of
from plant.errors import HydrostateError

if TYPE_CHECKING:
    import pandas as pd

    from plant.log.record import Record

SAME_CLOCK = 1e-3
"""Largest relative difference between two sample times that count as equal."""


def features(
    runs: Any,
    *,
    channels: Sequence[str] | None = None,
    cycle: float | None = None,
    sample_time: float | None = None,
    parts: int = 12,
    bands: int | Sequence[float] = 8,
) -> "pd.DataFrame":
    """Return features of runs, one row per run, as input for `Classifier`.

    For each channel: mean and standard deviation in equal parts of the run, skewness, kurtosis, crest factor, and the
    logarithms of standard deviation and of power in frequency bands.

    Parameters
    ----------
    runs : sequence of Log, Record or pandas.DataFrame, one of them, or ndarray of shape (runs, channels, samples)
        The time of a table is its index, or a column that is named so, which is no channel. Gaps are filled by linear
        interpolation.
    channels : sequence of str, optional
        Channels to use, or the names of an array's channels; all by default.
    cycle : float, optional
        Length of a repeated cycle into which each log is cut [s]; by default a whole log is one run.
    sample_time : float, optional
        Time between samples of an array [s]; 1 by default.
    parts : int
        Number of equal parts of a run, each with a mean and a standard deviation: at least the number of steps in a
        repeated cycle, or 1 if runs have no common time course.
    bands : int or sequence of float
        Number of octaves below half the sample rate, or edges of the bands [Hz].

    Returns
    -------
    pandas.DataFrame
        Columns are named after channel and feature; rows are numbered.

    Raises
    ------
    HydrostateError
        If runs have different channels or sample times, or are too short.

    Examples
    --------
    >>> features(np.ones((3, 2, 60)), channels=["pressure", "flow"], parts=4, bands=0).shape
    (3, 24)
    """
    from faults.own_classes.features import Recipe, channel_features

    if isinstance(runs, np.ndarray):
        names, values, step = _of_array(runs, channels, sample_time, cycle)
    else:
        names, values, step = _of_logs(runs, channels, sample_time, cycle)
    if isinstance(parts, bool) or not isinstance(parts, Integral):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
        raise HydrostateError(f"parts must be a whole number, got {parts!r:.80}")
    if isinstance(bands, Integral):
        recipe = Recipe(int(parts), octaves=int(bands))
    else:
        given: Any = bands
        if not isinstance(given, Iterable) or not all(isinstance(one, Real) for one in given):
            raise HydrostateError(f"bands must be a number of octaves or frequencies [Hz], got {given!r:.80}")
        recipe = Recipe(int(parts), edges=tuple(float(one) for one in given))
    return channel_features(names, values, step, recipe)


_Runs = tuple[list[str], list["np.ndarray[Any, np.dtype[np.float64]]"], float]


def _of_array(
    runs: "np.ndarray[Any, Any]", channels: Sequence[str] | None, sample_time: float | None, cycle: float | None
) -> _Runs:
    if runs.ndim != 3 or cycle is not None:
        also = "" if cycle is None else " without a cycle, which is for logs"
        raise HydrostateError(f"an array of shape (runs, channels, samples) is needed{also}, got shape {runs.shape}")
    names = [f"channel {k}" for k in range(runs.shape[1])] if channels is None else list(channels)
    if len(names) != runs.shape[1]:
        raise HydrostateError(f"a name for each of {runs.shape[1]} channels is needed, got {len(names)}")
    return names, list(runs.astype(np.float64)), 1.0 if sample_time is None else sample_time


def _of_logs(runs: Any, channels: Sequence[str] | None, sample_time: float | None, cycle: float | None) -> _Runs:
    from estimation.log_checks.bridging import bridged
    from plant.log.any_columns import is_time_name

    if sample_time is not None:
        raise HydrostateError("sample_time is that of an array; logs have their own")
    records: list[Record] = [record_of(one) for one in (runs if isinstance(runs, list | tuple) else [runs])]
    if not records:
        raise HydrostateError("features of at least one run are needed, got none")
    names = [one for one in records[0] if not is_time_name(one)] if channels is None else list(channels)
    step, values = records[0].sample_time, list[Any]()
    for place, record in enumerate(records):
        if abs(record.sample_time - step) > SAME_CLOCK * step:
            raise HydrostateError(
                f"run {place} has a sample every {record.sample_time:g} s, the first one every {step:g} s: resample it"
            )
        lacking = [name for name in names if name not in record]
        if lacking:
            raise HydrostateError(f"run {place} has no channel {lacking[0]!r}, it has {', '.join(record)}")
        whole = np.stack([bridged(record[name]) for name in names])
        length = whole.shape[1] if cycle is None else round(cycle / step)
        if not 0 < length <= whole.shape[1]:
            raise HydrostateError(
                f"cycle must be as long as run {place} at most, {record.duration:g} s, got {cycle:g} s"
            )
        values += [whole[:, at : at + length] for at in range(0, whole.shape[1] - length + 1, length)]
    return names, values, step
