"""The loops of fixed-step runs, as plain functions; a plant's step is generated next to them and runs along a drive.

`plant.solvers.trajectory` and `plant.solvers.fixed_step_kernel` paste them into kernel files. The parameter `kernel`
stands for the other contents of such a file.
"""

from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

import numpy as np

from plant.arrays import Array

Operation: TypeAlias = Callable[[int, float], None]
"""``operation(address, j)``: works on numbers in memory (`plant.compiled.native.operations.stepping`)."""

Advance: TypeAlias = Callable[[Any, int], Any]
"""``advance(numbers, address)``: on a tuple and on numbers in memory (`plant.compiled.native.operations.advancing`)."""


class RunKernel(Protocol):
    """Interface of the kernel of one run.

    The memory holds the states at the last sample, the step's length, the parameters, and the results of `settle_at`
    from these two; from step to step the state is a tuple.

    Attributes
    ----------
    WIDTH, COLUMNS, NUMBERS : int
        Number of states, of parameters, and of the numbers in memory.
    load, store : callable
        ``load(address)`` and ``store(state, address)``: read a state from memory, and write it.
    settle_at : callable
        Computes what is the same at every step.
    advance : callable
        The step, from the state and the drive at its start and end.
    """

    WIDTH: int
    COLUMNS: int
    NUMBERS: int
    load: Callable[[int], Any]
    store: Callable[[Any, int], None]
    settle_at: Operation
    advance: Advance


class SideBySide(Protocol):
    """Common interface of the kernels of runs side by side.

    Attributes
    ----------
    LANES, VECTOR : int
        Number of runs side by side, and of runs that are stepped at a time.
    WIDTH, COLUMNS, NUMBERS : int
        Number of states, of parameters, and of the numbers in memory.
    settle_at : callable
        Computes what is the same at every step.
    """

    LANES: int
    VECTOR: int
    WIDTH: int
    COLUMNS: int
    NUMBERS: int
    settle_at: Operation


class LanesKernel(SideBySide, Protocol):
    """Interface of the kernel of fixed steps side by side.

    The memory holds, `LANES` numbers each, the states, the drive at the last sample and its rise in a step, the step's
    length, the parameters, and the results of `settle_at` from these.

    Attributes
    ----------
    step_at : callable
        Step number ``j`` after the last sample.
    """

    step_at: Operation


def run_alone(
    kernel: RunKernel, initial: Array, drive: Array, parameters: Array, sample_time: float, substeps: int
) -> Array:
    """Return the states of one run at its samples.

    Parameters
    ----------
    initial : ndarray, shape (states,)
        Initial state in SI.
    drive : ndarray, shape (n,)
        Drive at the samples [its SI unit], linear between.
    parameters : ndarray, shape (1 or n, parameters)
        Parameter rows, each of which holds until the next sample.
    sample_time : float
        Seconds between samples [s].
    substeps : int
        Steps per sample.

    Returns
    -------
    ndarray, shape (n, states)
        The states.
    """
    n, last_row = drive.shape[0], parameters.shape[0] - 1
    states, work = np.empty((n, kernel.WIDTH)), np.empty(kernel.NUMBERS)
    slots = work.ctypes.data
    for i in range(kernel.WIDTH):
        work[i] = initial[i]
    work[kernel.WIDTH] = sample_time / substeps
    state = kernel.load(slots)
    for k in range(n):
        for i in range(kernel.WIDTH):
            states[k, i] = work[i]
        if k == n - 1:
            break
        if k == 0 or last_row > 0:
            for i in range(kernel.COLUMNS):
                work[kernel.WIDTH + 1 + i] = parameters[min(k, last_row), i]
            kernel.settle_at(slots, 0.0)
        rise = (drive[k + 1] - drive[k]) / substeps
        for j in range(substeps):
            start = drive[k] + j * rise
            state = kernel.advance((*state, start, start + rise), slots)
        kernel.store(state, slots)
    return states


def run_side_by_side(
    kernel: LanesKernel,
    initial: Array,
    drive: Array,
    parameters: Array,
    sample_time: float,
    substeps: int,
    states: Array,
) -> None:
    """Fill in the states at the samples of runs side by side.

    Parameters
    ----------
    initial : ndarray, shape (states, lanes)
        Initial states in SI.
    drive : ndarray, shape (n, lanes)
        Drives at the samples [their SI unit], linear between.
    parameters : ndarray, shape (lanes, parameters)
        Parameter rows.
    sample_time : float
        Seconds between samples [s].
    substeps : int
        Steps per sample.
    states : ndarray, shape (n, states, up to lanes)
        Output array for the states.
    """
    room = np.empty(kernel.NUMBERS + 8)
    work = room[-room.ctypes.data % 64 // 8 :]  # a vector that spans two cache lines takes twice as long
    slots = work.ctypes.data
    drives = kernel.WIDTH * kernel.LANES
    rises, paces, known = drives + kernel.LANES, drives + 2 * kernel.LANES, drives + 3 * kernel.LANES
    place_rows(kernel, work, 0, initial, kernel.WIDTH)
    place_shared(kernel, work, paces, (sample_time / substeps,))
    place_rows(kernel, work, known, parameters.T, kernel.COLUMNS)
    for first in range(0, 8 * kernel.LANES, 8 * kernel.VECTOR):
        kernel.settle_at(slots + first, 0.0)
    n, _, count = states.shape
    for k in range(n):
        for i in range(kernel.WIDTH):
            for lane in range(count):
                states[k, i, lane] = work[i * kernel.LANES + lane]
        if k == n - 1:
            break
        for lane in range(kernel.LANES):
            work[drives + lane] = drive[k, lane]
            work[rises + lane] = (drive[k + 1, lane] - drive[k, lane]) / substeps
        for j in range(substeps):
            for first in range(0, 8 * kernel.LANES, 8 * kernel.VECTOR):
                kernel.step_at(slots + first, float(j))


def place_rows(kernel: SideBySide, work: Array, place: int, values: Array, count: int) -> None:
    """Write the numbers of runs side by side to their places in memory.

    Parameters
    ----------
    work : ndarray, shape (numbers,)
        All numbers.
    values : ndarray, shape (count or more, lanes)
        The numbers [any unit].
    count : int
        How many of each run.
    """
    for i in range(count):
        for lane in range(kernel.LANES):
            work[place + i * kernel.LANES + lane] = values[i, lane]


def place_shared(kernel: SideBySide, work: Array, place: int, values: Array | tuple[float, ...]) -> None:
    """Write numbers that all runs share to their places in memory.

    Parameters
    ----------
    work : ndarray, shape (numbers,)
        All numbers.
    values : ndarray, shape (count,), or tuple of float
        The numbers [any unit].
    """
    for i in range(len(values)):
        for lane in range(kernel.LANES):
            work[place + i * kernel.LANES + lane] = values[i]
