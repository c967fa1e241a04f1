"""Whether an output has limits, and the linear model between them: by the free run on held-back blocks."""

from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.believable import LARGEST_ERROR_BELIEVED
from estimation.identification.free_run.choose_linear import criteria, slowest_pole, smallest_good_candidate
from estimation.identification.free_run.data import FEWEST, Channels, Scaling, blocks
from estimation.identification.free_run.held_back import BLOCKS, ComparedModel, block_error, is_better_beyond_chance
from estimation.identification.free_run.integrating import fit_integrating
from estimation.identification.free_run.limited_output import (
    LimitedProblem,
    Limits,
    at_limits,
    between_limits,
    limits_of,
)
from estimation.identification.free_run.linear_comparison import LinearComparison, linear_comparison
from estimation.identification.free_run.linear_fit import COARSE, fit_linear
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem
from estimation.identification.notes import IdentificationCode
from estimation.progress import report_progress
from estimation.stretches import stretches

ORDERS = 3
"""Highest order of the linear model."""

MARGIN, CUT_OFF = 0.02, 0.7
"""Share by which stops must reduce the held-back error, as a nonlinearity at the input must; and largest ratio of the
error with saturation to that without, as for a pole at 1."""

SETTLED_ERROR_RATIO = 0.2
"""Largest ratio of the error between stops to that without, if the output may have settled at both [fraction]; judged:
0.06 to 0.13 for pistons driven between stops, 0.26 for an output that rises faster than it falls, reported as stops."""

ONE_LEVEL, NEARLY = 0.05, 0.9
"""Distance of an input from its median, over its deviation in the whole log, within which it has one value, and share
of the samples that must have it [fraction]; judged. One or two samples after each change of the input have another
value."""


@dataclass(frozen=True, eq=False)
class LimitedCandidate(ComparedModel):
    """A fit between limits with its held-back error."""

    fit: LinearFit
    limits: Limits

    def outlasts(self, length: float) -> bool:
        """Return whether a time constant is longer than a time.

        Parameters
        ----------
        length : float
            The time in samples [count].
        """
        return slowest_pole(self.fit.f) > float(np.exp(-1.0 / length))


def limited_candidate(one: LinearComparison) -> LimitedCandidate | None:
    """Return the best model between limits, if it is better than the linear one; otherwise None.

    Sizes that are given and wrong leave what limits may explain: they must also explain more than a linear model of
    sizes that the data choose.

    Where it explains more of the log and is not surely better, the comparison's notes say where the output stands, but
    for the ends of a staircase.

    Parameters
    ----------
    one : LinearComparison
        Models without limits.
    """
    data = one.task.part
    limits = limits_of(data)
    if limits is None or min(np.isfinite(y).sum() for y in between_limits(data, limits).y) < FEWEST:
        return None
    orders = sorted({one.task.orders[0]} if len(one.task.orders) == 1 else set(one.task.orders[:ORDERS]))
    delays = one.task.delays or one.best.form.delays
    found = [
        _judged_candidate(_best_fit(form, data, limited, one), data, limited)
        for limited in (limits, replace(limits, stops=True))
        for order in orders
        for form in _forms(order, delays, one.task.asked.n_numerator)
    ]
    # a slow output behind a saturated sensor would go far beyond the limit and return late; at a stop it would not
    found = [
        each for each in found if each.limits.stops or not each.outlasts(data.informative_samples / (BLOCKS + 1.0))
    ]
    if not found:
        return None
    taken = smallest_good_candidate(found, min(each.held_back for each in found))
    # a run between stops may drift as one with a pole at 1 does, and has the same bar: not to leave most of the output;
    # saturation leaves only noise: an output that bends towards an end gains less, and exceeds it in other logs
    best, stops = one.best, taken.limits.stops
    if not _explains_more(taken, best):
        return None
    settled, between_ends = _levels_at_ends(data, limits)
    if stops:
        least = min((SETTLED_ERROR_RATIO if settled else 1.0 - MARGIN) * best.held_back, LARGEST_ERROR_BELIEVED)
    else:
        least = 0.0 if settled else CUT_OFF * best.held_back
    if taken.held_back < least and is_better_beyond_chance(taken.block_errors, best.block_errors):
        free = one.task.free
        return taken if free is None or _explains_more(taken, linear_comparison(free).best) else None
    # a staircase needs no check: input levels other than those at the ends determine the gain
    open_end = between_ends < 1.0 - NEARLY if settled else not stops
    if open_end:
        shown, share = limits_in_words(data, one.task.by, limits)
        one.notes.append(IdentificationCode.OUTPUT_AT_END.note(output=data.output, limits=shown, share=share))
    return None


def _explains_more(taken: LimitedCandidate, linear: ComparedModel) -> bool:
    """Return whether a model between limits is better on blocks and has the lower BIC of the whole log.

    Where dry friction holds an output at its turns, stops may win on blocks alone.
    """
    return taken.bic < linear.bic and taken.held_back < linear.held_back


def _levels_at_ends(data: Channels, limits: Limits) -> tuple[bool, float]:
    """Return whether inputs have one value nearly whenever the output is at an end, and how often another one.

    If so, the output may have settled there. The share is that of samples whose input has the value of no end.
    """
    u, y = np.concatenate(data.u), np.concatenate(data.y)
    at, middle = at_limits(y, limits), 0.5 * (limits.low + limits.high)  # infinite if only one end is finite
    ends = [at & end for end in (y > middle, y < middle) if np.any(at & end)]
    most = ONE_LEVEL * np.std(u, axis=0)  # a constant input counts as one value too
    there = [np.all(np.abs(u - np.median(u[end], axis=0)) <= most, axis=1) for end in ends]
    settled = all(np.mean(one[end]) > NEARLY for one, end in zip(there, ends, strict=True))
    return settled, float(np.mean(~np.any(there, axis=0)))


def limits_in_words(data: Channels, by: Scaling, limits: Limits) -> tuple[str, float]:
    """Return limits in words, and the share of samples at them.

    Parameters
    ----------
    data, by : Channels, Scaling
        Scaled, and the scaling.
    limits : Limits
        Of the output.

    Returns
    -------
    tuple of str and float
        Ends in the output's unit; share of the samples [fraction].
    """
    ends = [by.y_mean + by.y_std * one for one in (limits.low, limits.high)]
    at = np.count_nonzero(np.concatenate([at_limits(y, limits) for y in data.y]))
    return " and ".join(f"{end:.4g}" for end in ends if np.isfinite(end)), at / data.n_samples


def refitted_limited(taken: LimitedCandidate, data: Channels) -> LinearFit:
    """Return the fit of a candidate, continued on the same data or more of them.

    Parameters
    ----------
    data : Channels
        Scaled.
    """
    problem, fit = LimitedProblem(taken.fit.form, data, taken.limits), taken.fit
    theta = fit.theta
    if theta.size != problem.inner.n_parameters:
        theta = _start_values(fit.f, _between_limits(data, taken.limits), problem)
    return problem.descend(theta)


def _forms(order: int, delays: tuple[int, ...], sizes: int | None) -> list[Form]:
    """Return forms of one order, with and without a response within one sample."""
    if sizes is not None:
        return [Form(order, (sizes,) * len(delays), delays)]
    late = tuple(max(delay, 1) for delay in delays)
    return [Form(order, (order + 1,) * len(delays), delays), Form(order, (order,) * len(delays), late)]


def _best_fit(form: Form, data: Channels, limits: Limits, one: LinearComparison) -> LinearFit:
    """Return the best fit of one form: started from outputs between limits, and from models without limits."""
    report_progress("outputs with limits")
    problem = LimitedProblem(form, data, limits)
    free = _between_limits(data, limits)
    starts = [fit_linear(form, free, least_gain=COARSE).f]
    if limits.stops and form.order > 0:
        integrating = fit_integrating(form, free, starts, search=True, least_gain=COARSE)
        starts += [integrating.f] if np.isfinite(integrating.cost) else []
    starts += [each.fit.f for each in one.candidates if each.form == form]
    fits = [problem.descend(_start_values(f, free, problem), least_gain=COARSE) for f in starts]
    return min(fits, key=lambda fit: fit.cost)


def _start_values(f: Array, free: Channels, problem: LimitedProblem) -> Array:
    """Return a start for a denominator, from outputs between limits."""
    values = Problem(problem.form, free).profiled(f)[1][: problem.form.n_values]
    return problem.with_initial_states(values)


def _between_limits(data: Channels, limits: Limits) -> Channels:
    """Return the data between limits: with stops as separate logs."""
    return _pieces_between_limits(data, limits) if limits.stops else between_limits(data, limits)


def _pieces_between_limits(data: Channels, limits: Limits) -> Channels:
    """Return the data between stays at a limit as separate logs."""
    u, y = list[Array](), list[Array]()
    for inputs, output in zip(data.u, data.y, strict=True):
        for first, last in zip(*stretches(~at_limits(output, limits)), strict=True):
            if np.count_nonzero(np.isfinite(output[first:last])) >= FEWEST:
                u.append(np.ascontiguousarray(inputs[first:last]))
                y.append(output[first:last])
    return replace(data, u=tuple(u), y=tuple(y)) if u else between_limits(data, limits)


def _judged_candidate(fit: LinearFit, data: Channels, limits: Limits) -> LimitedCandidate:
    """Return a fit with its errors on held-back blocks, each by a fit to the others."""
    target, errors, whole = np.concatenate(data.y), list[float](), LimitedProblem(fit.form, data, limits)
    for masks in blocks(data, BLOCKS):
        report_progress("outputs with limits")
        part = LimitedProblem(fit.form, data.without(masks), limits).descend(fit.theta, least_gain=COARSE)
        output = whole.jacobian(part.theta)[0]
        errors.append(block_error(output - target, np.concatenate(masks) & np.isfinite(target)))
    values = fit.theta.size + limits.count
    bic = criteria(fit.cost, values, data.n_samples)[0]
    return LimitedCandidate(fit, limits, block_errors=tuple(errors), bic=bic)
