"""A bank of chamber filters as one estimate: selection of filters, replay of the log, and their mean.

At every sample the mixture depends on earlier samples only (Alspach and Sorenson 1972, equations 26 to 33): a weight is
that at the beginning of its block. Hopeless filters are dropped block by block; from `FIRST_LOOK` on the remaining ones
process all earlier samples again (`estimation.filters.relinearised`).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain, groupby
from typing import NamedTuple

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Trace, empty_trace
from estimation.filters.batch import filter_batch
from estimation.filters.relinearised import relinearised

BLOCKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Ends of the first blocks [s]; each later end is `GROWTH` times the one before."""

GROWTH = 3.0
"""Ratio of later blocks' ends [dimensionless]."""

FIRST_LOOK = 2.0
"""Time from which the log so far is processed again [s]: by then it tells a wrong minimum from a right one."""

MOST_SURVIVORS = {0.0: 1000, 0.5: 64, 1.0: 16}
"""Filters of a model that continue after a block that ends at this time or later [s]."""

MOST_REPROCESSED, KEPT = 4, 2
"""Filters of a model that process the log again, and how many of them continue."""

SAME_FILTER_DEVIATIONS = 1.0
"""Deviations of bulk modulus and leakage within which two filters count as one [dimensionless]."""

LONGEST_REPROCESSED = 300_000
"""Longest log so far that is processed again [samples]."""


@dataclass(frozen=True, eq=False)
class Member:
    """One filter of the bank.

    Parameters
    ----------
    problem : FilterProblem
        The whole log with the filter's prior.
    mean, covariance : ndarray, shapes (n,) and (n, n)
        Its belief, scaled.
    score : float
        Log of its prior weight and likelihood [dimensionless].
    """

    problem: FilterProblem
    mean: Array
    covariance: Array
    score: float


class Reading(NamedTuple):
    """Result of a filter bank on a log.

    Parameters
    ----------
    problem : FilterProblem
        The likeliest filter's task.
    online : Trace
        The mixture sample by sample, from what came before; scores and innovations of `again`. NaN from where every
        filter diverged.
    again : Trace
        The likeliest filter's last reading of the whole log.
    """

    problem: FilterProblem
    online: Trace
    again: Trace


def run_bank(members: Sequence[Member], near: tuple[int, ...]) -> Reading:
    """Filter a log with a bank.

    Parameters
    ----------
    members : sequence of Member
        Filters of one log; those of a model run side by side. All models have the same states.
    near : tuple of int
        Places of the states in which filters are told apart.
    """
    first = members[0].problem
    samples, every = len(first.measured), first.every
    trace = empty_trace(replace(first, keep_innovations=False))
    trace.track[:], trace.track_variance[:] = np.nan, np.nan
    heard, begin = list(members), 0
    for end in _block_ends(samples, every, first.sample_time):
        weights = _weights(heard)
        found = list(_block_traces(heard, begin, end))
        rows = slice(-(-begin // every) + (begin > 0), (end - 1) // every + 1)
        skipped = int(begin > 0)
        tracks = np.array([one.track[skipped:] for one in found])
        spreads = np.array([one.track_variance[skipped:] for one in found])
        trace.track[rows], trace.track_variance[rows] = _mixture_moments(weights, tracks, spreads)
        after = zip(heard, found, strict=True)
        heard = [
            Member(was.problem, one.mean, one.covariance, was.score + one.log_likelihood)
            for was, one in after
            if np.isfinite(one.log_likelihood) and np.all(np.isfinite(one.mean))
        ]
        if not heard:
            lost = np.full_like(first.mean, np.nan)
            gone = trace._replace(mean=lost, covariance=np.outer(lost, lost), log_likelihood=np.nan)
            return Reading(first, gone, gone)
        heard = _survivors(heard, near, end, samples)
        begin = (end - 1) // every * every
    return _final_reading(trace, heard)


def _block_ends(samples: int, every: int, sample_time: float) -> list[int]:
    """Return the ends of blocks: one past a sample that the track keeps, or the end of the log."""
    times = list(BLOCKS)
    while times[-1] < samples * sample_time:
        times.append(GROWTH * times[-1])
    ends = {round(time / sample_time) // every * every + 1 for time in times}
    return [*sorted(end for end in ends if 1 < end < samples), samples]


def _block_task(problem: FilterProblem, begin: int, end: int) -> FilterProblem:
    """Return the task of a block, from the last sample of the one before, which is not used twice."""
    measured = problem.measured[begin:end]
    if begin > 0:
        measured = measured.copy()
        measured[0] = np.nan
    return replace(problem, drives=problem.drives[begin:end], measured=measured)


def _block_traces(heard: Sequence[Member], begin: int, end: int) -> Iterable[Trace]:
    groups = (list(group) for _, group in groupby(heard, key=lambda member: member.problem.model.name))
    return chain.from_iterable(
        filter_batch(
            replace(_block_task(member.problem, begin, end), mean=member.mean, covariance=member.covariance)
            for member in group
        )
        for group in groups
    )


def _weights(heard: Sequence[Member]) -> Array:
    scores = np.array([member.score for member in heard])
    with np.errstate(under="ignore"):
        weights = np.exp(scores - np.max(scores))
    return weights / np.sum(weights)


def _mixture_moments(weights: Array, means: Array, variances: Array) -> tuple[Array, Array]:
    """Return the moments of a mixture; diverged filters and those without weight are left out."""
    sound = (weights > 1e-12) & np.all(np.isfinite(means), axis=(1, 2)) & np.all(np.isfinite(variances), axis=(1, 2))
    if not np.any(sound):
        return np.full_like(means[0], np.nan), np.full_like(means[0], np.nan)
    share = weights[sound] / np.sum(weights[sound])
    mean = np.tensordot(share, means[sound], 1)
    return mean, np.tensordot(share, variances[sound] + (means[sound] - mean) ** 2, 1)


def _survivors(heard: list[Member], near: tuple[int, ...], end: int, samples: int) -> list[Member]:
    """Return the filters that continue, model by model, after processing the log so far again if it is time."""
    time = end * heard[0].problem.sample_time
    again = (time >= FIRST_LOOK or end == samples) and end <= LONGEST_REPROCESSED
    most = [count for since, count in MOST_SURVIVORS.items() if time >= since][-1]
    kept: list[Member] = []
    for _, group in groupby(heard, key=lambda member: member.problem.model.name):
        best = sorted(group, key=lambda member: -member.score)
        if again:
            few = (_reprocessed(member, end) for member in _distinct_filters(best, near)[:MOST_REPROCESSED])
            best = sorted((one for one in few if np.isfinite(one.score)), key=lambda member: -member.score)
            best = _distinct_filters(best, near)[:KEPT]
        kept += best[:most]
    return kept or heard


def _reprocessed(member: Member, end: int) -> Member:
    found = relinearised(_block_task(member.problem, 0, end), member.mean, member.covariance)
    return replace(member, mean=found.mean, covariance=found.covariance, score=found.log_likelihood)


def _distinct_filters(members: Sequence[Member], near: tuple[int, ...]) -> list[Member]:
    """Return the likelier of any two filters that count as one."""
    kept: list[Member] = []
    for member in members:
        if not any(_count_as_one(member, other, near) for other in kept):
            kept.append(member)
    return kept


def _count_as_one(one: Member, other: Member, near: tuple[int, ...]) -> bool:
    places = list(near)
    deviation = np.sqrt(np.maximum(np.diag(other.covariance)[places], 0.0))  # rounding may make a variance negative
    return bool(np.all(np.abs(one.mean - other.mean)[places] < SAME_FILTER_DEVIATIONS * deviation))


def _final_reading(trace: Trace, heard: Sequence[Member]) -> Reading:
    """Return the mixture after the last sample, with the innovations of its likeliest filter."""
    weights = _weights(heard)
    mean = np.sum([weight * member.mean for weight, member in zip(weights, heard, strict=True)], axis=0)
    spread = np.sum(
        [
            weight * (member.covariance + np.outer(member.mean - mean, member.mean - mean))
            for weight, member in zip(weights, heard, strict=True)
        ],
        axis=0,
    )
    best = max(heard, key=lambda member: member.score)
    scored = relinearised(replace(best.problem, keep_innovations=True), best.mean, best.covariance, most=1)
    trace.track[-1], trace.track_variance[-1] = mean, np.diag(spread)
    scores = {name: getattr(scored, name) for name in ("nis", "count", "residuals", "residual_variances")}
    online = trace._replace(mean=mean, covariance=spread, log_likelihood=best.score, **scores)
    return Reading(best.problem, online, scored)
