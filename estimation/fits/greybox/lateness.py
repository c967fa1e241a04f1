"""Delay of a driving channel, from the residuals of a fit: Rao's score statistic."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.fits.greybox.play import crossed_drives
from estimation.fits.greybox.problem import Problem
from estimation.fits.hypotheses import LATEST
from estimation.log_checks.channel_names import POSITION
from plant.arrays import Array

LEAST_LATE = 2e-4
"""Least delay or lead of a channel that is reported [s]."""

LATE_NUDGE = 1e-5
"""Time by which a driving channel is shifted for the finite difference [s]."""


def residuals_and_changes(problem: Problem, theta: Array) -> tuple[Array | None, list[Array]]:
    """Return the residuals under the log's drives, with one model step per sample, and their changes by other drives.

    The other drives are each tested channel, shifted a little, and the courses of an encoder play.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].

    Returns
    -------
    tuple of (ndarray of shape (outputs, blocks) or None, list of ndarray)
        Normalised residuals and their changes, one per channel and then one per course; empty if no channel is tested.
    """
    log = problem.log
    if not log.timed:
        return None, []
    reach = max(1, round(0.5 * log.block / log.sample_time))
    padded = np.pad(log.drives, ((reach, reach), (0, 0)), mode="edge")
    ahead = LATE_NUDGE * (padded[2 * reach :] - padded[: -2 * reach]) / (2 * reach * log.sample_time)
    places = [problem.model.drives.index(channel) for channel in log.timed]
    forward = [log.drives + np.where(np.arange(log.drives.shape[1]) == place, ahead, 0.0) for place in places]
    crossed = crossed_drives(problem) if POSITION in log.timed else []
    known, *found = problem.coarse.disturbed(theta, [log.drives, *forward, *crossed])
    return known, [one - known for one in found]


def unabsorbed_part(slopes: Array, bread: Array, told: NDArray[np.bool_]) -> Callable[[Array], Array]:
    """Return the part of a change of residuals that the determined unknowns cannot absorb.

    Undetermined unknowns are held back by their priors only. In the linear approximation a motor's lead may become
    negative, and would then absorb most of a late pressure.

    Parameters
    ----------
    slopes : ndarray, shape (blocks, unknowns)
        Derivatives of the normalised residuals [dimensionless].
    bread : ndarray, shape (unknowns, unknowns)
        Inverse of the normal equations of all of them, with what is known beforehand [dimensionless].
    told : ndarray of bool, shape (unknowns,)
        Whether the log determines each unknown at all.

    Returns
    -------
    callable
        ``left(change)``, both of shape (blocks,).
    """
    if not np.all(told):  # the inverse of a submatrix, from the inverse of the whole matrix
        across = bread[np.ix_(told, ~told)]
        bread = bread[np.ix_(told, told)] - across @ np.linalg.solve(bread[np.ix_(~told, ~told)], across.T)
        slopes = slopes[:, told]
    return lambda change: change - slopes @ (bread @ (slopes.T @ change))


def lateness(
    timed: Sequence[str], changes: Sequence[Array], errors: Array, left: Callable[[Array], Array]
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the apparent delay of each tested driving channel, and its score statistic (Rao).

    Parameters
    ----------
    timed : sequence of str
        The channels.
    changes : sequence of ndarray, shape (outputs, blocks)
        Change of the normalised residuals by each, see `residuals_and_changes`; others are ignored [dimensionless].
    errors : ndarray, shape (outputs * blocks,)
        The normalised residuals at the solution [dimensionless].
    left : callable
        The part of a change of the residuals that the unknowns do not absorb.

    Yields
    ------
    tuple of (str, tuple of float)
        Channel; how late [s], and the gain in log-likelihood [dimensionless].
    """
    for channel, change in zip(timed, changes, strict=False):
        free = left(change.ravel() / LATE_NUDGE)
        power = float(free @ free)
        if power > 0.0:
            along = float(free @ errors)
            yield channel, (-along / power, 0.5 * along**2 / power)


def latest_channel(late: Mapping[str, tuple[float, float]]) -> tuple[str, float, float]:
    """Return the driving channel whose timing explains most of what a fit leaves.

    Parameters
    ----------
    late : Mapping[str, tuple of float]
        By channel, its apparent delay [s] and the gain, see `lateness`.

    Returns
    -------
    tuple of (str, float, float)
        Channel; delay [s], negative for a lead; and the gain in log-likelihood [dimensionless]. The gain is zero if no
        channel is tested, or if the delay is too short or too long to be believed.
    """
    channel, (behind, gain) = max(late.items(), key=lambda one: one[1][1], default=("", (0.0, 0.0)))
    return channel, behind, gain if LEAST_LATE < abs(behind) < LATEST else 0.0
