"""`filter_batch(rule, problems) -> traces`: thousands of filters, 32 side by side, blocks of them on every core.

Every filter has its own prior, parameters, noise and measurements; what they share is the model, the channels and the
sampling. A filter gives the same bits here and alone (`estimation.compiled.run_rule`).
"""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from estimation.algebra import EKF, Rule
from estimation.compiled import constant_row, read_off, run_rule
from estimation.filter import FilterProblem, Trace
from estimation.kernels import LANES, compile_lanes
from estimation.layout import layout
from plant.errors import HydrostateError

Array = NDArray[np.float64]

STRETCH = 512
"""Samples of all lanes that are laid side by side at a time."""

FEWEST_IN_LANES = 8
"""A block of fewer filters is run one after the other: empty lanes cost as much as full ones."""


def filter_batch(
    problems: Iterable[FilterProblem],
    rule: Rule = EKF,
    *,
    settings: dict[str, float] | None = None,
    workers: int = 1,
) -> Iterator[Trace]:
    """Run many filters.

    Parameters
    ----------
    problems : iterable of FilterProblem
        The tasks, in any number; a block of 32 is drawn when it is its turn, so they need not fit in memory together.
    rule : Rule
        The filter.
    settings : dict[str, float], optional
        The rule's settings with their values, in the rule's order [each in its own unit].
    workers : int
        Threads, each running one block at a time.

    Yields
    ------
    Trace
        One a task, in the tasks' order; innovations are not kept.

    Raises
    ------
    HydrostateError
        If the tasks of a block differ in model, channels, sampling or length.
    """
    blocks = _blocks(problems)
    if workers == 1:
        for block in blocks:
            yield from _run_block(rule, block, settings or {})
        return
    with ThreadPoolExecutor(max_workers=workers) as executor:
        while group := list(islice(blocks, workers)):
            for traces in executor.map(lambda block: _run_block(rule, block, settings or {}), group):
                yield from traces


def _blocks(problems: Iterable[FilterProblem]) -> Iterator[list[FilterProblem]]:
    source = iter(problems)
    while block := list(islice(source, LANES)):
        yield block


def _run_block(rule: Rule, block: Sequence[FilterProblem], settings: dict[str, float]) -> list[Trace]:
    first = block[0]
    for problem in block:
        _require_alike(first, problem)
    if len(block) < FEWEST_IN_LANES:
        return [run_rule(rule, problem, settings) for problem in block]
    places = layout(rule, first.model, first.channels)
    kernel = compile_lanes(rule, first.model, first.channels)
    lanes = [block[min(lane, len(block) - 1)] for lane in range(LANES)]
    state = np.stack([places.start(problem.mean, problem.covariance) for problem in lanes], axis=-1)
    rows = np.stack([constant_row(problem, settings) for problem in lanes], axis=-1).ravel()
    track = np.empty(((len(first.measured) - 1) // first.every + 1, first.model.width, LANES))
    track_variance = np.empty_like(track)
    logs = np.zeros((len(first.channels), LANES))
    carried = state.ravel()
    for begin, drives, measured in _stretches(lanes):
        kernel(carried, rows, drives, measured, begin, first.substeps, first.every, track, track_variance, logs)
    variances = np.stack([problem.variances for problem in lanes], axis=-1)
    final = read_off(places, first.model.width, state, logs, variances)
    tracks, spreads = (np.ascontiguousarray(np.moveaxis(one, -1, 0)) for one in (track, track_variance))
    nothing = np.empty((0, len(first.channels)))
    return [
        Trace(
            mean=final.mean[lane],
            covariance=final.covariance[lane],
            track=tracks[lane],
            track_variance=spreads[lane],
            nis=final.nis[lane],
            count=final.count[lane],
            log_likelihood=float(final.log_likelihood[lane]),
            residuals=nothing,
            residual_variances=nothing,
        )
        for lane in range(len(block))
    ]


def _stretches(lanes: Sequence[FilterProblem]) -> Iterator[tuple[int, Array, Array]]:
    """Yield the logs of all lanes side by side, so much at a time as stays in the processor's cache."""
    samples = len(lanes[0].measured)
    longest = min(STRETCH, samples) + 1
    drives = np.empty((longest, lanes[0].drives.shape[1], LANES))
    measured = np.empty((longest, lanes[0].measured.shape[1], LANES))
    for begin in range(0, samples, STRETCH):
        first, end = max(begin - 1, 0), min(begin + STRETCH, samples)
        for lane, problem in enumerate(lanes):
            drives[: end - first, :, lane] = problem.drives[first:end]
            measured[: end - first, :, lane] = problem.measured[first:end]
        yield first, drives[: end - first], measured[: end - first]


def _require_alike(first: FilterProblem, problem: FilterProblem) -> None:
    if (
        problem.model is first.model
        and (problem.channels, problem.sample_time, problem.substeps, problem.every)
        == (first.channels, first.sample_time, first.substeps, first.every)
        and problem.measured.shape == first.measured.shape
    ):
        return
    for name in ("channels", "sample_time", "substeps", "every"):
        if getattr(problem, name) != getattr(first, name):
            raise HydrostateError(
                f"filters of a batch must agree in {name}, got {getattr(first, name)} and {getattr(problem, name)}"
            )
    if problem.model is not first.model:
        raise HydrostateError(
            f"filters of a batch must share one model, got {first.model.name} and {problem.model.name}"
        )
    raise HydrostateError(
        f"filters of a batch must have logs of one length, got {len(first.measured)} and {len(problem.measured)}"
    )
