"""The loop of error-controlled steps, as plain functions: `plant.solvers.adaptive_kernel` pastes them into a kernel."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from plant.arrays import Array
from plant.solvers.drive_pieces import are_equal, parabolic_piece, slope_at
from plant.solvers.fixed_step_loops import Operation, SideBySide, place_rows, place_shared

TINY = 1e-6
"""Fraction of a sample time within which a step ends at a sample."""

NEARLY = 0.999999
"""If a step takes at least this fraction of the rest of a piece of the drive, it takes the whole rest [fraction]."""


class ControlledKernel(SideBySide, Protocol):
    """Interface of the kernel of error-controlled steps.

    The memory holds, `LANES` numbers each: the states, the new states of a step, rates, old states and their rates, the
    states between, weights of the errors, the error, five numbers that all runs share (drive at a step's start and end,
    its rise at the initial rate, this step and the previous one), the parameters, and the results of `settle_at`.

    Attributes
    ----------
    stages_at, between_at : callable
        A step; and the state at a fraction ``j`` of the last step.
    move : callable
        ``move(from, to)``: copies as many numbers as there are lanes.
    """

    stages_at: Operation
    between_at: Operation
    move: Callable[[int, int], None]


def run_controlled(
    kernel: ControlledKernel,
    initial: Array,
    drive: Array,
    parameters: Array,
    sample_time: float,
    weights: Array,
    bend: float,
    bulge: float,
    longest: float,
    shortest: float,
    states: Array,
) -> None:
    """Fill in the states at the samples of runs side by side.

    Parameters
    ----------
    initial : ndarray, shape (states, lanes)
        Initial states in SI.
    drive : ndarray, shape (n,)
        Drive at the samples [its SI unit], linear between.
    parameters : ndarray, shape (1 or n, lanes, parameters)
        Parameter rows, each of which holds until the next sample.
    sample_time : float
        Seconds between samples [s].
    weights : ndarray, shape (states,)
        Reciprocal of each state's permitted error in a step [one over its unit].
    bend : float
        Amount by which a step may smooth the drive [the drive's unit].
    bulge : float
        See `plant.solvers.drive_pieces.parabolic_piece` [dimensionless].
    longest, shortest : float
        Steps [count of samples].
    states : ndarray, shape (n, states, up to lanes)
        Output array for the states.
    """
    n, block = states.shape[0], kernel.WIDTH * kernel.LANES
    shared = 7 * block + kernel.LANES
    room = np.empty(kernel.NUMBERS + 8)
    work = room[-room.ctypes.data % 64 // 8 :]  # a vector that spans two cache lines takes twice as long
    slots, vectors = work.ctypes.data, range(0, 8 * kernel.LANES, 8 * kernel.VECTOR)
    place_rows(kernel, work, 0, initial, kernel.WIDTH)
    place_shared(kernel, work, 6 * block, weights)
    _store_sample(kernel, work, 0, states, 0)
    begin = end = lost = 0
    start = reach = place = lift = ramp = curvature = 0.0
    size, taken, row, sample = longest, 1.0, -1, 1
    while True:
        if place >= reach and end < n - 1:
            if sample < end and parameters.shape[0] > 1 and not are_equal(parameters[end], parameters[row]):
                # samples before a parameter change are interpolated with the parameters before it
                driven = drive_along_step(lift, ramp, curvature, reach, reach, taken)
                place_shared(kernel, work, shared, (*driven, taken * sample_time, taken * sample_time))
                for first in vectors:
                    kernel.stages_at(slots + first, 0.0)
                sample = _fill_samples(kernel, work, states, sample, end, start, taken)
            begin, place = end, 0.0
            end, lift, ramp, curvature = parabolic_piece(drive, parameters, begin, bend, bulge)
            reach = float(end - begin)
            if row < 0 or parameters.shape[0] > 1:
                row = min(begin, parameters.shape[0] - 1)
                place_rows(kernel, work, shared + 5 * kernel.LANES, parameters[row].T, kernel.COLUMNS)
                for first in vectors:
                    kernel.settle_at(slots + first, 0.0)
        left = reach - place
        size = step_within_piece(size, left, longest, shortest)
        driven = drive_along_step(lift, ramp, curvature, place, reach, size)
        place_shared(kernel, work, shared, (*driven, size * sample_time, taken * sample_time))
        for first in vectors:
            kernel.stages_at(slots + first, 0.0)
        here = begin + place
        sample = _fill_samples(kernel, work, states, sample, here, start, taken)
        if left <= 0.0:
            break
        error = _largest_error(kernel, work, 7 * block, lost)
        # a step of nearly the shortest size is accepted; otherwise it would be retried for ever
        if not error <= 1.0 and NEARLY * size > shortest:
            size = max(size * (0.5 if error < 64.0 else 0.25), shortest)
            continue
        # a shorter step cannot repair a run whose states are NaN: the other runs go on without it
        if error == np.inf:
            lost = _count_nan(kernel, work, 7 * block)
        start, taken = here, size
        place = reach if size == left else place + size
        _accept_step(work, block)
        near = begin + int(place + 0.5)
        if abs(begin + place - near) < TINY:
            _store_sample(kernel, work, 0, states, near)
            if sample == near:
                sample += 1
        size = max(size * step_growth(error), shortest)


def step_within_piece(size: float, left: float, longest: float, shortest: float) -> float:
    """Return a step that ends at the end of its piece of the drive, or leaves enough of the piece for another step.

    Parameters
    ----------
    size : float
        Step that the error allows [count of samples].
    left : float
        Rest of the piece; zero at the end of the run [count of samples].
    longest, shortest : float
        Bounds [count of samples].

    Returns
    -------
    float
        The step [count of samples].
    """
    size = min(size, longest)
    if size > NEARLY * left:
        return left if left > 0.0 else shortest
    return 0.5 * left if size > 0.5 * left else size


def drive_along_step(
    lift: float, ramp: float, curvature: float, place: float, reach: float, size: float
) -> tuple[float, float, float]:
    """Return the drive at a step's start and end, and its rise at the initial rate, along a piece of a parabola.

    Parameters
    ----------
    lift, ramp, curvature : float
        The piece: its start, its mean rise per sample, its curvature [the drive's unit].
    place, reach : float
        Start of the step within the piece, and the length of the piece [count of samples].
    size : float
        The step [count of samples].

    Returns
    -------
    tuple of float
        The three [the drive's unit].
    """
    slope = ramp + curvature * (place - 0.5 * reach)
    start = lift + place * (ramp - 0.5 * curvature * (reach - place))
    return start, start + size * (slope + 0.5 * curvature * size), size * slope


def step_growth(error: float) -> float:
    """Return the growth factor of the next step, for a third-order scheme.

    Parameters
    ----------
    error : float
        Mean square of the weighted errors [dimensionless].

    Returns
    -------
    float
        The factor [dimensionless].
    """
    if error < 1.2e-4:
        return 4.0
    if error < 8e-3:
        return 2.0
    if error < 0.03:
        return 1.6
    if error < 0.13:
        return 1.25
    return 0.9 if error > 0.5 else 1.0


def _largest_error(kernel: ControlledKernel, work: Array, place: int, lost: int) -> float:
    """Return the largest error at a place; infinite if more errors are NaN than the number of runs already lost."""
    error = 0.0
    for lane in range(kernel.LANES):
        if work[place + lane] > error:
            error = work[place + lane]
    return error if _count_nan(kernel, work, place) <= lost else np.inf


def _count_nan(kernel: ControlledKernel, work: Array, place: int) -> int:
    """Return the number of errors at a place that are NaN."""
    count = 0
    for lane in range(kernel.LANES):
        if work[place + lane] != work[place + lane]:
            count += 1
    return count


def _accept_step(work: Array, block: int) -> None:
    """Make a step's new states the current ones, and the current states and rates the old ones; each is a block."""
    for i in range(block):
        work[3 * block + i] = work[i]
        work[4 * block + i] = work[2 * block + i]
        work[i] = work[block + i]


def _fill_samples(
    kernel: ControlledKernel, work: Array, states: Array, sample: int, here: float, start: float, taken: float
) -> int:
    """Copy the states at the samples within the last step, and return the first sample that remains.

    The step began at ``start``, ended at ``here`` and took ``taken`` samples; ``sample`` is the first that is not
    stored.
    """
    while sample < here - TINY:
        for first in range(0, 8 * kernel.LANES, 8 * kernel.VECTOR):
            kernel.between_at(work.ctypes.data + first, (sample - start) / taken)
        _store_sample(kernel, work, 5 * kernel.WIDTH * kernel.LANES, states, sample)
        sample += 1
    return sample


def _store_sample(kernel: ControlledKernel, work: Array, place: int, states: Array, sample: int) -> None:
    """Copy the states at a place to a sample's row."""
    count = states.shape[2]
    for i in range(kernel.WIDTH):
        if count == kernel.LANES:
            kernel.move(work.ctypes.data + 8 * (place + kernel.LANES * i), states[sample, i].ctypes.data)
        else:
            for lane in range(count):
                states[sample, i, lane] = work[place + kernel.LANES * i + lane]


INLINED_LOOPS = (
    place_rows,
    place_shared,
    are_equal,
    slope_at,
    step_within_piece,
    drive_along_step,
    step_growth,
    _count_nan,
    _largest_error,
    _accept_step,
    _store_sample,
    _fill_samples,
)
"""Parts of the loop and of `parabolic_piece`, which are inlined."""
