"""A filter on a stream of an electro-hydrostatic actuator: its task and its state file.

Samples of a stream become drives and measurements as those of a log do. A state file holds task and memory. So a filter
continues after a restart, to the last bit, and refuses a stream for which it was not made.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem
from estimation.export.task import EXPORTED_FORMS, filter_task
from estimation.filters.online import OnlineFilter
from estimation.models.augment import augmented
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError, LogError
from plant.kept import read_kept, write_kept
from plant.log.chamber_pressures import with_pressure_difference
from plant.log.record import Record
from plant.log.stream.csv_rows import SAME_RATE
from plant.solvers.steps import parameter_row

FORMAT = "hydrostate filter 2"


@dataclass(frozen=True)
class StreamFilterOptions:
    """The options of a stream's filter.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator.
    form, method : str
        One of `EXPORTED_FORMS`, and of `estimation.filters.online.RULES`.
    states : tuple of str
        States estimated beside bulk modulus.
    tuned : bool
        Whether the noise levels are those of greatest likelihood on the reference log.
    """

    parameters: EhaParameters
    form: str
    method: str
    states: tuple[str, ...] = ()
    tuned: bool = False


def begin_filter(asked: StreamFilterOptions, first: Record, like: Record | None = None) -> OnlineFilter:
    """Return a filter before its first sample.

    Parameters
    ----------
    first : Record
        Beginning of the stream: first belief, channels, and sensor noise if there is no other log.
    like : Record, optional
        A log of the same bench, from which the noise levels are read.

    Raises
    ------
    HydrostateError
        If a name is not known.
    LogError
        If the stream lacks what the form needs, or the log another channel or rate.
    """
    told = _with_differential_pressure(first)
    full = Record(told.sample_time, {name: told[name][_complete_rows(told)] for name in told})
    task = filter_task(full, asked.parameters, asked.form, states=asked.states, tuned=asked.tuned and like is None)
    if like is not None:
        other = filter_task(
            _with_differential_pressure(like), asked.parameters, asked.form, states=asked.states, tuned=asked.tuned
        )
        if other.channels != task.channels or abs(like.sample_time / first.sample_time - 1.0) > SAME_RATE:
            raise LogError(
                f"the log must have the stream's channels ({', '.join(task.channels)}) at its rate, "
                f"{1.0 / first.sample_time:g} Hz, got {', '.join(other.channels)} at {1.0 / like.sample_time:g} Hz"
            )
        task = replace(task, noise=other.noise, variances=other.variances)
    return OnlineFilter(task, asked.method)


def _with_differential_pressure(record: Record) -> Record:
    return record.replace(**with_pressure_difference(record.channels))


def _complete_rows(record: Record) -> NDArray[np.bool_]:
    """Return which samples have every channel; noise is determined from these."""
    return np.all([np.isfinite(record[name]) for name in record], axis=0)


def samples_of(filtered: OnlineFilter, channels: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return samples of a stream as a filter takes them.

    Parameters
    ----------
    channels : Mapping[str, ndarray], shape (n,) each
        By name [SI].

    Returns
    -------
    tuple of ndarray, shapes (n, drives) and (n, channels)
        Drives and measurements.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    known = with_pressure_difference(channels)
    wanted = (*filtered.problem.model.drives, *filtered.problem.channels)
    missing = [name for name in wanted if name not in known]
    if missing:
        raise LogError(f"the filter needs {', '.join(wanted)}, the stream lacks {', '.join(missing)}")
    split = len(filtered.problem.model.drives)
    columns = np.column_stack([known[name] for name in wanted])
    return columns[:, :split], columns[:, split:]


def save_filter(path: Path, asked: StreamFilterOptions, filtered: OnlineFilter, last: float) -> None:
    """Write task and memory of a filter, completely or not at all.

    Parameters
    ----------
    path : Path
        File to write.
    last : float
        Time of the last sample [s].

    Raises
    ------
    HydrostateError
        If the file cannot be written.
    """
    task = filtered.problem
    about = {
        "asked": np.array([asked.form, asked.method, ",".join(asked.states)]),
        "channels": np.array(task.channels),
        "times": np.array([task.sample_time, float(task.substeps), last]),
    }
    numbers = {name: getattr(task, name) for name in ("mean", "covariance", "parameters", "noise", "variances")}
    write_kept(path, FORMAT, {**about, **numbers, **filtered.remembered()})


def load_filter(path: Path, asked: StreamFilterOptions) -> tuple[OnlineFilter, float]:
    """Return a filter that continues where a saved one was.

    Parameters
    ----------
    path : Path
        A file of `save_filter`.

    Returns
    -------
    tuple of (OnlineFilter, float)
        The filter, and the time of its last sample [s].

    Raises
    ------
    HydrostateError
        If the file cannot be read, or is of another filter or actuator.
    """
    kept = read_kept(path, FORMAT)
    named = [str(one) for one in kept["asked"]]
    wanted = [asked.form, asked.method, ",".join(asked.states)]
    if named != wanted:
        raise HydrostateError(f"{path} is of {' '.join(named).strip()}, asked for is {' '.join(wanted).strip()}")
    model = augmented(EXPORTED_FORMS[asked.form], asked.states)
    row = parameter_row(asked.parameters, model.parameters)
    if not np.array_equal(row, kept["parameters"]):
        raise HydrostateError(f"{path} is of an actuator with other parameters: name the rig file it was begun with")
    sample_time, substeps, last = kept["times"].tolist()
    channels = tuple(str(one) for one in kept["channels"])
    empty = np.empty((0, len(model.drives))), np.empty((0, len(channels)))
    task = FilterProblem(
        model=model,
        channels=channels,
        drives=empty[0],
        measured=empty[1],
        sample_time=sample_time,
        substeps=int(substeps),
        every=1,
        keep_innovations=False,
        mean=kept["mean"],
        covariance=kept["covariance"],
        parameters=kept["parameters"],
        noise=kept["noise"],
        variances=kept["variances"],
    )
    filtered = OnlineFilter(task, asked.method)
    filtered.resume(kept)
    return filtered, last
