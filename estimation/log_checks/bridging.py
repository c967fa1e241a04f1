"""Gaps in the drives of a filter: bridged by straight lines with the uncertainty that these leave.

Motor speed drives every process model, so the pumped volume is unknown while it was not logged. The volume error of a
straight line is added, sample by sample, to the process noise of the states that it moves, and the next measurement
corrects it. The same holds for position, if it drives a model: the swept volume is right again after a gap, but not
what leaked in between, and pressures measured within the gap are of no use.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.log_checks.channel_names import POSITION
from estimation.log_checks.order import median
from estimation.models.model import OPENING, ProcessModel
from plant.arrays import Array
from plant.compiled.functions import Scalar
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.solvers.steps import Parameters

LEAST_GAP = 1.5
"""Distance of samples, over the channel's usual one, from which it is a gap [dimensionless]."""


def bridged(x: Array) -> Array:
    """Return the signal with its gaps filled by straight lines, and held beyond its first and last sample.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Any signal; NaN where missing.

    Returns
    -------
    ndarray, shape (n,)
        Without NaN.

    Raises
    ------
    HydrostateError
        If no sample is there.
    """
    known = np.isfinite(x)
    if known.all():
        return x
    if not known.any():
        raise HydrostateError("a signal with at least one finite sample is needed, got none")
    samples = np.arange(x.size)
    return np.interp(samples, samples[known], x[known])


def gaps(values: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return the gaps of a channel; one with a sample every so many rows throughout is slow, and has none.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel with at least one sample [any unit]; NaN where missing.

    Returns
    -------
    tuple of ndarray, shape (present - 1,)
        Sample times from each valid sample to the next, and whether that is a gap.

    Examples
    --------
    >>> gone = np.nan
    >>> gaps(np.array([1.0, 1.0, 1.0, gone, gone, 1.0]))[1].tolist()
    [False, False, True]
    >>> gaps(np.array([gone, 1.0, gone, 1.0, gone, 1.0]))[1].tolist()
    [False, False]
    """
    n = np.diff(np.flatnonzero(np.isfinite(values))).astype(np.float64)
    return n, n > LEAST_GAP * median(n) if len(n) else np.zeros(0, dtype=np.bool_)


def within_gaps(values: Array) -> NDArray[np.bool_]:
    """Return the samples in the gaps of a channel, and before its first and after its last.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel with at least one sample [any unit]; NaN where missing.

    Returns
    -------
    ndarray of bool, shape (n,)
        Whether a sample is in one; never between the samples of a slow channel.
    """
    present = np.flatnonzero(np.isfinite(values))
    apart, wide = gaps(values)
    within = np.isnan(values)
    within[present[0] : present[-1]] &= np.repeat(wide, apart.astype(np.int64))
    return within


def bridged_slow_channel(values: Array) -> tuple[Array, int]:
    """Return a slow channel with straight lines between its samples, and its spacing in rows.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit]; NaN where missing.

    Returns
    -------
    tuple of (ndarray, shape (n,), and int)
        The channel, with NaN in its gaps and at its ends; unchanged if it has a sample in most rows.

    Examples
    --------
    >>> gone = np.nan
    >>> bridged_slow_channel(np.array([1.0, gone, 3.0, gone, 5.0, gone, gone, gone, gone, 9.0, gone]))[0].tolist()
    [1.0, 2.0, 3.0, 4.0, 5.0, nan, nan, nan, nan, 9.0, nan]
    """
    there = np.flatnonzero(np.isfinite(values))
    if len(there) < 2 or (rows := int(median(np.diff(there).astype(np.float64)))) < 2:
        return values, 1
    return np.where(within_gaps(values), np.nan, bridged(values)), rows


def _per_sample(values: Array, each: Array, before: float, after: float) -> Array:
    """Return a value for each sample time, from one for each interval between valid samples, and for the ends."""
    present = np.flatnonzero(np.isfinite(values))
    ends = np.full(present[0], before), np.full(len(values) - 1 - present[-1], after)
    return np.concatenate([np.zeros(1), ends[0], np.repeat(each, np.diff(present)), ends[1]])


def angle_variance(speed: Array, sample_time: float) -> Array:
    """Return the variance of the pump's angle while its speed was not logged.

    A straight line across n sample times is wrong by the unknown time of a step d between the speeds at its ends. The
    variance of its integral is ``d^2 (n^2 - 1) / 12``, in squared sample times. In a gap the speed may also have
    changed and returned: with increments of variance ``s^2`` per sample time, the variance is ``s^2 n (n^2 - 1) / 12``.
    The larger one is used. In a gap at an end of the log the speed is held constant, with a variance of ``s^2 n^3 /
    3``. All are spread evenly. A speed with a sample every so many rows throughout has steps, but no gaps.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Motor speed [rad/s]; NaN where missing.
    sample_time : float
        Time between samples [s].

    Returns
    -------
    ndarray, shape (n,)
        Variance added by the sample time before each sample [rad^2].

    Examples
    --------
    >>> angle_variance(np.array([0.0, 0.0, np.nan, 12.0, 12.0, 12.0]), 1.0).round(3).tolist()
    [0.0, 0.0, 18.0, 18.0, 0.0, 0.0]
    """
    present = np.flatnonzero(np.isfinite(speed))
    if len(present) == len(speed) or len(present) < 2:
        return np.zeros(len(speed))
    n, gap = gaps(speed)
    steps = np.diff(speed[present])
    walk = float(np.sum(steps**2) / np.sum(n))
    open_by = np.maximum(steps**2, np.where(gap, walk * n, 0.0)) * (n**2 - 1.0) / 12.0
    ends = np.array([present[0], len(speed) - 1 - present[-1]], dtype=np.float64)
    before, after = np.where(ends > median(n), walk * ends**2 / 3.0, 0.0)
    return sample_time**2 * _per_sample(speed, open_by / n, float(before), float(after))


def path_variance(position: Array, sample_time: float) -> Array:
    """Return the variance of the piston's position while it was not logged.

    In a gap of n sample times the velocity may have changed by increments of variance ``s^2`` per sample time. The
    variance of the deviation from a straight line is then ``s^2 n^3 / 48`` in the middle, in squared sample times.

    Parameters
    ----------
    position : ndarray, shape (n,)
        Position [m]; NaN where missing.
    sample_time : float
        Time between samples [s].

    Returns
    -------
    ndarray, shape (n,)
        Variance added by the sample time before each sample [m^2].
    """
    present = np.flatnonzero(np.isfinite(position))
    n, gap = gaps(position)
    if not np.any(gap):
        return np.zeros(len(position))
    velocity = np.diff(position[present]) / (n * sample_time)
    walk = float(np.sum(np.diff(velocity) ** 2) / np.sum(n))
    open_by = np.where(gap, walk * n**3 / 48.0, 0.0)
    return sample_time**2 * _per_sample(position, open_by / n, 0.0, 0.0)


def with_gap_uncertainty(
    model: ProcessModel, record: Record, parameters: Parameters
) -> tuple[ProcessModel, Array, NDArray[np.bool_]]:
    """Return a model and its drives, with the uncertainty of straight lines across gaps.

    Parameters
    ----------
    model : ProcessModel
        The process model.
    record : Record
        The log, with the model's drives.
    parameters : dataclass
        The plant's parameters.

    Returns
    -------
    tuple of (ProcessModel, ndarray of shape (samples, drives), ndarray of bool of shape (samples,))
        The model, driven also by the variance that each sample adds to its states, if there is any; its drives without
        missing samples [SI, and the filter's units squared]; and the samples at which measurements can be compared with
        the model.
    """
    drives = [bridged(record[drive]) for drive in model.drives]
    comparable = np.ones(len(record), dtype=np.bool_)
    if POSITION in model.drives:
        beside = _per_sample(record[POSITION], gaps(record[POSITION])[1].astype(np.float64), 1.0, 1.0)
        comparable = np.isfinite(record[POSITION]) | (beside == 0.0)
    if model.opening is not None:
        unknown = {
            drive: (path_variance if drive == POSITION else angle_variance)(record[drive], record.sample_time)
            for drive in model.drives
        }
        added, moved = model.opening(parameters, unknown, record.sample_time)
        if np.any(added > 0.0):
            opened = [state for state in model.states if state.name in moved]
            drives += [added * (moved[state.name] / state.scale) ** 2 for state in opened]
            model = _model_with_gap_drives(model, tuple(state.name for state in opened))
    return model, np.column_stack(drives), comparable


@cache
def _model_with_gap_drives(model: ProcessModel, names: tuple[str, ...]) -> ProcessModel:
    """Return the model with one more drive for each state affected by gaps; its step does not use them."""
    count = len(model.drives)

    def step(state: tuple[Scalar, ...], drives: Any, p: Any, h: Scalar) -> tuple[Scalar, ...]:
        return model.step(state, drives[:count] if count > 1 else drives[0], p, h)

    drives = (*model.drives, *(OPENING + name for name in names))
    return replace(model, name=f"{model.name}_gaps", drives=drives, step=step)
