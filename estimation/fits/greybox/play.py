"""Play between piston and encoder: tests on a fit's residuals and on a velocity sensor."""

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.fits.greybox.play_courses import SMOOTHED, STANDS, cell, crossings, smoothed, standings
from estimation.fits.greybox.problem import Problem
from estimation.fits.hypotheses import LEAST_PLAY
from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURE, VELOCITY
from estimation.log_checks.order import percentiles
from estimation.notes import EstimateCode, RigCode
from plant.log.record import Record
from plant.notes import Note

NUDGE = 1e-6
"""Play by which the residuals' answer to one is read off [m]."""

EDGE = 2
"""How near to a movement the piston may have begun to move, within what the encoder resolves [samples]."""

FEWEST = 100
"""Fewest samples in which an encoder stands that are compared with a velocity sensor's; judged [samples]."""


class ShownPlay(NamedTuple):
    """Play as the residuals of a fit show it.

    Parameters
    ----------
    size : float
        By the likeliest course, to first order [m].
    gain : float
        In log-likelihood, Rao's score statistic over two; 0 where all courses ask for less than none [dimensionless].
    yields : float
        How far the piston moves unseen, where that was sensed [m/Pa].
    moved : Mapping[str, float]
        By how much each unknown's coordinate moves if it is taken up, to first order [dimensionless].
    """

    size: float
    gain: float
    yields: float = 0.0
    moved: Mapping[str, float] = {}


NO_PLAY = ShownPlay(0.0, 0.0)


PLAY_STRUCTURE = 5e-3
"""Relative standard deviation of bulk modulus where the encoder has a play, as what the piston does while it crosses
that is not known; judged [fraction]."""

PLAY_OPEN = 0.5
"""Share of what a play puts bulk modulus off by that is left open, as the piston crosses by none of the courses that
are tried [fraction]: 0.2 covered too few training logs with a play. It puts it off by as much as the fit with a play
differs from that without, or by what the piston yields unseen beside what the oil does."""

PLAY_SHOWN = 4.0
"""Gain in log-likelihood from which residuals show a play of the encoder [dimensionless]: by chance each of three
courses gains it in one log of 430, so one log in 140 at most is asked in vain. Up to `PLAY_BELIEVED` the interval holds
what that play would do, if no fit took it up."""

PLAY_BELIEVED = 7.0
"""Gain from which a play that residuals show, and no fit took up, shuts the check [dimensionless]: by chance one log in
3600 at most gains it. It is what one in twenty encoders with a play of up to 100 um, known to some 2 um by such a log,
makes as likely as none: 3.0 for the one in twenty, 3.0 for the sizes, and 0.7 for courses that are much alike."""


PLAY_SENSED = 2.7
"""Gain from which a log is asked for a play because a velocity sensor moves beside an encoder that stands, and from
which its interval holds one that no fit took up: one log in 100 gains it by chance, and fewer seem to move by more than
the encoder resolves, which is asked too. The check is shut from `PLAY_SHOWN` on, which one log in 400 gains by chance
[dimensionless]."""


def crossed_drives(problem: Problem) -> list[Array]:
    """Return the drives of a log under a small play, which the piston crosses by one course after another.

    Parameters
    ----------
    problem : Problem
        The problem, position among its drives.

    Returns
    -------
    list of ndarray, shape (n, channels)
        What `shown_play` asks the residuals under [SI].
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

    A play is positive, so a course counts that asks for one. On a log without, a gain over 4.5 comes by chance in one
    of 740 for each of three courses that are much alike.

    Parameters
    ----------
    changes : iterable of ndarray, shape (outputs, blocks)
        By how much the normalised residuals change under the drives of `crossed_drives` [dimensionless].
    errors : ndarray, shape (blocks,)
        The normalised residuals there [dimensionless].
    left : callable
        What the unknowns do not take up of a change of the residuals.
    taken : callable
        Each unknown by name, and by how much its coordinate rises to take up a change.

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


def play_shows(shown: ShownPlay, sensed: ShownPlay) -> bool:
    """Return whether residuals or a velocity sensor show a play that is worth a test."""
    return sensed.gain > PLAY_SENSED or (shown.gain > PLAY_SHOWN and shown.size > LEAST_PLAY)


def play_left(shown: ShownPlay, sensed: ShownPlay = NO_PLAY, least: float = 0.0) -> tuple[Note, ...]:
    """Return the objection to a fit that leaves a play which its residuals or a velocity sensor show.

    Parameters
    ----------
    shown, sensed : ShownPlay
        What either shows.
    least : float
        What residuals must gain by it in any case: those of a fit that leaves much show anything [dimensionless].
    """
    limits = (shown, max(PLAY_BELIEVED, least)), (sensed, PLAY_SHOWN)
    large = [one.size for one, limit in limits if one.gain > limit and one.size > LEAST_PLAY]
    return (EstimateCode.PLAY_LEFT.note(play_um=1e6 * max(large)),) if large else ()


def play_structure(moved: float, yields: float) -> float:
    """Return the relative deviation of bulk modulus that the crossing of a play leaves open.

    Parameters
    ----------
    moved : float
        Relative difference of bulk modulus from a fit without the play [fraction].
    yields : float
        What the piston yields unseen, over what the oil does [fraction].

    Returns
    -------
    float
        Standard deviation [fraction].
    """
    return float(np.hypot(PLAY_STRUCTURE, PLAY_OPEN * max(moved, yields)))


def play_untaken(shown: ShownPlay, sensed: ShownPlay, yields: float) -> tuple[float, tuple[Note, ...]]:
    """Return the doubt due to a play that residuals or a velocity sensor may show and no fit took up.

    Parameters
    ----------
    shown : ShownPlay
        What the residuals show.
    sensed : ShownPlay
        What the sensor shows.
    yields : float
        What the piston yields unseen, over what the oil does [fraction].

    Returns
    -------
    tuple of (float, tuple of Note)
        Relative deviation of bulk modulus, zero for what is as seldom by chance as in one log of 100 [fraction]; and a
        remark, if the gate is not shut for it.
    """
    if not play_shows(shown, sensed):
        return 0.0, ()
    moved = shown.moved.get("bulk_modulus", 0.0) if shown.gain > PLAY_SHOWN else 0.0
    size = max(one.size for one, least in ((shown, PLAY_SHOWN), (sensed, PLAY_SENSED)) if one.gain > least)
    said = () if play_left(shown, sensed) else (RigCode.PLAY_NOT_EXCLUDED.note(play_um=1e6 * size),)
    return float(np.hypot(PLAY_STRUCTURE, max(yields, abs(moved)))), said


def sensed_play(record: Record) -> ShownPlay:
    """Return the play that a velocity sensor shows: the piston yields to pressure while its encoder stands.

    While the encoder stands its seals hold the piston, which moves with pressure. Without a play the encoder moves as
    far as velocity says; in the play it does not move. A velocity that is made of the encoder's reading shows nothing.

    Parameters
    ----------
    record : Record
        The log.

    Returns
    -------
    ShownPlay
        How far the piston moves unseen, and what that gains in log-likelihood, the size of noise unknown; none where
        the encoder may see half of it, or the piston moves by less in most of its standings than it resolves.
    """
    if VELOCITY not in record:
        return NO_PLAY
    position = bridged(record[POSITION])
    stands = standings(position)
    force = smoothed(bridged(record[PRESSURE]), round(SMOOTHED / record.sample_time))
    # the encoder's rate is over two sample times, so velocity is averaged over them too
    velocity, rate = (
        np.convolve(record[VELOCITY], (0.25, 0.5, 0.25), mode="same"),
        np.gradient(force) / record.sample_time,
    )
    still = np.isfinite(velocity) & (stands.length * record.sample_time >= STANDS) & (stands.away > EDGE)
    power = float(np.sum(rate[still] ** 2))
    if np.count_nonzero(still) < FEWEST or power == 0.0:
        return NO_PLAY
    read = np.gradient(position) / record.sample_time
    moved, seen = (float(rate[still] @ one[still]) / power for one in (velocity, read))
    left, together = velocity - read - (moved - seen) * rate, max(1, round(SMOOTHED / record.sample_time))
    chance = _lasting(left, still, together)
    if chance == 0.0 or moved - 2.0 * seen <= (chance / power) ** 0.5:
        return NO_PLAY
    here, standing = force[still], stands.first[still]
    at_once = here - (np.bincount(standing, here) / np.maximum(np.bincount(standing), 1))[standing]
    if (moved - seen) * _spread(at_once) <= max(cell(position), LEAST_PLAY):
        return NO_PLAY
    looks = np.count_nonzero(still) / together
    gain = 0.5 * looks * np.log1p((moved - seen) ** 2 * power / chance / looks)
    return ShownPlay((moved - seen) * _spread(here), float(gain), moved - seen)


def _lasting(left: Array, there: BoolArray, samples: int) -> float:
    """Return the variance of what is left as it counts over so many samples: what was averaged is not white."""
    parts = len(left) // samples
    left, count = (
        one[: parts * samples].reshape(parts, samples).sum(axis=1) for one in (np.where(there, left, 0.0), there)
    )
    return float(np.sum(left**2) / max(1, np.sum(count)))


def _spread(values: Array) -> float:
    high, low = percentiles(values, (95.0, 5.0))
    return high - low
