"""Whether a driving channel comes late, by the residuals of a fit: Rao's score statistic."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.fits.greybox.play import crossed_drives
from estimation.fits.greybox.problem import Problem
from estimation.fits.hypotheses import LATEST
from estimation.log_checks.channel_names import POSITION
from plant.arrays import Array

LEAST_LATE = 2e-4
"""Time below which no channel is said to come late or early [s]."""

LATE_NUDGE = 1e-5
"""Time by which a driving channel is brought forward to see what its timing does [s]."""


def changes_beside(problem: Problem, theta: Array) -> tuple[Array | None, list[Array]]:
    """Return the residuals under the log's drives, with one model step a sample, and how others change them.

    The others are each channel brought forward a little that is asked whether it comes late, and the courses of a play.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].

    Returns
    -------
    tuple of (ndarray of shape (outputs, blocks) or None, list of ndarray)
        Normalised residuals, and changes of them, one a channel and then one a course; none where no channel is asked.
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


def left_by(slopes: Array, bread: Array, told: NDArray[np.bool_]) -> Callable[[Array], Array]:
    """Return the part of a change of residuals that the determined unknowns cannot absorb.

    Only what is known beforehand keeps the others from going far, and as slopes have it a lead of the motor may be less
    than none: it would take up most of a pressure that is late.

    Parameters
    ----------
    slopes : ndarray, shape (blocks, unknowns)
        Derivatives of the normalised residuals [dimensionless].
    bread : ndarray, shape (unknowns, unknowns)
        Inverse of the normal equations of all of them, with what is known beforehand [dimensionless].
    told : ndarray of bool, shape (unknowns,)
        Whether the log tells something of each.

    Returns
    -------
    callable
        ``left(change)``, both of shape (blocks,).
    """
    if not np.all(told):  # the inverse of a part of a matrix, from the whole inverse
        across = bread[np.ix_(told, ~told)]
        bread = bread[np.ix_(told, told)] - across @ np.linalg.solve(bread[np.ix_(~told, ~told)], across.T)
        slopes = slopes[:, told]
    return lambda change: change - slopes @ (bread @ (slopes.T @ change))


def lateness(
    timed: Sequence[str], changes: Sequence[Array], errors: Array, left: Callable[[Array], Array]
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the apparent delay of each driving channel asked for, and its score statistic (Rao).

    Parameters
    ----------
    timed : sequence of str
        The channels.
    changes : sequence of ndarray, shape (outputs, blocks)
        By how much each changes the normalised residuals, see `changes_beside`; more are passed over [dimensionless].
    errors : ndarray, shape (outputs * blocks,)
        The normalised residuals at the solution [dimensionless].
    left : callable
        What the unknowns do not take up of a change of the residuals.

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


def most_late(late: Mapping[str, tuple[float, float]]) -> tuple[str, float, float]:
    """Return the driving channel whose timing explains most of what a fit leaves.

    Parameters
    ----------
    late : Mapping[str, tuple of float]
        By channel, how late it seems [s], and what that is worth, see `lateness`.

    Returns
    -------
    tuple of (str, float, float)
        Channel; how late [s], negative where it is early; and the gain in log-likelihood [dimensionless], zero where
        no channel is asked, or the time is too short or too long to be believed.
    """
    channel, (behind, gain) = max(late.items(), key=lambda one: one[1][1], default=("", (0.0, 0.0)))
    return channel, behind, gain if LEAST_LATE < abs(behind) < LATEST else 0.0
