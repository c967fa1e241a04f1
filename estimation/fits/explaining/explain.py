"""`explain(log, parameters, ...) -> Explanation`: the hypotheses under which a log is explained, alone or two together.

A log that the plain flow form does not explain is fitted under the hypotheses that the slopes of that fit promise most
of, then under the others, then under pairs with the likeliest; what is freed without need only widens the interval.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from estimation.fits.explaining.form_fit import weighed
from estimation.fits.explaining.promises import promised_beside, promising
from estimation.fits.explaining.screened import NEARLY, hopeful, nearing, screened
from estimation.fits.explaining.settled import at_end, coarse, descended, gone, settled
from estimation.fits.explaining.thinned import FEW, NOTHING_SPARED, Spared, left_by, skipping
from estimation.fits.explaining.tried import Explanation, Tried
from estimation.fits.explaining.wide_log import balanced_by, delayed, usual_pressure, usual_values, widened
from estimation.fits.explaining.wide_problem import flow_bounds, freed, own_starts
from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.fit import GreyBoxFit, concluded
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import DELIVERY, HYPOTHESES, Hypothesis
from estimation.models.flow import STIFFNESS
from estimation.models.wide_flow import GROWTH, grown_leakage
from plant.arrays import Array
from plant.eha.model import EhaParameters

FINISHING = 12
"""Evaluations of the model for the last search, with short model steps."""

ROUNDS = 6
"""How often the last ones are made at most, while each gains what would tell a hypothesis from another [count]."""

FINALISTS, CARRIED = 3, 2
"""Hypotheses that are carried on, and starts of each."""

NEARLY_AS_GOOD = 1.1
"""What the cost of a finished set is multiplied by before others are compared with it: their model steps are long, and
have errors [dimensionless]."""

MUCH = 0.2
"""What the best set of hypotheses leaves at most of what was left, to be searched anew with all samples [fraction]."""

UNFINISHED = 10.0
"""Half the sum of squares over what noise alone makes of it, from which a set of hypotheses is not fitted with short
model steps [dimensionless]; what explains a log comes to 1.2."""

FINISHED, REACHED = 0.7, 1.5
"""A search with short model steps goes on while its steps promise to bring the cost to the first share of itself (six
rounds of it make an eighth), but is never asked for less than the second times what noise alone makes [fractions]."""

CLOSE = 60.0
"""Difference of log-likelihood up to which a rival is fitted to the end, with short model steps [dimensionless]."""

NEVER = float(np.finfo(np.float64).max)
"""Cost of a fit that is not what its hypotheses say, so that it is not believed [dimensionless]."""

LITTLE = 1e-3
"""Share of the cost below which a gain tells nothing of what leaves far more than noise [fraction]; judged."""

WORTH = 10.0
"""Gain in log-likelihood below which a hypothesis is not accepted [dimensionless]."""

ALIKE = 15.0
"""Difference of log-likelihood up to which two sets of hypotheses are said to explain a log alike [dimensionless]."""


Accepted: TypeAlias = Callable[[GreyBoxFit], bool]


def explain(
    log: GreyBoxLog,
    parameters: EhaParameters,
    starts: Sequence[Mapping[str, float]],
    accepted: Accepted,
    *,
    asked: Sequence[Hypothesis] = HYPOTHESES,
    paired: bool = True,
    hopeless: float = np.inf,
    by_mass: bool = False,
) -> Explanation | None:
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
    hopeless : float
        Cost from which the best alone counts for so little that no pair is tried [dimensionless].
    by_mass : bool
        Whether mass is balanced while hypotheses are compared, as where the likelier plain fit does; else volume. At
        high pressure the two differ by more than what is strange.

    Returns
    -------
    Explanation or None
        The likeliest; whether it explains the log is for the gate to say. None where it leaves far too much.
    """
    wide = balanced_by(widened(log, parameters, starts[0]), 1.0 if by_mass else 0.0)
    likely, others = promising(wide, (), starts[0], asked)
    left = _left_by_plain(wide, starts[0])
    spared = Spared(skipping(wide, left), left, starts)
    begun = [[*screened(wide, (one,), starts, every=spared.every)] for one in likely]
    finished = _likeliest(wide, begun, spared=spared)
    if others and not _explained(finished[0], accepted):
        known = finished[0].cost
        more = nearing(wide, others, starts, hopeful(starts, begun), known, spared.every)
        finished = _ranked([*finished, *_likeliest(wide, more, known, spared)])
    if paired and finished[0].cost < hopeless and not _explained(finished[0], accepted):
        first, second = finished[0], finished[1] if len(finished) > 1 else None
        pairs = _paired(wide, first, starts[0], accepted)
        near = left_by(wide, first.cost) < NEARLY or (pairs and _explained(pairs[0], accepted))
        if second and near and second.cost <= NEARLY_AS_GOOD * first.cost:
            pairs += _paired(wide, second, starts[0], accepted)
        finished = _distinct([first, *pairs])
    best = finished[0]
    if not best.fits:
        return None
    rivals = [one for one in finished[1:] if one.fits and one.cost < best.cost + ALIKE]
    found = weighed([fit for one in (best, *rivals) for fit in one.fits])
    values = {name: (value, best.fit.std[name]) for name, value in best.fit.values.items()} | dict(found)
    if any(name in values for name in GROWTH):  # what is told of a leakage is what it is at the end
        ended = float(grown_leakage(1.0, *(values.get(name, (0.0, 0.0))[0] for name in GROWTH)))
        value, std = values["leakage_coefficient"]
        values["leakage_coefficient"] = ended * value, ended * std
    names = tuple(one.name for one in best.together)
    open_by = _delivery_open(wide, best)
    return Explanation(names, values, best.delays, best.fit, len(rivals), usual_pressure(log, parameters), open_by)


def _paired(log: GreyBoxLog, first: Tried, plain: Mapping[str, float], accepted: Accepted) -> list[Tried]:
    """Return what explains a log together with a hypothesis that does not alone, and better; the best first.

    What slopes promise most is tried first, and all else where that does not explain the log: slopes are taken where
    the first hypothesis has gone to take up what the second one does. The best of it is fitted to the end in any case.
    """
    late = delayed(log, first.delays)
    taken = {one.name for one in first.together}
    likely, others = promising(late, first.together, first.values, [one for one in HYPOTHESES if one.name not in taken])
    begun = [_begun_again(log, first), {**plain, **own_starts(log, first.together[-1])[0]}]
    left = left_by(log, first.cost)
    spared = Spared(skipping(log, left), left, begun)
    tried = [*likely, *(one for one in others if one.far)]
    nearer = (screened(late, (*first.together, one), begun, every=spared.every) for one in tried)
    useful = first.cost - WORTH
    pairs = _likeliest(late, nearer, first.cost, spared, useful)
    if not pairs or not _explained(pairs[0], accepted):
        known = NEARLY_AS_GOOD * min(one.cost for one in (first, *pairs[:1]))
        rest = [screened(late, (*first.together, one), begun, known, spared.every) for one in others if not one.far]
        pairs = _ranked([*pairs, *_likeliest(late, rest, spared=spared, useful=useful)])
    better = (one for one in pairs if one.cost < first.cost - WORTH)
    return [replace(one, delays={**first.delays, **one.delays}) for one in better]


def _left_by_plain(log: GreyBoxLog, plain: Mapping[str, float]) -> float:
    """Return what the plain form leaves of a log, over what noise alone makes."""
    problem = freed(coarse(log, {}, ()), ())
    return left_by(log, float(problem.costs([problem.model.theta({**usual_values(log), **plain})])[0]))


def _cost(tried: Tried) -> float:
    return tried.cost


def _explained(tried: Tried, accepted: Accepted) -> bool:
    return not tried.void and bool(tried.fits) and accepted(tried.fit)


def _begun_again(log: GreyBoxLog, first: Tried) -> Mapping[str, float]:
    """Return where a hypothesis ended with long model steps, as the next search takes; nothing of it has vanished."""
    ended = first.coarse or first.values
    return {**ended, **gone(log, ended)}


def _delivery_open(log: GreyBoxLog, best: Tried) -> float:
    """Return how well a log tells what the pump delivers beside what explains it; see `Explanation`."""
    if DELIVERY.free[0] in best.values:
        return 0.0
    return promised_beside(delayed(log, best.delays), best.together, best.values, DELIVERY).deviation


def _ranked(tried: Iterable[Tried]) -> list[Tried]:
    return sorted(tried, key=_cost)


def _distinct(tried: Iterable[Tried]) -> list[Tried]:
    """Return the best of each set of hypotheses, in whatever order these came; the best first."""
    best: dict[frozenset[str], Tried] = {}
    for one in _ranked(tried):
        best.setdefault(frozenset(each.name for each in one.together), one)
    return [*best.values()]


def _finished(log: GreyBoxLog, tried: Tried, useful: float = np.inf) -> Tried:
    """Return a set of hypotheses fitted to the end, balanced by volume and by mass.

    Balanced by mass, the inner circuit yields as it does in the plain form. A log that does not tell the two apart is
    believed neither alone: they may differ by three deviations.
    """
    row = delayed(log, tried.delays)
    done: list[tuple[Tried, FreedProblem]] = []
    last = at_end(tried.together)
    for share, more in ((0.0, last), (1.0, (STIFFNESS, *last))):
        own = balanced_by(row, share)
        problem, begun = freed(own, tried.together, *more), done[-1][0] if done else tried
        start = problem.model.theta({**usual_values(own), **begun.values})
        done.append((_to_its_end(own, begun, start, *more, useful=useful), problem))
    done.sort(key=lambda one: one[0].cost)
    best = replace(done[0][0], coarse=tried.values)
    count = [one for one in done if one[0].cost <= best.cost + ALIKE]
    first, *rivals = (_concluded(problem, one.point, log) for one, problem in count)
    found = ((one, one.free[0]) for one in best.together)
    if best.meant and all(one.told(best.values[name], first.std.get(name, 0.0)) for one, name in found):
        return replace(best, fits=(first, *(one for one in rivals if np.isfinite(one.std["bulk_modulus"]))))
    return replace(best, void=True, fits=(replace(first, cost=NEVER),))


def _concluded(problem: FreedProblem, point: Point, log: GreyBoxLog) -> GreyBoxFit:
    least, _ = flow_bounds(problem.model, [point.theta], log)
    return concluded(problem, point, least=least, warned=False)


def _to_its_end(log: GreyBoxLog, tried: Tried, start: Array, *more: str, useful: float = np.inf) -> Tried:
    """Return the end of a search with short model steps: where long ones end may be far from it."""
    best = descended(log, tried, start, FINISHING, *more, wanted=min(useful, _hoped(log, tried.cost)))
    for _ in range(ROUNDS - 1):
        further = descended(log, best, best.point.theta, FINISHING, *more, wanted=min(useful, _hoped(log, best.cost)))
        gained = best.cost - further.cost
        if gained > 0.0:
            best = further
        if gained < max(CLOSE, LITTLE * best.cost):
            break
    return best


def _hoped(log: GreyBoxLog, cost: float) -> float:
    """Return the cost to which a search with short model steps must promise to come, lest it ends."""
    if len(log.drives) < FEW or not np.isfinite(cost):
        return np.inf
    return max(FINISHED * cost, REACHED * cost / left_by(log, cost))


def _in_vain(log: GreyBoxLog, cost: float) -> bool:
    """Return whether a long log is left so far from explained that short model steps bring it nowhere near."""
    return len(log.drives) >= FEW and left_by(log, cost) >= UNFINISHED


def _likeliest(
    log: GreyBoxLog,
    tried: Iterable[Iterable[Tried]],
    known: float = np.inf,
    spared: Spared = NOTHING_SPARED,
    useful: float = np.inf,
) -> list[Tried]:
    """Return the likeliest of several sets of hypotheses, each tried from some starts, the best first.

    The first set is carried on in any case: a few steps from a start are no measure of what promises most. What cannot
    come close to the best, or to what is known, is not followed to its optimum. Where few samples were ``spared``,
    all of them count at the end. What leaves far more than any fit that explains a log is not fitted to the end.
    """
    known *= NEARLY_AS_GOOD
    first, *others = [_ranked(one) for one in tried]
    sets = [first, *sorted(others, key=lambda one: one[0].cost)[: FINALISTS - 1]]
    carried = [[one[0], *(start for start in one[1:CARRIED] if start.cost < NEARLY * one[0].cost)] for one in sets]
    ended: list[Tried] = []
    for one in carried:
        wanted = min((known, *(other.cost for other in ended))) + CLOSE
        ended.append(_ranked(settled(log, start, wanted, spared.every) for start in one)[0])
    if spared.every > 1:
        ended = [*_with_all(log, ended, known, spared)]
    best = min((known, *(one.cost for one in ended)))
    near = [one for one in _ranked(ended) if one.cost <= best + CLOSE]
    return _ranked(one if _in_vain(log, one.cost) else _finished(log, one, useful) for one in near)


def _with_all(log: GreyBoxLog, ended: Iterable[Tried], known: float, spared: Spared) -> Iterator[Tried]:
    """Yield sets of hypotheses led on where all samples count, as far as they may still explain the log.

    Few samples may have a valley by themselves. So the best set is sought anew with all, where it explains much.
    """
    for place, one in enumerate(_ranked(ended)):
        near = one.cost <= NEARLY_AS_GOOD * known + CLOSE
        much = place == 0 and left_by(log, one.cost) < MUCH * spared.left
        if near and (much or left_by(log, one.cost) < UNFINISHED):
            problem = freed(coarse(log, one.delays, one.together), one.together, *at_end(one.together[:-1]))
            theta = problem.model.theta({**usual_values(log), **one.values})
            begun = replace(one, point=replace(one.point, theta=theta))
            further = settled(log, begun, NEARLY_AS_GOOD * known + CLOSE)
            if place == 0 and left_by(log, further.cost) < max(MUCH * spared.left, UNFINISHED):
                again = _ranked(screened(log, one.together, spared.starts))[:CARRIED]
                further = min(further, *(settled(log, start, further.cost) for start in again), key=_cost)
            known = min(known, further.cost)
            yield further
        else:
            yield one
