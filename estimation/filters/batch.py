"""`filter_batch(rule, problems) -> traces`: thousands of filters, 32 side by side, blocks of them on every core.

Every filter has its own prior, parameters, noise and measurements; they share the model, the channels and the sampling.
A filter gives the same bits here and alone (`estimation.engine.runner.run_rule`).
"""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import islice

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.engine.contract import FilterProblem, Trace, empty_trace
from estimation.engine.kernels import LANES
from estimation.engine.rule import Rule
from estimation.engine.runner import aligned_array, final_traces, prepared_kernel, run_rule
from estimation.filters.ekf import EKF
from plant.compiled.source import ROWS
from plant.errors import HydrostateError

FEWEST_IN_LANES = 8
"""Smallest block that is run side by side; in smaller ones filters run in turn, since empty lanes cost as much as full
ones."""


def filter_batch(
    problems: Iterable[FilterProblem],
    rule: Rule = EKF,
    *,
    workers: int = 1,
    lanes: int = LANES,
) -> Iterator[Trace]:
    """Run many filters.

    Parameters
    ----------
    problems : iterable of FilterProblem
        The tasks, in any number; they are drawn one block at a time, so they need not fit in memory together.
    workers : int
        Threads, each running one block at a time.
    lanes : int
        Tasks in a block, side by side: empty lanes cost as much as full ones, and each width is compiled separately.

    Yields
    ------
    Trace
        One for each task, in the tasks' order; innovations are not kept.

    Raises
    ------
    HydrostateError
        If the tasks of a block differ in model, channels, sampling, settings or length.
    """
    blocks, run_block = _blocks(problems, lanes), partial(_run_block, rule, lanes)
    if workers == 1:
        for block in blocks:
            yield from run_block(block)
        return
    with ThreadPoolExecutor(max_workers=workers) as executor:
        while group := list(islice(blocks, workers)):
            for traces in executor.map(run_block, group):
                yield from traces


def _blocks(problems: Iterable[FilterProblem], lanes: int) -> Iterator[list[FilterProblem]]:
    source = iter(problems)
    while block := list(islice(source, lanes)):
        yield block


def _run_block(rule: Rule, width: int, block: Sequence[FilterProblem]) -> list[Trace]:
    first = block[0]
    for problem in block:
        _require_alike(first, problem)
    if len(block) < FEWEST_IN_LANES or len(first.measured) < ROWS:
        return [run_rule(rule, problem) for problem in block]
    lanes = [block[min(lane, len(block) - 1)] for lane in range(width)]
    places, kernel, work = prepared_kernel(rule, lanes)
    track = np.empty(((len(first.measured) - 1) // first.every + 1, first.model.width, width))
    track_variance, logs = np.empty_like(track), np.zeros((len(first.channels), width))
    drives = [np.ascontiguousarray(problem.drives, np.float64) for problem in lanes]
    measured = [np.ascontiguousarray(problem.measured, np.float64) for problem in lanes]
    nothing = np.empty((0, len(first.channels)))
    room = aligned_array(len(first.model.drives) + len(first.channels), ROWS, width)
    results = track, track_variance, logs, nothing, nothing
    where = _addresses(drives), _addresses(measured)
    kernel.run(work.ravel(), *where, room, len(first.measured), first.substeps, first.every, results)
    tracks, spreads = (np.ascontiguousarray(np.moveaxis(one, -1, 0)) for one in (track, track_variance))
    blank = empty_trace(replace(first, keep_innovations=False))
    traces = [blank._replace(track=own, track_variance=spread) for own, spread in zip(tracks, spreads, strict=True)]
    return final_traces(places, lanes, work, logs, traces)[: len(block)]


def _addresses(arrays: Sequence[Array]) -> IntArray:
    """Return the addresses at which arrays begin."""
    return np.array([one.ctypes.data for one in arrays])


SHARED_PROPERTIES = ("channels", "sample_time", "substeps", "every", "robust", "settings")
"""Properties that the filters of a block share besides the model."""


def _require_alike(first: FilterProblem, problem: FilterProblem) -> None:
    for name in SHARED_PROPERTIES:
        if getattr(problem, name) != getattr(first, name):
            raise HydrostateError(
                f"filters of a batch must agree in {name}, got {getattr(first, name)} and {getattr(problem, name)}"
            )
    if problem.model is not first.model:
        raise HydrostateError(
            f"filters of a batch must share one model, got {first.model.name} and {problem.model.name}"
        )
    lengths = (len(first.measured), len(problem.measured), len(problem.drives))
    if len(set(lengths)) > 1:
        raise HydrostateError(
            f"filters of a batch must have logs of one length, got {lengths[0]} and {lengths[1]}, "
            f"drives of {lengths[2]}"
        )
