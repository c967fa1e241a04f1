"""Teeth of the pump in its flow: how far a fit's residuals show them, and a log whose speed holds them.

A pump delivers a little more and a little less as each of its teeth passes, by the angle of its shaft. Turned slowly, a
tooth lasts as long as a stroke's pressure, and is taken for soft oil. The angle is the integral of the logged speed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from estimation.arrays import Array
from estimation.fits.greybox_log import GreyBoxLog
from estimation.fits.greybox_problem import Problem
from plant.solvers.steps import parameter_names

COUNTS = tuple(range(5, 20))
"""Teeth a turn that are looked for: gear pumps have 7 to 16, pumps with an odd count of pistons pulse twice for each
[count]."""

NUDGE = 1e-2
"""Amplitude of the teeth, as a share of the flow, by which the residuals' answer to them is read off [fraction]."""

MOST_BETWEEN = 1.0
"""Half the phase of the teeth from sample to sample up to which they are followed [rad]: three samples a tooth."""

LIKELIEST = 3
"""Counts of which the model is asked [count]: with two waves each and the log itself they run side by side."""


@dataclass(frozen=True)
class Teeth:
    """Teeth of a pump in its flow.

    Parameters
    ----------
    count : int
        How many pass in a turn [count].
    cosine, sine : float
        Their parts that go with the shaft's angle since the first sample, as shares of the flow [fraction].
    """

    count: int
    cosine: float
    sine: float

    @property
    def amplitude(self) -> float:
        """Amplitude, as a share of the flow [fraction]."""
        return float(np.hypot(self.cosine, self.sine))


class ShownTeeth(NamedTuple):
    """What a fit's residuals say of one count of teeth.

    Parameters
    ----------
    teeth : Teeth
        What the log asks for beside what its drives hold, to first order.
    gain : float
        In log-likelihood, Rao's score statistic over two [dimensionless].
    std : float
        Standard deviation of the amplitude [fraction].
    opened : ndarray, shape (unknowns,)
        Variance of the unknowns' coordinates that is added where these teeth are unknown too [dimensionless].
    """

    teeth: Teeth
    gain: float
    std: float
    opened: Array


def with_teeth(log: GreyBoxLog, teeth: Sequence[Teeth]) -> GreyBoxLog:
    """Return a log whose speed delivers what the pump does with its teeth.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.
    teeth : sequence of Teeth
        What is in the flow.

    Returns
    -------
    GreyBoxLog
        The log.

    Examples
    --------
    >>> log = GreyBoxLog(np.full((3, 1), 0.1), np.zeros((3, 1)), np.zeros(0), 0.01, np.ones(3, dtype=int), ())
    >>> with_teeth(log, [Teeth(12, 0.1, 0.0)]).drives[:, 0].round(3).tolist()
    [0.11, 0.11, 0.11]
    """
    turned, drives = _turned(log), log.drives.copy()
    for one in teeth:
        drives[:, 0] += _delivered(one, turned, log.sample_time)
    return replace(log, drives=drives, teeth=tuple(one.count for one in teeth))


def shown_teeth(
    problem: Problem, theta: Array, errors: Array, bread: Array, slopes: Array, counts: Sequence[int]
) -> Mapping[int, ShownTeeth]:
    """Return the teeth that a fit's residuals show.

    Without any, each count gains 10 by chance in one log of 22,000, one of `COUNTS` in one log of 1500.

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
        Teeth a turn that are looked for [count]; of many the model is asked of the `LIKELIEST`.

    Returns
    -------
    Mapping[int, ShownTeeth]
        By their count in a turn, `opened` of the unknowns that are felt; a count that is not felt is left out.
    """
    log = problem.log
    counts = _likeliest(problem, theta, errors, counts) if len(counts) > LIKELIEST else counts
    turned = _turned(log)
    waves = [Teeth(count, *parts) for count in counts for parts in ((NUDGE, 0.0), (0.0, NUDGE))]
    known, *moved = problem.coarse.disturbed(
        theta, [log.drives, *(_added(log, _delivered(one, turned, log.sample_time)) for one in waves)]
    )
    columns = (np.stack([one.ravel() for one in moved], axis=-1) - known.reshape(-1, 1)) / NUDGE
    answers = bread @ (slopes.T @ columns)
    free = columns - slopes @ answers
    along, shown = -(errors @ free), dict[int, ShownTeeth]()
    for i, count in enumerate(counts):
        pair = slice(2 * i, 2 * i + 2)
        power = free[:, pair].T @ free[:, pair]
        if np.linalg.cond(power) > 1.0 / np.finfo(float).eps:
            continue
        spread = np.linalg.inv(power)
        cosine, sine = map(float, spread @ along[pair])
        opened = np.einsum("ij,jk,ik->i", answers[:, pair], spread, answers[:, pair])
        gain, std = 0.5 * float(along[pair] @ spread @ along[pair]), float(np.linalg.norm(spread, 2)) ** 0.5
        shown[count] = ShownTeeth(Teeth(count, cosine, sine), gain, std, opened)
    return shown


def _turned(log: GreyBoxLog) -> tuple[Array, Array]:
    """Return the shaft's angle halfway between samples, before the first and after the last one too, and its steps."""
    speed, step = log.drives[:, 0], log.sample_time
    at = np.concatenate([[0.0], np.cumsum(0.5 * step * (speed[1:] + speed[:-1]))])
    halfway = at[:-1] + step * (3.0 * speed[:-1] + speed[1:]) / 8.0
    between = np.concatenate([[-0.5 * step * speed[0]], halfway, [at[-1] + 0.5 * step * speed[-1]]])
    return between, np.pad(np.abs(np.diff(at)), 1, mode="edge")


def _delivered(teeth: Teeth, turned: tuple[Array, Array], sample_time: float) -> Array:
    """Return the speed that delivers what teeth add [rad/s].

    Straight lines between samples then deliver what teeth do that pass at an even speed. Teeth of which too few samples
    are taken deliver their mean, which is none.
    """
    between, steps = turned
    phase, half = teeth.count * between, 0.5 * teeth.count * steps
    seen = half < MOST_BETWEEN
    volume = (teeth.cosine * np.sin(phase) - teeth.sine * np.cos(phase)) / teeth.count
    return np.diff(np.where(seen, volume / np.cos(np.where(seen, half, 0.0)), 0.0)) / sample_time


def _likeliest(problem: Problem, theta: Array, errors: Array, counts: Sequence[int]) -> Sequence[int]:
    """Return the counts of teeth that residuals go with most, as pressure answers at an even speed, without the model.

    It then leaks away at one rate, so that it lags behind what teeth deliver by less the faster they pass.
    """
    log, rig = problem.log, problem.model.parameters
    value = {
        **dict(zip(parameter_names(rig), log.parameters.tolist(), strict=True)),
        **problem.model.values(theta),
    }
    rate = value["leakage_coefficient"] * value["bulk_modulus"] / value["chamber_volume"]
    blocks = np.linspace(0, len(log.drives) - 1, len(errors)).astype(np.intp)
    speed, angle = log.drives[:, 0], _turned(log)[0][1:]
    delivers = np.abs(speed) * value["pump_displacement"] > value["flow_bias"]
    speed, weighed, turn = speed[blocks], errors * delivers[blocks], np.exp(1j * angle[blocks])
    wave, gains = np.ones_like(turn), list[float]()
    for count, more in zip(counts, np.diff(counts, prepend=0).tolist(), strict=True):
        wave, passing = wave * turn**more, count * speed
        seen = np.abs(passing) * log.sample_time < 2.0 * MOST_BETWEEN
        answer = passing * seen / (rate + 1j * passing)
        along, power = np.vdot(weighed, wave * answer), float(np.sum(np.abs(answer) ** 2 * delivers[blocks]))
        gains.append(float(np.abs(along)) ** 2 / power if power > 0.0 else 0.0)
    return [counts[i] for i in np.argsort(gains)[::-1][:LIKELIEST]]


def _added(log: GreyBoxLog, speed: Array) -> Array:
    drives = log.drives.copy()
    drives[:, 0] += speed
    return drives
