"""Which column of an unknown log is which channel: guessed by name, by unit, and by what only that channel does.

Time increases. The slope of position is velocity, which follows the pump. Differential pressure is one port's pressure
less the other's, and has the sign of the motion, since friction has. A unit that the file does not state is guessed
from the usual size.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation.arrays import Array
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from estimation.log_checks.notes import GuessCode
from plant.eha.model import EhaParameters
from plant.log.clock.stamps import seconds_from_first
from plant.log.clock.time_unit import usual_units
from plant.log.columns import CHANNELS, TIME, UNITS
from plant.log.guess import Guess, best_guesses, points_by_name
from plant.log.headings import Heading
from plant.log.inspection import clock_facts
from plant.log.plausibility import LIMITS
from plant.log.scale import conversion_of
from plant.notes import Note

PORTS, VOLTAGE = ("pressure_a_pa", "pressure_b_pa"), "motor_voltage_v"

BLOCKS = 300
"""Blocks that a log is averaged over [count]."""

SURE, FOLLOWS, WEAKLY, ALIKE = 0.95, 0.7, 0.3, 0.999
"""Correlations: of a slope with the channel it belongs to, of what follows it, of a pressure with the motion, and of
two columns that are the same."""

CLOCK, STILL, SLOPE, RUNNER_UP, DIFFERENCE, TREND = 4.0, -3.0, 4.0, 2.5, 5.0, 1.5
"""Evidence of: a clock, a constant column, a slope, a worse slope, a difference of two columns, and a pressure that
follows the motion [log-odds]; judged."""

CANDIDATES: Mapping[str, Sequence[str]] = {
    TIME: ("s", "ms", "us"),
    SPEED: ("rad/s", "rpm"),
    POSITION: ("m", "mm", "um"),
    VELOCITY: ("m/s", "mm/s"),
    **dict.fromkeys((PRESSURE, *PORTS), ("Pa", "bar", "kPa", "psi", "MPa")),
    VOLTAGE: ("V", "mV"),
}
"""Units that are tried if a file states none, the usual ones first."""

SPEEDS = ("m/s", "mm/s", "in/s", "cm/s", "ft/s", "m/min", "mm/min", "in/min", "um/s")
"""Units of a velocity that are tried against the slope of position."""

SLOPE_NEAR = 1.1
"""Factor by which the slope of position may miss a unit of velocity [dimensionless]; judged."""

MOST_PRESSURES = 100
"""Columns among which differences are searched, those most like a pressure first [count]; judged."""

LEAST_SHARE = 0.1
"""Least variation of each of two columns for a third to be their difference [fraction of the third's]; judged."""

UNIT_DOUBT = 0.7
"""Factor on the probability of a guess whose unit was guessed too [fraction]; judged."""


@dataclass(frozen=True)
class ChannelGuess:
    """Which column a channel may be, and why.

    Parameters
    ----------
    guess : Guess
        Column, unit and probability.
    why : tuple of Note
        The evidence.
    """

    guess: Guess
    why: tuple[Note, ...] = ()


def guess_channels(
    headings: Sequence[Heading],
    columns: Mapping[int, Any],
    p: EhaParameters,
    channels: Collection[str] = (TIME, *CHANNELS),
) -> tuple[ChannelGuess, ...]:
    """Return which column each channel may be, with its probability.

    Parameters
    ----------
    headings : sequence of Heading
        Headings of the columns.
    columns : Mapping[int, ndarray of shape (n,)]
        Values as logged of the columns with numbers or dates, by index.
    p : EhaParameters
        The actuator, for the travel of its piston per turn of its pump.
    channels : collection of str
        Channels to look for.

    Returns
    -------
    tuple of ChannelGuess
        Each channel and each column at most once.
    """
    points: dict[str, dict[int, float]] = {}
    for channel in channels:
        said = {place: points_by_name(headings[place], channel) for place in columns}
        points[channel] = {place: worth for place, worth in said.items() if worth is not None}
    _by_other_names(points)
    why: dict[tuple[str, int], list[Note]] = {}
    with np.errstate(over="ignore", invalid="ignore"):  # columns may hold anything
        _by_clock(points, columns, why)
        time = max(points.get(TIME, {}), key=lambda place: points[TIME][place], default=None)
        means = _means(_columns_of_one_length(columns, time))
        _by_motion(points, means, why)
        _by_pressure(points, means, why)
        found = [one for one in best_guesses(points, headings) if one.sure >= 0.05]
        return _with_units(found, headings, columns, why, p)


def _add_evidence(points: dict[str, dict[int, float]], channel: str, place: int, worth: float) -> bool:
    """Add evidence for a column, if its unit allows it."""
    if place not in points.get(channel, {}):
        return False
    points[channel][place] += worth
    return True


def _by_other_names(points: dict[str, dict[int, float]]) -> None:
    """Count a name that states one channel as evidence against the others: a pressure may move like a slope."""
    said: dict[int, float] = {}
    for worth in points.values():
        for place, one in worth.items():
            said[place] = max(said.get(place, 0.0), one)
    for worth in points.values():
        for place, one in worth.items():
            if one == 0.0:
                worth[place] = -said[place]


def _by_clock(points: dict[str, dict[int, float]], columns: Mapping[int, Any], why: dict[Any, list[Note]]) -> None:
    for place, values in columns.items():
        facts = clock_facts(values)
        steady = facts is not None and facts.backward == 0 and facts.jitter < 0.4 and facts.repeats < 0.9 * len(values)
        if not steady or facts is None:
            _add_evidence(points, TIME, place, 2.0 * STILL)
        elif _add_evidence(points, TIME, place, CLOCK):
            why.setdefault((TIME, place), []).append(GuessCode.INCREASES.note(step=facts.step))


def _columns_of_one_length(columns: Mapping[int, Any], time: int | None) -> dict[int, Any]:
    """Return the columns of numbers as long as the time, or as most are: only rows of the same time are compared."""
    lengths = Counter(map(len, columns.values()))
    wanted = max(lengths, key=lambda one: lengths[one], default=0) if time is None else len(columns[time])
    chosen = ((place, one) for place, one in columns.items() if place != time and one.dtype.kind != "M")
    return {place: one for place, one in chosen if len(one) == wanted}


def _means(columns: Mapping[int, Any]) -> dict[int, Array]:
    """Return columns averaged over blocks and scaled to one, without constant ones."""
    out: dict[int, Array] = {}
    for place, values in columns.items():
        there = np.isfinite(values)
        if there.sum() < 20 or len(values) < 20:
            continue
        whole = np.interp(np.arange(len(values)), np.flatnonzero(there), values[there])
        length = max(1, len(whole) // BLOCKS)
        blocks = whole[: len(whole) // length * length].reshape(-1, length)
        largest = float(np.abs(blocks).max())
        if not 0.0 < largest < 1e200:
            continue
        mean = (blocks / largest).mean(axis=1)
        if float(np.ptp(mean)) > 1e-9:
            out[place] = mean
    return out


def _correlation(one: Array, other: Array) -> float:
    """Return the correlation of two columns."""
    x, y = one - one.mean(), other - other.mean()
    size = float(np.linalg.norm(x) * np.linalg.norm(y))
    return float(x @ y) / size if size > 0.0 else 0.0


def _by_motion(points: dict[str, dict[int, float]], means: Mapping[int, Array], why: dict[Any, list[Note]]) -> None:
    """Find the column whose slope others are: position, with velocity as its slope, which the pump's speed follows."""
    followers: dict[int, list[tuple[float, int]]] = {}
    places = np.array(list(means), dtype=np.int64)
    halves = [0.5 * (one[1:] + one[:-1]) for one in means.values()]
    middles = _unit_rows(np.array(halves)) if means else np.empty((0, 0))
    for place in points.get(POSITION, {}).keys() & means.keys():
        like = middles @ _unit_rows(np.diff(means[place])[None])[0]
        near = np.flatnonzero((np.abs(like) > FOLLOWS) & (places != place))
        near = near[np.argsort(-np.abs(like[near]), kind="stable")]
        followers[place] = [(float(like[one]), int(places[one])) for one in near]
    sure = {place: found for place, found in followers.items() if found and abs(found[0][0]) > SURE}
    for place, found in sure.items():
        first, second = found[0], found[1] if len(found) > 1 else None
        points[POSITION][place] += SLOPE
        slope = GuessCode.HAS_SLOPE.note(column=first[1] + 1, correlation=first[0])
        why.setdefault((POSITION, place), []).append(slope)
        worth = SLOPE if second is not None else RUNNER_UP
        if _add_evidence(points, VELOCITY, first[1], worth):
            note = GuessCode.IS_SLOPE.note(column=place + 1, correlation=first[0])
            why.setdefault((VELOCITY, first[1]), []).append(note)
        for correlation, other in found[1:] if second is not None else found:
            if _add_evidence(points, SPEED, other, RUNNER_UP):
                note = _motion_note(place, correlation)
                why.setdefault((SPEED, other), []).append(note)


def _by_pressure(points: dict[str, dict[int, float]], means: Mapping[int, Array], why: dict[Any, list[Note]]) -> None:
    """Find pressures: one that is the difference of two others, or that follows the pump."""
    pressed = [place for place in points.get(PRESSURE, {}) if place in means]
    pump = max(points.get(SPEED, {}), key=lambda place: points[SPEED][place], default=None)
    likest = sorted(sorted(pressed, key=lambda place: -points[PRESSURE][place])[:MOST_PRESSURES])
    differences = _differences(np.array([means[place] for place in likest])) if len(likest) > 2 else []
    for place in pressed:
        for minuend, one, other in differences:
            if likest[minuend] == place:
                points[PRESSURE][place] += DIFFERENCE
                note = GuessCode.IS_DIFFERENCE.note(one=likest[one] + 1, other=likest[other] + 1)
                why.setdefault((PRESSURE, place), []).append(note)
        if pump in means and pump is not None and place != pump:
            correlation = _correlation(means[place], means[pump])
            if abs(correlation) > WEAKLY:
                points[PRESSURE][place] += TREND
                note = _motion_note(pump, correlation)
                why.setdefault((PRESSURE, place), []).append(note)


def _motion_note(place: int, correlation: float) -> Note:
    """Return that a column follows the motion, with the same or the opposite sign."""
    code = GuessCode.FOLLOWS if correlation > 0.0 else GuessCode.OPPOSES
    return code.note(column=place + 1, correlation=correlation)


def _differences(means: Array) -> list[tuple[int, int, int]]:
    """Return the rows that are the difference of two others, each with its own scale, as (row, one, other).

    The least-squares fit of every row by every two others follows from all covariances.
    """
    if means.shape[1] < 10:
        return []
    centred = means - means.mean(axis=1, keepdims=True)
    covariance = centred @ centred.T / means.shape[1]
    own = np.diag(covariance)
    first, second = np.triu_indices(len(means), k=1)
    determinant = own[first] * own[second] - covariance[first, second] ** 2
    apart = determinant > (1.0 - ALIKE**2) * own[first] * own[second]
    first, second, determinant = first[apart], second[apart], determinant[apart]
    found: list[tuple[int, int, int]] = []
    for row in range(len(means)):
        by_first, by_second = covariance[row, first], covariance[row, second]
        between = covariance[first, second]
        one = (by_first * own[second] - by_second * between) / determinant
        other = (by_second * own[first] - by_first * between) / determinant
        left = own[row] - one * by_first - other * by_second
        # a column that resembles only one of two is not their difference
        shares = np.minimum(one**2 * own[first], other**2 * own[second])
        fits = (left < 0.02**2 * own[row]) & (one * other < 0.0) & (shares > LEAST_SHARE**2 * own[row])
        fits &= (first != row) & (second != row)
        found += [(row, int(first[place]), int(second[place])) for place in np.flatnonzero(fits)]
    return found


def _unit_rows(rows: Array) -> Array:
    """Return rows without their means, scaled to one; constant ones are zero."""
    centred = rows - rows.mean(axis=1, keepdims=True)
    size = np.linalg.norm(centred, axis=1, keepdims=True)
    return np.divide(centred, size, out=np.zeros_like(centred), where=size > 0.0)


def _with_units(
    found: Sequence[Guess],
    headings: Sequence[Heading],
    columns: Mapping[int, Any],
    why: Mapping[tuple[str, int], Sequence[Note]],
    p: EhaParameters,
) -> tuple[ChannelGuess, ...]:
    made: list[ChannelGuess] = []
    for one in sorted(found, key=lambda one: one.channel == VELOCITY):  # velocity last: its unit follows from position
        notes = list(why.get((one.channel, one.place), ()))
        heading = headings[one.place]
        if heading.stamped:
            notes = [GuessCode.DATES.note()]
        elif (one.unit is None and heading.name != one.channel) and one.channel in CANDIDATES:
            known = {other.guess.channel: other.guess for other in made}
            by_slope = _unit_of_slope(columns[one.place], known, columns) if one.channel == VELOCITY else None
            unit, *others = [by_slope] if by_slope else _usual_units(one.channel, columns[one.place], p)
            if by_slope:
                notes.append(GuessCode.UNIT_OF_SLOPE.note(column=known[POSITION].place + 1, unit=unit))
            else:
                notes.append(GuessCode.UNIT_GUESSED.note(unit=unit, usual=" or ".join([unit, *others])))
            one = Guess(one.channel, one.place, one.name, unit, one.points, UNIT_DOUBT * one.sure)
        elif one.unit is not None:
            notes.append(GuessCode.UNIT_FITS.note(unit=one.unit))
        named = points_by_name(Heading(heading.name), one.channel)
        if named is not None and named >= 2.5:
            notes.insert(0, GuessCode.CALLED_SO.note(channel=one.channel))
        made.append(ChannelGuess(one, tuple(notes)))
    order = {one.channel: place for place, one in enumerate(found)}
    return tuple(sorted(made, key=lambda one: order[one.guess.channel]))


def _unit_of_slope(velocity: Array, known: Mapping[str, Guess], columns: Mapping[int, Any]) -> str | None:
    """Return the unit in which a velocity is the slope of position, None where there is none."""
    if not {TIME, POSITION} <= known.keys():
        return None
    stamps: Any = columns[known[TIME].place]
    dated = stamps.dtype.kind == "M"
    time = seconds_from_first(stamps) if dated else stamps * _factor(known[TIME].unit or "s", "s")
    position = columns[known[POSITION].place] * _factor(known[POSITION].unit or "m", "m")
    if not len(time) == len(position) == len(velocity):
        return None
    there = np.isfinite(time) & np.isfinite(position) & np.isfinite(velocity)
    time, position, velocity = time[there], position[there], velocity[there]
    if len(time) < 20:
        return None
    way = np.append(0.0, np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)))
    if abs(_correlation(way, position)) < SURE:
        return None
    ratio = float(np.std(position) / np.std(way))
    best = min(SPEEDS, key=lambda unit: abs(np.log(ratio / _factor(unit, "m/s"))))
    return best if 1.0 / SLOPE_NEAR <= ratio / _factor(best, "m/s") <= SLOPE_NEAR else None


def _usual_units(channel: str, values: Array, p: EhaParameters) -> list[str]:
    """Return the units in which a channel has a usual size, the likeliest first; the SI unit where none is usual."""
    present = values[np.isfinite(values)]
    if not len(present):
        return [UNITS[channel]]
    if channel == TIME:
        facts = clock_facts(values)
        return usual_units(values, 0.0 if facts is None else facts.step)
    size = float(np.ptp(present)) if channel == POSITION else float(np.abs(present).max())
    least, most = LIMITS[channel].least, LIMITS[channel].most
    if channel == SPEED:
        most = 2.0 * p.motor_speed_limit
    if channel in (POSITION, VELOCITY):
        least, most = 1e-4, 2.0
    wanted = UNITS[channel]
    return [one for one in CANDIDATES[channel] if least <= size * _factor(one, wanted) <= most] or [wanted]


def _factor(unit: str, wanted: str) -> float:
    return conversion_of(unit, wanted)[0]
