"""Play between piston and encoder: tests on a fit's residuals and on a velocity sensor."""

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.fits.greybox.play_courses import (
    SMOOTHING_TIME,
    SPRING_BACK_TIME,
    cell_width,
    crossings,
    smoothed,
    standings,
)
from estimation.fits.greybox.problem import Problem
from estimation.fits.hypotheses import LEAST_PLAY
from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURE, VELOCITY
from estimation.log_checks.order import percentiles
from estimation.notes import EstimateCode, RigCode
from plant.log.record import Record
from plant.notes import Note

NUDGE = 1e-6
"""Play for the finite difference of the residuals [m]."""

EDGE = 2
"""Samples around a movement in which the piston may have begun to move within the encoder's resolution [samples]."""

FEWEST = 100
"""Fewest samples with the encoder at rest that are compared with a velocity sensor; judged [samples]."""


class ShownPlay(NamedTuple):
    """Play as the residuals of a fit show it.

    Parameters
    ----------
    size : float
        For the likeliest course, to first order [m].
    gain : float
        In log-likelihood, Rao's score statistic over two; 0 if all courses show a negative play [dimensionless].
    yields : float
        Unseen motion of the piston per pressure, if a velocity sensor shows it [m/Pa].
    moved : Mapping[str, float]
        Change of each unknown's coordinate if the play is fitted, to first order [dimensionless].
    """

    size: float
    gain: float
    yields: float = 0.0
    moved: Mapping[str, float] = {}


NO_PLAY = ShownPlay(0.0, 0.0)


PLAY_STRUCTURE = 5e-3
"""Relative standard deviation of bulk modulus if the encoder has play, since the piston's motion across it is unknown;
judged [fraction]."""

PLAY_OPEN = 0.5
"""Share of a play's effect on bulk modulus that remains uncertain, as the piston follows none of the modelled courses
exactly [fraction]: 0.2 covered too few training logs with play. The effect is the difference between fits with and
without the play, or the unseen compliance over that of the oil."""

PLAY_SHOWN = 4.0
"""Gain in log-likelihood from which residuals show a play [dimensionless]: by chance each of three courses gains it in
one log of 430, so at most one log in 140 is tested in vain. Up to `PLAY_BELIEVED` the interval includes the effect of a
play that no fit includes."""

PLAY_BELIEVED = 7.0
"""Gain from which a play that no fit includes rejects the log [dimensionless]: by chance at most one log in 3600 gains
it. Prior odds: one encoder in twenty has a play of up to 100 um, known to some 2 um by such a log. That makes 3.0 for
the one in twenty, 3.0 for the sizes, and 0.7 for courses that are much alike."""


PLAY_SENSED = 2.7
"""Gain from which a play is tested because a velocity sensor moves while the encoder is at rest, and from which the
interval includes a play that no fit includes [dimensionless]. One log in 100 gains it by chance, and fewer seem to move
by more than the encoder's resolution, which is required too. From `PLAY_SHOWN` on, which one log in 400 gains by
chance, the log is rejected."""


def crossed_drives(problem: Problem) -> list[Array]:
    """Return the drives of a log under a small play, for each course by which the piston may cross it.

    Parameters
    ----------
    problem : Problem
        The problem, position among its drives.

    Returns
    -------
    list of ndarray, shape (n, channels)
        The drives under which `shown_play` needs the residuals [SI].
    """
    log, place = problem.log, problem.model.drives.index(POSITION)
    courses = crossings(log.drives[:, place], log.measured[:, 0], log.sample_time)
    sides = (courses[:, 0], courses[:, 0] + courses[:, 1], courses[:, 0] + courses[:, 2])
    beside = np.arange(log.drives.shape[1]) == place
    return [log.drives + 0.5 * NUDGE * np.where(beside, side[:, None], 0.0) for side in sides]


def shown_play(
    changes: Iterable[Array],
    errors: Array,
    left: Callable[[Array], Array],
    taken: Callable[[Array], Iterable[tuple[str, float]]] = lambda _: (),
) -> ShownPlay:
    """Return the play that a fit's residuals show.

    A play is positive, so only courses count that show a positive one. In a log without play, a gain over 4.5 comes by
    chance in one of 740 for each of three similar courses.

    Parameters
    ----------
    changes : iterable of ndarray, shape (outputs, blocks)
        Change of the normalised residuals under the drives of `crossed_drives` [dimensionless].
    errors : ndarray, shape (blocks,)
        The normalised residuals there [dimensionless].
    left : callable
        The part of a change of the residuals that the unknowns do not absorb.
    taken : callable
        Each unknown by name, and the change of its coordinate that absorbs the rest.

    Returns
    -------
    ShownPlay
        The likeliest course.
    """
    found, course = NO_PLAY, None
    for change in changes:
        free = left(change.ravel() / NUDGE)
        power, along = float(free @ free), -float(free @ errors)
        if power > 0.0 and along > 0.0 and (gain := 0.5 * along**2 / power) > found.gain:
            found, course = ShownPlay(along / power, gain), change
    if course is None or found.gain <= PLAY_SHOWN:
        return found
    size = found.size / NUDGE
    return found._replace(moved={name: -size * float(one) for name, one in taken(course.ravel())})


def shows_play(shown: ShownPlay, sensed: ShownPlay) -> bool:
    """Return whether residuals or a velocity sensor show a play that is worth a test."""
    return sensed.gain > PLAY_SENSED or (shown.gain > PLAY_SHOWN and shown.size > LEAST_PLAY)


def omitted_play_note(shown: ShownPlay, sensed: ShownPlay = NO_PLAY, least: float = 0.0) -> tuple[Note, ...]:
    """Return the objection to a fit that omits a play which its residuals or a velocity sensor show.

    Parameters
    ----------
    shown, sensed : ShownPlay
        Play from either.
    least : float
        Least gain that residuals must show: those of a poor fit show anything [dimensionless].
    """
    limits = (shown, max(PLAY_BELIEVED, least)), (sensed, PLAY_SHOWN)
    large = [one.size for one, limit in limits if one.gain > limit and one.size > LEAST_PLAY]
    return (EstimateCode.PLAY_LEFT.note(play_um=1e6 * max(large)),) if large else ()


def play_structure(moved: float, yields: float) -> float:
    """Return the relative deviation of bulk modulus due to the unknown crossing of a play.

    Parameters
    ----------
    moved : float
        Relative difference of bulk modulus from a fit without the play [fraction].
    yields : float
        Unseen motion of the piston over the compliance of the oil [fraction].

    Returns
    -------
    float
        Standard deviation [fraction].
    """
    return float(np.hypot(PLAY_STRUCTURE, PLAY_OPEN * max(moved, yields)))


def omitted_play_uncertainty(shown: ShownPlay, sensed: ShownPlay, yields: float) -> tuple[float, tuple[Note, ...]]:
    """Return the uncertainty due to a play that residuals or a velocity sensor may show and no fit includes.

    Parameters
    ----------
    shown : ShownPlay
        What the residuals show.
    sensed : ShownPlay
        What the sensor shows.
    yields : float
        Unseen motion of the piston over the compliance of the oil [fraction].

    Returns
    -------
    tuple of (float, tuple of Note)
        Relative deviation of bulk modulus, zero if one log in 100 shows as much by chance [fraction]; and a note, if
        the gate does not reject the log for it.
    """
    if not shows_play(shown, sensed):
        return 0.0, ()
    moved = shown.moved.get("bulk_modulus", 0.0) if shown.gain > PLAY_SHOWN else 0.0
    size = max(one.size for one, least in ((shown, PLAY_SHOWN), (sensed, PLAY_SENSED)) if one.gain > least)
    said = () if omitted_play_note(shown, sensed) else (RigCode.PLAY_NOT_EXCLUDED.note(play_um=1e6 * size),)
    return float(np.hypot(PLAY_STRUCTURE, max(yields, abs(moved)))), said


def sensed_play(record: Record) -> ShownPlay:
    """Return the play that a velocity sensor shows: the piston yields to pressure while its encoder is at rest.

    While the encoder is at rest, the seals hold the piston, which moves with pressure. Without play the encoder moves
    as far as velocity says; within the play it does not move. A velocity derived from the encoder shows nothing.

    Returns
    -------
    ShownPlay
        Unseen motion of the piston and its gain in log-likelihood, for unknown noise. Zero if the encoder may see half
        of the motion, or if the piston mostly moves by less than the resolution.
    """
    if VELOCITY not in record:
        return NO_PLAY
    position = bridged(record[POSITION])
    stands = standings(position)
    force = smoothed(bridged(record[PRESSURE]), round(SMOOTHING_TIME / record.sample_time))
    # the encoder's rate spans two sample times, so velocity is averaged over them too
    velocity, rate = (
        np.convolve(record[VELOCITY], (0.25, 0.5, 0.25), mode="same"),
        np.gradient(force) / record.sample_time,
    )
    still = np.isfinite(velocity) & (stands.length * record.sample_time >= SPRING_BACK_TIME) & (stands.away > EDGE)
    power = float(np.sum(rate[still] ** 2))
    if np.count_nonzero(still) < FEWEST or power == 0.0:
        return NO_PLAY
    read = np.gradient(position) / record.sample_time
    moved, seen = (float(rate[still] @ one[still]) / power for one in (velocity, read))
    left, together = velocity - read - (moved - seen) * rate, max(1, round(SMOOTHING_TIME / record.sample_time))
    chance = _averaged_variance(left, still, together)
    if chance == 0.0 or moved - 2.0 * seen <= (chance / power) ** 0.5:
        return NO_PLAY
    here, standing = force[still], stands.first[still]
    at_once = here - (np.bincount(standing, here) / np.maximum(np.bincount(standing), 1))[standing]
    if (moved - seen) * _spread(at_once) <= max(cell_width(position), LEAST_PLAY):
        return NO_PLAY
    looks = np.count_nonzero(still) / together
    gain = 0.5 * looks * np.log1p((moved - seen) ** 2 * power / chance / looks)
    return ShownPlay((moved - seen) * _spread(here), float(gain), moved - seen)


def _averaged_variance(left: Array, there: BoolArray, samples: int) -> float:
    """Return the effective variance of residuals over so many samples: averaged noise is not white."""
    parts = len(left) // samples
    left, count = (
        one[: parts * samples].reshape(parts, samples).sum(axis=1) for one in (np.where(there, left, 0.0), there)
    )
    return float(np.sum(left**2) / max(1, np.sum(count)))


def _spread(values: Array) -> float:
    high, low = percentiles(values, (95.0, 5.0))
    return high - low
