"""A linear trend that the inputs do not explain: a sensor that drifts, or a bench that warms up.

With inputs of non-zero mean an integrator rises like a trend, so a pole at 1 or a slow one follows it, and the steady
gain is arbitrary. A trend behind a stable plant is again a trend, so time is one more input here. If the slow pole then
explains no more than chance, and white noise is left, it was the trend.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.choose_linear import criteria, slowest_pole
from estimation.identification.free_run.data import Channels, liveliest_sections, scaled
from estimation.identification.free_run.dead_times import ORDER
from estimation.identification.free_run.held_back import BLOCKS
from estimation.identification.free_run.linear_comparison import LinearComparison, linear_comparison
from estimation.identification.free_run.linear_fit import COARSE, fit_linear
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem
from estimation.identification.free_run.log_offsets import NEAR_RATIO, has_slow_pole
from estimation.identification.free_run.random_walk import FEWEST, has_long_memory, longest_residual
from estimation.identification.notes import IdentificationCode


@dataclass(frozen=True, eq=False)
class Detrended:
    """Logs without their trend.

    Parameters
    ----------
    linear : LinearComparison
        Models of the remainder.
    trends : tuple of ndarray, shape (n,)
        For each log, zero in its middle [output unit].
    """

    linear: LinearComparison
    trends: tuple[Array, ...]


def detrended(one: LinearComparison, orders: Sequence[int]) -> Detrended | None:
    """Return models beside a trend; None if the model without one is stable, or explains more than a trend does.

    Parameters
    ----------
    one : LinearComparison
        Models without a trend.
    orders : sequence of int
        Orders of the models that are compared; the first few determine the trend.
    """
    task = one.task
    part, slow = _with_time_input(task.part), one.best.fit
    if not has_slow_pole(one.best, one) and not _has_trend(one, part):
        return None
    quickest = float(np.exp(-(BLOCKS + 1.0) / task.part.informative_samples))
    delays = slow.form.delays
    # a trend replaces the slow pole, so one order less than requested is tried too
    fewer = sorted({max(orders[0] - 1, 1), *orders[:ORDER]})
    forms = [_form_with_trend(Form(order, (order + 1,) * len(delays), delays)) for order in fewer]
    settled = [fit for form in forms if slowest_pole((fit := fit_linear(form, part, least_gain=COARSE)).f) <= quickest]
    if not settled:
        return None
    beside = fit_linear(_form_with_trend(slow.form), part, [slow.f], least_gain=COARSE)
    best = min(settled, key=lambda fit: _bic(fit, part))
    sizes, late = best.form.sizes[:-1], best.form.delays[:-1]
    alone = fit_linear(Form(best.form.order, sizes, late), task.part, [best.f], least_gain=COARSE)
    if not _bic(best, part) < min(_bic(beside, part), _bic(alone, task.part)):
        return None
    # the residual of a nonlinearity is slow too, but it is no trend
    rest = longest_residual(best, part)
    if rest.size < FEWEST or has_long_memory(rest):
        return None
    whole = _with_time_input(task.whole)
    values = Problem(best.form, whole).profiled(best.f)[1]
    rate = float(values[best.form.n_b - 1] / best.f.sum()) * task.by.y_std
    trends = tuple(rate * u[:, -1] for u in whole.u)
    data = replace(task.data, y=tuple(y - trend for y, trend in zip(task.data.y, trends, strict=True)))
    flat, by = scaled(data)
    cut = liveliest_sections(flat, sum(y.size for y in task.part.y))
    own = linear_comparison(replace(task, data=data, whole=flat, by=by, part=cut))
    left = own.best.held_back * by.y_std / task.by.y_std
    if has_slow_pole(own.best, own) or left > NEAR_RATIO * one.best.held_back:
        return None
    slope = rate / (task.whole.longest * task.data.sample_time)
    own.notes.append(IdentificationCode.TREND.note(output=task.data.output, slope=slope))
    return Detrended(own, trends)


def _has_trend(one: LinearComparison, part: Channels) -> bool:
    """Return whether a trend explains more than chance beside a stable model, and leaves white noise."""
    fit = fit_linear(_form_with_trend(one.best.form), part, [one.best.fit.f], least_gain=COARSE)
    if not _bic(fit, part) < _bic(one.best.fit, one.task.part):
        return False
    rest = longest_residual(fit, part)
    return rest.size >= FEWEST and not has_long_memory(rest)


def _with_time_input(data: Channels) -> Channels:
    """Return channels with time as one more input: zero in the middle of each log, 1 over the longest."""
    times = [(np.arange(y.size) - 0.5 * (y.size - 1)) / data.longest for y in data.y]
    u = tuple(np.column_stack([own, time]) for own, time in zip(data.u, times, strict=True))
    return replace(data, inputs=(*data.inputs, "time"), u=u)


def _form_with_trend(form: Form) -> Form:
    return Form(form.order, (*form.sizes, 1), (*form.delays, 0))


def _bic(fit: LinearFit, data: Channels) -> float:
    return criteria(fit.cost, fit.theta.size, data.n_samples)[0]
