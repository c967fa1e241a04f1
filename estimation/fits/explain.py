"""`explain(log, parameters, ...) -> Explanation`: the hypotheses under which a log is explained, alone or two together.

A log that the plain flow form does not explain is fitted under the hypotheses that the slopes of that fit promise most
of, then under the others, then under pairs with the likeliest; what is freed without need only widens the interval.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np

from estimation.fits.descent import Point, descend
from estimation.fits.form_fit import weighed
from estimation.fits.freed_problem import FreedProblem
from estimation.fits.greybox_fit import GreyBoxFit, concluded
from estimation.fits.greybox_log import GreyBoxLog
from estimation.fits.hypotheses import HYPOTHESES, Hypothesis
from estimation.fits.wide_problem import (
    delayed,
    flow_bounds,
    freed,
    own_starts,
    usual_pressure,
    usual_values,
    widened,
)
from estimation.models.flow import STIFFNESS
from estimation.models.wide_flow import GROWTH, WideFlowParameters, grown_leakage
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_names

SCREENING, SETTLING, FINISHING = 7, 40, 12
"""Evaluations of the model for a start, for one that is carried on, and for the last, with short model steps."""

NEAR = 2.0
"""First radius of a search [dimensionless]: it begins where the plain form ended, or a simpler hypothesis."""

LIKELIEST = 4
"""Hypotheses that are tried first, of which the slopes of the fit so far promise most."""

FINALISTS, CARRIED, NEARLY = 3, 2, 3.0
"""Hypotheses that are carried on, starts of each, and up to which share of the best start's cost the second is."""

FINEST_DELAY = 1e-3
"""Step in which a delay is sought [s]; what is left of it goes into the lag."""

MAY_VANISH, VANISHED = ("leakage_coefficient", "flow_bias", "makeup_conductance"), 1e-2
"""What a search may take for nothing by mistake, and the share of the rig's value below which it has."""

CLOSE = 60.0
"""Difference of log-likelihood up to which a rival is fitted to the end, with short model steps [dimensionless]."""

WORTH = 10.0
"""Gain in log-likelihood below which a hypothesis is not accepted [dimensionless]."""

ALIKE = 15.0
"""Difference of log-likelihood up to which two sets of hypotheses are said to explain a log alike [dimensionless]."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """What explains a log that the plain flow form does not.

    Parameters
    ----------
    names : tuple of str
        The hypotheses that were accepted together.
    values : Mapping[str, tuple of float]
        Value and standard deviation by parameter, in SI.
    delays : Mapping[str, float]
        Times by which channels come late beside their lags [s].
    fit : GreyBoxFit
        The fit under them.
    rivals : int
        How many other sets of hypotheses explain the log about as well.
    stated_pressure : float
        Absolute pressure that bulk modulus is stated at, where the oil holds air [Pa].
    """

    names: tuple[str, ...]
    values: Mapping[str, tuple[float, float]]
    delays: Mapping[str, float]
    fit: GreyBoxFit
    rivals: int
    stated_pressure: float


@dataclass(frozen=True, eq=False)
class _Tried:
    """A set of hypotheses with the best that was found under it."""

    together: tuple[Hypothesis, ...]
    point: Point
    values: Mapping[str, float]
    delays: Mapping[str, float]
    fits: tuple[GreyBoxFit, ...] = ()
    """Once it is finished: the likelier balance first, by volume or by mass, then the other one if it counts."""

    @property
    def cost(self) -> float:
        return self.point.cost

    @property
    def fit(self) -> GreyBoxFit:
        if not self.fits:
            raise ValueError("only finished fits are compared")
        return self.fits[0]


Accepted: TypeAlias = Callable[[GreyBoxFit], bool]


def explain(
    log: GreyBoxLog,
    parameters: EhaParameters,
    starts: Sequence[Mapping[str, float]],
    accepted: Accepted,
    *,
    asked: Sequence[Hypothesis] = HYPOTHESES,
    paired: bool = True,
) -> Explanation:
    """Return the hypotheses that explain a log best, alone or two together.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    parameters : EhaParameters
        The actuator.
    starts : sequence of Mapping[str, float]
        First guesses of the plain form's unknowns [SI].
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.
    asked : sequence of Hypothesis
        What is tried alone; pairs are with any other.
    paired : bool
        Whether pairs are tried where nothing explains the log alone.

    Returns
    -------
    Explanation
        The likeliest; whether it explains the log is for the gate to say.
    """
    wide = widened(log, parameters, starts[0])
    likely, others = _promising(wide, (), starts[0], asked)
    finished = _likeliest(wide, [_screened(wide, (one,), starts) for one in likely])
    if others and not accepted(finished[0].fit):
        finished = _ranked([*finished, *_likeliest(wide, [_screened(wide, (one,), starts) for one in others])])
    first = finished[0]
    if paired and not accepted(first.fit):
        late = delayed(wide, first.delays)
        others = [one for one in HYPOTHESES if one not in first.together]
        likely, others = _promising(late, first.together, first.values, others)
        tried = [*likely, *(one for one in others if one.far)]
        pairs = _likeliest(late, [_screened(late, (*first.together, one), [first.values]) for one in tried])
        better = (one for one in pairs if one.cost < first.cost - WORTH)
        finished = _ranked([first, *(replace(one, delays={**first.delays, **one.delays}) for one in better)])
    best = finished[0]
    rivals = [one for one in finished[1:] if one.cost < best.cost + ALIKE]
    found = weighed([fit for one in (best, *rivals) for fit in one.fits])
    values = {name: (value, best.fit.std[name]) for name, value in best.fit.values.items()} | dict(found)
    if any(name in values for name in GROWTH):  # what is told of a leakage is what it is at the end
        ended = float(grown_leakage(1.0, *(values.get(name, (0.0, 0.0))[0] for name in GROWTH)))
        value, std = values["leakage_coefficient"]
        values["leakage_coefficient"] = ended * value, ended * std
    names = tuple(one.name for one in best.together)
    return Explanation(names, values, best.delays, best.fit, len(rivals), usual_pressure(log, parameters))


class Promise(NamedTuple):
    """What a hypothesis promises beside a fit, to first order.

    Parameters
    ----------
    gain : float
        In log-likelihood, Rao's score statistic over two [dimensionless].
    size : float
        How far what is freed first would move in its fitted coordinate: for a logarithm a relative change
        [dimensionless].
    deviation : float
        How well that coordinate would then be known, what is presumed of it included [dimensionless].
    """

    gain: float
    size: float
    deviation: float


def promised(
    log: GreyBoxLog, parameters: EhaParameters, plain: Mapping[str, float], one: Hypothesis, *, by_mass: bool = False
) -> Promise:
    """Return what a hypothesis promises beside the plain fit, to first order.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    parameters : EhaParameters
        The actuator.
    plain : Mapping[str, float]
        What the plain form found [SI].
    one : Hypothesis
        What is asked.
    by_mass : bool
        Whether the plain fit balances mass: promises are of where it stands.

    Returns
    -------
    Promise
        Its promise.
    """
    wide = widened(log, parameters, plain)
    return _promises(_balanced_by(wide, 1.0 if by_mass else 0.0), (), plain, (one,))[0]


def _balanced_by(log: GreyBoxLog, mass: float) -> GreyBoxLog:
    """Return a log whose wide form balances mass (1), or volume (0)."""
    parameters = log.parameters.copy()
    parameters[parameter_names(WideFlowParameters).index("by_mass")] = mass
    return replace(log, parameters=parameters)


def _promising(
    log: GreyBoxLog, together: tuple[Hypothesis, ...], found: Mapping[str, float], asked: Sequence[Hypothesis]
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """Return the hypotheses that promise most beside those that are taken, best first; and the others."""
    promises = _promises(log.coarsened(), together, found, asked)
    order = sorted(range(len(asked)), key=lambda i: -promises[i].gain)
    likely = [asked[i] for i in order if not asked[i].far][:LIKELIEST]
    return likely, [one for one in asked if one not in likely]


def _promises(
    log: GreyBoxLog, together: tuple[Hypothesis, ...], found: Mapping[str, float], asked: Sequence[Hypothesis]
) -> list[Promise]:
    """Return what each hypothesis promises beside those that are taken, as `promised` does, from one evaluation."""
    problem = freed(log, (*together, *(replace(one, instead=()) for one in asked)))
    point = problem.at(problem.model.theta({**usual_values(log), **found}))
    # an unknown at its bound promises what only the hypothesis in its place can keep
    held = {name for one in asked for name in one.instead}
    own = [name for name in freed(log, together).model.unknowns if name not in held]

    def step(names: Sequence[str]) -> tuple[float, Array, Array]:
        places = [problem.model.unknowns.index(name) for name in names]
        gradient = point.gradient[places]
        gram = point.gram[np.ix_(places, places)]
        known = np.asarray(np.linalg.pinv(gram, rcond=len(places) * np.finfo(float).eps), dtype=np.float64)
        moved: Array = known @ gradient
        return 0.5 * float(gradient @ moved), moved, np.diag(known)

    before = step(own)[0]
    promises: list[Promise] = []
    for one in asked:
        names = list(dict.fromkeys((*own, *one.free)))
        gain, moved, variances = step(names)
        place = names.index(one.free[0])
        promises.append(Promise(gain - before, float(abs(moved[place])), float(variances[place]) ** 0.5))
    return promises


def _ranked(tried: Iterable[_Tried]) -> list[_Tried]:
    return sorted(tried, key=lambda one: one.cost)


def _screened(
    log: GreyBoxLog, together: tuple[Hypothesis, ...], starts: Sequence[Mapping[str, float]]
) -> Iterator[_Tried]:
    """Yield the best from each start after a few steps, with one model step a sample."""
    absent = usual_values(log)
    asked = [{together[-1].late: delay} if delay else dict[str, float]() for delay in together[-1].delays]
    problems = [(delays, freed(delayed(log, delays).coarsened(), together)) for delays in asked]
    for start in starts:
        tried: list[_Tried] = []
        for (delays, problem), own in product(problems, own_starts(log, together[-1])):
            guess = problem.model.theta({**absent, **start, **own})
            point = descend(problem.at, guess, SCREENING, flow_bounds(problem.model, [guess], log), radius=NEAR)
            tried.append(_Tried(together, point, problem.model.values(point.theta), delays))
        yield min(tried, key=lambda one: one.cost)


def _settled(log: GreyBoxLog, tried: _Tried) -> _Tried:
    """Return a set of hypotheses brought to its optimum, with one model step a sample."""
    early = delayed(log, tried.delays).coarsened()
    best = _descended(early, tried, tried.point.theta, SETTLING)
    if (revived := _revived(log, best)) is not None:
        best = min(best, _descended(early, best, revived, SETTLING), key=lambda one: one.cost)
    if len(tried.together[-1].delays) == 1:
        return best
    channel = tried.together[-1].late
    for step in (FINEST_DELAY, -FINEST_DELAY):
        while (delay := best.delays.get(channel, 0.0) + step) >= 0.0:
            moved = replace(best, delays={channel: delay})
            moved = _descended(delayed(log, moved.delays).coarsened(), moved, best.point.theta, SETTLING)
            if moved.cost >= best.cost:
                break
            best = moved
    return best


def _revived(log: GreyBoxLog, tried: _Tried) -> Array | None:
    """Return a start with the rig's value of what has all but vanished, from where a logarithm finds no way back."""
    usual = usual_values(log)
    gone = {name: usual[name] for name in MAY_VANISH if tried.values[name] < VANISHED * usual[name]}
    if not gone:
        return None
    return freed(log, tried.together).model.theta({**tried.values, **gone})


def _descended(log: GreyBoxLog, tried: _Tried, start: Array, evaluations: int, *more: str) -> _Tried:
    problem = freed(log, tried.together, *more)
    bounds = flow_bounds(problem.model, [start], log)
    point = descend(problem.at, start, evaluations, bounds, radius=NEAR)
    return replace(tried, point=point, values=problem.model.values(point.theta))


def _finished(log: GreyBoxLog, tried: _Tried) -> _Tried:
    """Return a set of hypotheses fitted to the end, balanced by volume and by mass.

    Balanced by mass, the inner circuit yields as it does in the plain form. A log that does not tell the two apart is
    believed neither alone: they may differ by three deviations.
    """
    row = delayed(log, tried.delays)
    done: list[tuple[_Tried, FreedProblem]] = []
    for share, more in ((0.0, ()), (1.0, (STIFFNESS,))):
        own = _balanced_by(row, share)
        problem, begun = freed(own, tried.together, *more), done[-1][0] if done else tried
        start = problem.model.theta({**usual_values(own), **begun.values})
        done.append((_descended(own, begun, start, FINISHING, *more), problem))
    done.sort(key=lambda one: one[0].cost)
    best = done[0][0]
    count = [one for one in done if one[0].cost < best.cost + ALIKE]
    return replace(best, fits=tuple(concluded(problem, one.point) for one, problem in count))


def _likeliest(log: GreyBoxLog, tried: Sequence[Iterable[_Tried]]) -> list[_Tried]:
    """Return the likeliest of several sets of hypotheses, each tried from some starts, the best first.

    The first set is carried on in any case: a few steps from a start are no measure of what promises most.
    """
    first, *others = [_ranked(one) for one in tried]
    sets = [first, *sorted(others, key=lambda one: one[0].cost)[: FINALISTS - 1]]
    carried = [[start for start in one[:CARRIED] if start.cost < NEARLY * one[0].cost] for one in sets]
    settled = _ranked(_ranked(_settled(log, start) for start in one)[0] for one in carried)
    return _ranked(_finished(log, one) for one in settled if one.cost < settled[0].cost + CLOSE)
