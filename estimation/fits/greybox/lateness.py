"""Delay of a channel, from the residuals of a fit: Rao's score statistic."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from estimation.fits.greybox.deviations import Information
from estimation.fits.greybox.play import ShownPlay, crossed_drives, shown_play
from estimation.fits.greybox.problem import Problem
from estimation.fits.hypotheses import LATEST
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from plant.arrays import Array

LEAST_LATE = 2e-4
"""Least delay or lead of a channel that is reported [s]."""

LATE_NUDGE = 1e-5
"""Time by which a channel is shifted for the finite difference [s]."""

LEAD = "speed_lead"
"""The motor's lead between samples, which is not negative."""

BY_CHANCE = 0.5 * 2.39**2
"""Gain in log-likelihood that one of three channels on time exceeds in one log of twenty [dimensionless]."""


Delays: TypeAlias = dict[str, tuple[float, float, float]]
"""By channel: how late it seems [s], and what removing that does to first order: the gain in log-likelihood
[dimensionless], and the change of bulk modulus [fraction]."""


def residuals_and_changes(problem: Problem, theta: Array, errors: Array) -> tuple[Array | None, list[Array]]:
    """Return the residuals under the log's drives, with one model step per sample, and their changes by other drives.

    The other drives are each tested channel, shifted a little, and the courses of an encoder play. A pressure that is
    late is the same log as drives that are all early. The changes have the problem's own steps: where make-up valves
    fill a small chamber within a sample, steps of a sample chatter, and a small shift seems to change the run by far
    more than noise, so that no delay could be seen.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    errors : ndarray, shape (outputs, blocks)
        The normalised residuals there, with its own steps [dimensionless].

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
    columns = np.array(problem.model.drives)
    forward = [
        log.drives - ahead if channel == PRESSURE else log.drives + np.where(columns == channel, ahead, 0.0)
        for channel in log.timed
    ]
    crossed = crossed_drives(problem) if POSITION in log.timed else []
    (known,) = problem.coarse.disturbed(theta, [log.drives])
    return known, [one - errors for one in problem.disturbed(theta, [*forward, *crossed])]


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
    """Yield the apparent delay of each tested channel, and its score statistic (Rao).

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


def late_and_play(
    problem: Problem, known_of: Information, moved: Sequence[Array], told: NDArray[np.bool_]
) -> tuple[Delays, ShownPlay]:
    """Return the apparent delays of channels, and what the residuals show of an encoder's play.

    Parameters
    ----------
    problem : Problem
        The problem.
    known_of : Information
        What its solution knows of the unknowns.
    moved : sequence of ndarray, shape (outputs, blocks)
        Changes of the residuals, see `residuals_and_changes`; empty if no channel is tested [dimensionless].
    told : ndarray of bool, shape (unknowns,)
        Whether the log determines each unknown at all.

    Returns
    -------
    tuple of (Delays, ShownPlay)
        Apparent delays by channel, and the play.
    """
    timed, left_over = problem.log.timed, known_of.left_over
    left = unabsorbed_part(known_of.fitted_slopes, known_of.fitted_bread, told)
    names = [problem.model.unknowns[place] for place in known_of.felt]

    def softened(held: NDArray[np.bool_]) -> Callable[[Array], float]:
        """Return how bulk modulus answers a change of residuals if the unknowns that are not ``held`` stay."""
        slopes = known_of.fitted_slopes[:, held]
        if "bulk_modulus" not in names or not held[place := names.index("bulk_modulus")]:
            return lambda _: 0.0
        kept = np.linalg.inv(np.linalg.inv(known_of.fitted_bread)[np.ix_(held, held)])[np.count_nonzero(held[:place])]
        return lambda one: float(kept @ (slopes.T @ one.ravel()))

    # a lead below zero would absorb part of a late pressure, but there is none: bulk modulus absorbs that part.
    # a late speed is such a lead itself
    beside_lead = softened(np.array([name != LEAD for name in names]) & told)
    answers = {channel: softened(told) if channel == SPEED else beside_lead for channel in timed}

    def taken(one: Array) -> Iterable[tuple[str, float]]:
        return zip(names, known_of.response(one), strict=False)

    return (
        _delays(timed, moved, left_over, left, answers),
        shown_play(moved[len(timed) :], left_over, left, taken),
    )


def _delays(
    timed: Sequence[str],
    changes: Sequence[Array],
    errors: Array,
    left: Callable[[Array], Array],
    answers: Mapping[str, Callable[[Array], float]],
) -> Delays:
    """Return the delays, with what bulk modulus takes up (``answers``) of each; the rest as in `lateness`."""
    by_channel = dict(zip(timed, changes, strict=False))
    return {
        channel: (behind, gain, behind * answers[channel](by_channel[channel]) / LATE_NUDGE)
        for channel, (behind, gain) in lateness(timed, changes, errors, left)
    }


def latest_channel(late: Mapping[str, tuple[float, ...]]) -> tuple[str, float, float]:
    """Return the channel whose timing explains most of what a fit leaves.

    Parameters
    ----------
    late : Mapping[str, tuple of float]
        By channel, its apparent delay [s] and the gain, see `lateness`, and what may follow.

    Returns
    -------
    tuple of (str, float, float)
        Channel; delay [s], negative for a lead; and the gain in log-likelihood [dimensionless]. The gain is zero if no
        channel is tested, or if the delay is too short or too long to be believed.
    """
    channel, (behind, gain, *_) = max(late.items(), key=lambda one: one[1][1], default=("", (0.0, 0.0)))
    return channel, behind, gain if LEAST_LATE < abs(behind) < LATEST else 0.0


def omitted_delay_doubt(late: Delays) -> float:
    """Return the doubt of bulk modulus from a delay that no fit includes, though it is hardly chance.

    A delay is fitted from a gain of 10 on, so one of four deviations is left out. Where oil leaks off within
    milliseconds, a lag of the pressure looks like softer oil.

    Parameters
    ----------
    late : Delays
        The apparent delays [s], their gains and changes [dimensionless].

    Returns
    -------
    float
        The largest such change; 0 if all gains may be chance [fraction].

    Examples
    --------
    >>> omitted_delay_doubt({"position_m": (2e-4, 1.5, 0.3), "differential_pressure_pa": (7e-4, 9.0, -0.08)})
    0.08
    """
    return max((abs(change) for _, gain, change in late.values() if gain > BY_CHANCE), default=0.0)
