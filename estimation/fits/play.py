"""Play between the piston and its encoder: where the piston may be in it, and whether a fit's residuals show one.

The encoder says at which end of its play it is while it moves. While it stands the piston may be anywhere in between:
it turns and crosses, or springs back on its seals and comes again. So where it is has a few courses, of which a log
chooses (`crossings`).
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.fits.greybox_problem import Problem
from estimation.fits.hypotheses import LEAST_PLAY
from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURE, VELOCITY
from estimation.log_checks.measurement_noise import position_variance
from estimation.log_checks.order import percentile
from estimation.notes import EstimateCode, RigCode
from plant.log.record import Record
from plant.notes import Note

CELLS = 8.0
"""Width of the cells in which a reading is followed, in standard deviations of its noise [dimensionless]."""

FINEST = 1e-9
"""Their least width [m]."""

SMOOTHED = 2e-2
"""Length over which pressure is averaged, by a Hann window [s]: its noise then moves no piston, and the quickest of
crossings takes as long; judged."""

STANDS = 0.02
"""Time for which an encoder stands before the piston is taken to spring back [s]; judged: one may creep in steps."""

NUDGE = 1e-6
"""Play by which the residuals' answer to one is read off [m]."""

EDGE = 2
"""How near to a movement the piston may have begun to move, within what the encoder resolves [samples]."""

FEWEST = 100
"""Fewest samples in which an encoder stands that are compared with a velocity sensor's; judged [samples]."""


class ShownPlay(NamedTuple):
    """What a fit's residuals say of a play.

    Parameters
    ----------
    size : float
        By the likeliest course, to first order [m].
    gain : float
        In log-likelihood, Rao's score statistic over two; 0 where all courses ask for less than none [dimensionless].
    yields : float
        How far the piston moves unseen, where that was sensed [m/Pa].
    """

    size: float
    gain: float
    yields: float = 0.0


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
courses gains it in one log of 430, so one log in 140 at most is asked in vain."""


PLAY_SENSED = 2.7
"""Gain from which a log is asked for a play because a velocity sensor moves beside an encoder that stands, and from
which its interval holds one that no fit took up: one log in 100 gains it by chance, and fewer seem to move by more than
the encoder resolves, which is asked too. The check is shut from `PLAY_SHOWN` on, which one log in 400 gains by chance
[dimensionless]."""


def crossings(position: Array, pressure: Array, sample_time: float) -> Array:
    """Return courses of the piston in its encoder's play.

    Between the last movement one way and the first one back the piston turns, and crosses the play with the square of
    time, as under a constant force. Two steps the same way, from cell to cell, are a movement; one is noise.

    Parameters
    ----------
    position : ndarray, shape (n,)
        The reading, without gaps [m].
    pressure : ndarray, shape (n,)
        Differential pressure [Pa]; NaN is missing.
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    ndarray, shape (n, 4)
        In the order of `estimation.models.wide_flow.COURSES`: at which end of its play the encoder is, 1 after it moved
        up, -1 after it moved down, 0 before anything is known, and from the one to the other while it stands and the
        piston crosses at last; then what is to be added to that where the piston follows pressure in place of time, as
        one that is held by the stretch of its seals does; where it crosses at first, and not at last; and where it
        springs back and comes again, by the share of the pressure that is lost meanwhile [dimensionless].

    Examples
    --------
    >>> out_and_back = 30.0 - np.abs(30.0 - np.arange(61.0))
    >>> late = crossings(out_and_back, np.zeros(61), 1e-3)[:, 0]
    >>> late[[0, 20, 30, 34, 60]].round(1).tolist()
    [0.0, 1.0, 0.9, -1.0, -1.0]
    """
    stands = _standings(position)
    late, early = (_crossed(stands, crossed) for crossed in (lambda share: share**2, lambda share: share * (2 - share)))
    force = _smoothed(bridged(pressure), round(SMOOTHED / sample_time))
    before, after = force[stands.first], force[stands.last]
    turned = np.divide(force - before, after - before, out=np.ones_like(force), where=after != before)
    followed = turned.clip(0.0, 1.0)
    by_pressure = stands.side + (stands.next_side - stands.side) * followed
    held = before + (after - before) * stands.share
    most = np.abs(held)
    below = np.maximum(stands.side * (force - held), -2.0 * most).clip(max=0.0)
    lost = np.divide(below, most, out=below, where=below < 0.0)
    sprung = np.where(stands.turns | (stands.length * sample_time < STANDS), 0.0, stands.side * lost)
    return np.column_stack([late, by_pressure - late, early - late, sprung])


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


def shown_play(changes: Iterable[Array], errors: Array, left: Callable[[Array], Array]) -> ShownPlay:
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

    Returns
    -------
    ShownPlay
        The likeliest course.
    """
    found = NO_PLAY
    for change in changes:
        free = left(change.ravel() / NUDGE)
        power, along = float(free @ free), -float(free @ errors)
        if power > 0.0 and along > 0.0 and (gain := 0.5 * along**2 / power) > found.gain:
            found = ShownPlay(along / power, gain)
    return found


def play_left(*shown: ShownPlay) -> tuple[Note, ...]:
    """Return the objection to a fit that leaves a play which its residuals or a velocity sensor show.

    Parameters
    ----------
    *shown : ShownPlay
        What each of them shows.
    """
    large = [one.size for one in shown if one.gain > PLAY_SHOWN and one.size > LEAST_PLAY]
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


def play_untaken(sensed: ShownPlay, yields: float) -> tuple[float, tuple[Note, ...]]:
    """Return what a play leaves open that a velocity sensor may show and no fit took up: all that the piston yields.

    Parameters
    ----------
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
    if sensed.gain <= PLAY_SENSED:
        return 0.0, ()
    said = () if play_left(sensed) else (RigCode.PLAY_NOT_EXCLUDED.note(play_um=1e6 * sensed.size),)
    return float(np.hypot(PLAY_STRUCTURE, yields)), said


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
    stands = _standings(position)
    force = _smoothed(bridged(record[PRESSURE]), round(SMOOTHED / record.sample_time))
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
    if (moved - seen) * _spread(at_once) <= max(_cell(position), LEAST_PLAY):
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
    return percentile(values, 95.0) - percentile(values, 5.0)


class _Standings(NamedTuple):
    """For each sample: the movements before and after, at which sides they left the play, and how far it is there."""

    first: IntArray
    last: IntArray
    side: Array
    next_side: Array

    @property
    def turns(self) -> BoolArray:
        return self.side != self.next_side

    @property
    def length(self) -> IntArray:
        return self.last - self.first

    @property
    def away(self) -> IntArray:
        samples = np.arange(len(self.first))
        return np.minimum(samples - self.first, self.last - samples)

    @property
    def share(self) -> Array:
        samples = np.arange(len(self.first))
        return (samples - self.first) / np.maximum(self.length, 1)


def _standings(position: Array) -> _Standings:
    at = np.round(position / _cell(position))
    steps = np.flatnonzero(np.diff(at)) + 1
    ways = np.sign(at[steps] - at[steps - 1])
    sure = np.flatnonzero(ways[1:] == ways[:-1]) + 1
    # what is after the last movement ends with the log, at the side where it began
    places = np.concatenate([[0], steps[sure], [len(position) - 1]])
    sides = np.concatenate([[0.0], ways[sure], ways[sure][-1:] if len(sure) else [0.0]])
    before = np.searchsorted(places[:-1], np.arange(len(position)), side="right") - 1
    return _Standings(places[before], places[before + 1], sides[before], sides[before + 1])


def _cell(position: Array) -> float:
    return max(CELLS * position_variance(position) ** 0.5, FINEST)


def _crossed(stands: _Standings, course: Callable[[Array], Array]) -> Array:
    return stands.side + (stands.next_side - stands.side) * course(stands.share)


def _smoothed(values: Array, samples: int) -> Array:
    """Return means under a Hann window of so many samples."""
    if samples < 2:
        return values
    window = np.hanning(samples + 2 + samples % 2 - 1)[1:-1]
    reach = len(window) // 2
    padded = np.pad(values, (reach, len(window) - 1 - reach), mode="edge")
    return np.convolve(padded, window / np.sum(window), mode="valid")
