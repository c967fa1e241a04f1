"""Flow ripple of the pump by its gear teeth: test on a fit's residuals, and a log whose speed includes it.

Each tooth that passes makes the delivery pulsate with the angle of the shaft, the integral of the logged speed. At low
speed a tooth lasts as long as a stroke's pressure pulse, and looks like soft oil.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from estimation.arrays import Array
from estimation.fits.greybox.gains_beside import gains_beside
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from plant.solvers.steps import parameter_names

TOOTH_COUNTS = tuple(range(5, 20))
"""Teeth per revolution that are searched for [count]: gear pumps have 7 to 16; an odd number of pistons pulses twice
each."""

NUDGE = 1e-2
"""Amplitude of ripple for the finite difference of the residuals, over the flow [fraction]."""

MOST_BETWEEN = 1.0
"""Half the phase of the ripple per sample up to which it is followed [rad]: three samples per tooth."""

LIKELIEST = 3
"""Tooth counts for which the model is run [count]: with two waves each and the log itself they run side by side."""

LEAST_TEETH = 0.03
"""Amplitude from which ripple is fitted, over the flow [fraction]; judged. Smaller ripple: see `small_pump_ripple`."""

MOST_OFFSET = 1.0
"""Largest offset of logged speed that is searched for [rad/s]: 10 revolutions per minute; judged."""

PARTS_A_TURN = 16
"""Parts of a full phase turn, by the fastest offset, over which residuals are summed [count]."""

FINENESS = 4
"""Offsets that are tried per resolvable one [count]."""

OFFSET_NUDGE = 1e-4
"""Offset for the finite difference [rad/s]."""


@dataclass(frozen=True)
class Ripple:
    """Flow ripple of a pump at its tooth frequency.

    Parameters
    ----------
    count : int
        Teeth per revolution [count].
    cosine, sine : float
        Amplitudes by the shaft's angle since the first sample, over the flow [fraction].
    """

    count: int
    cosine: float
    sine: float

    @property
    def amplitude(self) -> float:
        """Amplitude, as a share of the flow [fraction]."""
        return float(np.hypot(self.cosine, self.sine))


class Turning(NamedTuple):
    """Pump ripple and offset of the logged speed.

    Parameters
    ----------
    teeth : tuple of Ripple
        Ripple of its flow.
    offset : float
        Logged speed minus the shaft's [rad/s].
    """

    teeth: tuple[Ripple, ...] = ()
    offset: float = 0.0


NO_RIPPLE = Turning()
"""No ripple and no offset."""


class ShownRipple(NamedTuple):
    """Flow ripple of one tooth count as the residuals of a fit show it.

    Parameters
    ----------
    teeth : Ripple
        Ripple beside what the drives already include, to first order.
    gain : float
        In log-likelihood, Rao's score statistic over two, less the cost of the search for an offset [dimensionless].
    std : float
        Standard deviation of the amplitude [fraction].
    opened : ndarray, shape (unknowns,)
        Variance added to the unknowns' coordinates if this ripple is unknown too [dimensionless].
    offset : float
        Logged speed minus the shaft's with this ripple [rad/s].
    offset_std : float
        Standard deviation of that, if the drives include an offset and this ripple [rad/s].
    power : ndarray, shape (2, 2)
        Inverse of the covariance of cosine and sine [dimensionless].
    answers : ndarray, shape (unknowns, 2)
        Decrease of the unknowns per cosine and sine [dimensionless].
    beside : float
        Gain beside the likeliest count, less that cost [dimensionless].
    """

    teeth: Ripple
    gain: float
    std: float
    opened: Array
    offset: float = 0.0
    offset_std: float = 0.0
    power: Array = np.eye(2)
    answers: Array = np.zeros((1, 2))
    beside: float = 0.0


def with_ripple(log: GreyBoxLog, teeth: Sequence[Ripple], offset: float = 0.0) -> GreyBoxLog:
    """Return a log whose speed includes the pump's flow ripple.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.
    teeth : sequence of Ripple
        Ripple of the flow.
    offset : float
        Logged speed minus the shaft's [rad/s].

    Examples
    --------
    >>> log = GreyBoxLog(np.full((3, 1), 0.1), np.zeros((3, 1)), np.zeros(0), 0.01, np.ones(3, dtype=int), ())
    >>> with_ripple(log, [Ripple(12, 0.1, 0.0)]).drives[:, 0].round(3).tolist()
    [0.11, 0.11, 0.11]
    """
    drives = log.drives.copy()
    drives[:, 0] = delivering_speed(drives[:, 0], teeth, offset, log.sample_time)
    return replace(log, drives=drives, teeth=tuple(teeth), speed_offset=offset)


def delivering_speed(speed: Array, teeth: Sequence[Ripple], offset: float, sample_time: float) -> Array:
    """Return the speed at which a pump without ripple delivers the flow of one with ripple.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Logged speed [rad/s].
    teeth : sequence of Ripple
        Ripple of the flow.
    offset : float
        Logged speed minus the shaft's [rad/s].
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    ndarray, shape (n,)
        [rad/s]
    """
    shaft = speed - offset
    turned = _shaft_angle(shaft, sample_time)
    return sum((_ripple_speed(one, turned, sample_time) for one in teeth), shaft)


class ShownOffset(NamedTuple):
    """Offset of the logged speed as the residuals of a fit show it.

    Parameters
    ----------
    value : float
        Logged speed minus the shaft's, to first order [rad/s].
    gain : float
        In log-likelihood [dimensionless].
    std : float
        Standard deviation of the value [rad/s].
    opened : ndarray, shape (unknowns,)
        Variance added to the unknowns' coordinates if this offset is unknown too [dimensionless].
    """

    value: float
    gain: float
    std: float
    opened: Array


NO_OFFSET = ShownOffset(0.0, 0.0, np.inf, np.zeros(1))
"""Result of a fit that does not test for an offset, or on which it has no effect."""


def shown_ripple(
    problem: Problem, theta: Array, errors: Array, bread: Array, slopes: Array, counts: Sequence[int]
) -> tuple[Mapping[int, ShownRipple], ShownOffset]:
    """Return the flow ripple that a fit's residuals show, and an offset of speed.

    In a log without ripple, a given count gains 10 by chance in one log of 22,000, and one of `TOOTH_COUNTS` in one of
    1500.

    Parameters
    ----------
    problem : Problem
        The problem, motor speed its first drive.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    errors : ndarray, shape (blocks,)
        The normalised residuals there [dimensionless].
    bread : ndarray, shape (felt, felt)
        Inverse of the normal equations of the unknowns that are felt [dimensionless].
    slopes : ndarray, shape (blocks, felt)
        Derivatives of the residuals by them [dimensionless].
    counts : sequence of int
        Teeth per revolution that are searched for [count]; the model is run for the `LIKELIEST` only.

    Returns
    -------
    tuple of Mapping[int, ShownRipple] and ShownOffset
        By tooth count, `opened` for the unknowns that have an effect; a count without effect is left out.
    """
    log = problem.log
    sought = [_Candidate(count) for count in counts]
    sought = _candidates(problem, theta, errors, counts) if len(counts) > LIKELIEST else sought
    ways = [_unit_changes(log, one) for one in sought]
    level = np.full(len(log.drives), -1.0)
    every = [*(each for several in ways for each in several), (level, NUDGE)]
    moved_drives = [np.column_stack([log.drives[:, 0] + size * way, log.drives[:, 1:]]) for way, size in every]
    known, *moved = problem.coarse.disturbed(theta, [log.drives, *moved_drives])
    sizes = [size for _, size in every]
    columns = (np.stack([one.ravel() for one in moved], axis=-1) - known.reshape(-1, 1)) / sizes
    answers = bread @ (slopes.T @ columns)
    free = columns - slopes @ answers
    along, shown, first = -(errors @ free), dict[int, ShownRipple](), 0
    beside = gains_beside(free, along, [len(several) for several in ways], [one.price for one in sought])
    for one, several, gained in zip(sought, ways, beside, strict=True):
        its = slice(first, first := first + len(several))
        power = free[:, its].T @ free[:, its]
        scale = np.sqrt(power.diagonal())
        if not np.all(scale > 0.0) or np.linalg.cond(power / np.outer(scale, scale)) > 1.0 / np.finfo(float).eps:
            continue
        spread = np.linalg.inv(power)
        cosine, sine, *offset = map(float, spread @ along[its])
        opened = np.einsum("ij,jk,ik->i", answers[:, its], spread, answers[:, its])
        shown[one.count] = ShownRipple(
            Ripple(one.count, cosine, sine),
            0.5 * float(along[its] @ spread @ along[its]) - one.price,
            float(np.linalg.norm(spread[:2, :2], 2)) ** 0.5,
            opened,
            offset[0] if offset else one.offset,
            float(spread[2, 2]) ** 0.5 if offset else 0.0,
            np.asarray(np.linalg.inv(spread[:2, :2]), dtype=float),
            answers[:, its][:, :2],
            gained,
        )
    power, pulled = float(free[:, -1] @ free[:, -1]), float(along[-1])
    if power == 0.0:
        return shown, NO_OFFSET
    return shown, ShownOffset(pulled / power, 0.5 * pulled**2 / power, power**-0.5, answers[:, -1] ** 2 / power)


@dataclass(frozen=True)
class _Candidate:
    """A tooth count, the offset of speed with which it is searched, and its cost in log-likelihood."""

    count: int
    offset: float = 0.0
    price: float = 0.0


def _unit_changes(log: GreyBoxLog, one: _Candidate) -> list[tuple[Array, float]]:
    """Return unit changes of speed and how many units are tried: two waves, and an offset.

    If the drives include an offset, it is varied together with the ripple that determines it.
    """
    speed, step = log.drives[:, 0], log.sample_time
    turned = _shaft_angle(speed - one.offset, step)
    ways = [(wave, NUDGE) for wave in _waves(one.count, turned, step)]
    if log.speed_offset == 0.0 or all(each.count != one.count for each in log.teeth):
        return ways
    now, then = (delivering_speed(speed, log.teeth, off, step) for off in (0.0, OFFSET_NUDGE))
    return [*ways, ((then - now) / OFFSET_NUDGE, NUDGE)]


def _shaft_angle(speed: Array, step: float) -> tuple[Array, Array]:
    """Return the shaft's angle halfway between samples, before the first and after the last one too, and its steps."""
    at = np.concatenate([[0.0], np.cumsum(0.5 * step * (speed[1:] + speed[:-1]))])
    halfway = at[:-1] + step * (3.0 * speed[:-1] + speed[1:]) / 8.0
    between = np.concatenate([[-0.5 * step * speed[0]], halfway, [at[-1] + 0.5 * step * speed[-1]]])
    return between, np.pad(np.abs(np.diff(at)), 1, mode="edge")


def _ripple_speed(teeth: Ripple, turned: tuple[Array, Array], sample_time: float) -> Array:
    """Return the speed that delivers the flow of the ripple [rad/s].

    Straight lines between samples then deliver the right volume at constant speed. If there are too few samples per
    tooth, only the mean is delivered, which is zero.
    """
    cosine, sine = _waves(teeth.count, turned, sample_time)
    return teeth.cosine * cosine + teeth.sine * sine


def _waves(count: int, turned: tuple[Array, Array], sample_time: float) -> tuple[Array, Array]:
    """Return the speed by unit ripple in cosine and sine of the shaft's angle [rad/s]."""
    between, steps = turned
    phase, half = count * between, 0.5 * count * steps
    seen = half < MOST_BETWEEN
    share = np.where(seen, 1.0 / np.cos(np.where(seen, half, 0.0)), 0.0) / count
    return np.diff(np.sin(phase) * share) / sample_time, np.diff(-np.cos(phase) * share) / sample_time


def _candidates(problem: Problem, theta: Array, errors: Array, counts: Sequence[int]) -> Sequence[_Candidate]:
    """Return the tooth counts that correlate most with residuals, by a linear response at constant speed.

    Pressure then leaks off at one rate, so its phase lag behind the ripple is smaller the faster teeth pass. An offset
    of speed changes the phase linearly, so residuals times waves have a peak at its frequency.
    """
    log, rig = problem.log, problem.model.parameters
    value = {
        **dict(zip(parameter_names(rig), log.parameters.tolist(), strict=True)),
        **problem.model.values(theta),
    }
    rate = value["leakage_coefficient"] * value["bulk_modulus"] / value["chamber_volume"]
    blocks = np.linspace(0, len(log.drives) - 1, len(errors)).astype(np.intp)
    speed, angle = log.drives[:, 0], _shaft_angle(log.drives[:, 0], log.sample_time)[0][1:]
    delivers = np.abs(speed) * value["pump_displacement"] > value["flow_bias"]
    speed, weighed, turn = speed[blocks], errors * delivers[blocks], np.exp(1j * angle[blocks])
    length, wave, found = log.sample_time * len(log.drives), np.ones_like(turn), list[tuple[float, _Candidate]]()
    for count, more in zip(counts, np.diff(counts, prepend=0).tolist(), strict=True):
        wave, passing = wave * (turn if more == 1 else turn**more), count * speed
        seen = np.abs(passing) * log.sample_time < 2.0 * MOST_BETWEEN
        answer = passing * seen / (rate**2 + passing**2)  # real factor, for speed; times rate - 1j * passing below
        power = float(np.sum(answer * passing * delivers[blocks]))
        turns = MOST_OFFSET * count * length / (2.0 * np.pi)  # turns of the phase at the largest offset
        looks = min(len(errors), int(np.ceil(PARTS_A_TURN * turns)))
        starts = np.arange(looks) * len(errors) // looks
        along = np.add.reduceat(wave * (weighed * answer * (rate - 1j * passing)), starts)
        peaks = np.abs(np.fft.fft(along, FINENESS * looks)) ** 2 / power if power > 0.0 else np.zeros(FINENESS * looks)
        turned = np.fft.fftfreq(FINENESS * looks, 1.0 / looks)
        near = np.where(np.abs(turned) <= turns, peaks, 0.0)
        at, price = int(np.argmax(near)), float(np.log(max(2.0 * turns, 1.0)))
        if near[at] - price > near[0]:
            offset = 2.0 * np.pi * float(turned[at]) / (count * length)
            found.append((float(near[at]) - price, _Candidate(count, offset, price)))
        else:
            found.append((float(near[0]), _Candidate(count)))
    return [one for _, one in sorted(found, key=lambda pair: -pair[0])[:LIKELIEST]]
