"""Whether an output is measured without its sign, and the model before it: by the free run on held-back blocks."""

from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.absolute_output import (
    AbsoluteFit,
    AbsoluteProblem,
    fit_absolute,
    refitted_absolute,
    signs_at_first,
    signs_of,
)
from estimation.identification.free_run.choose_linear import criteria, slowest_pole, smallest_good_candidate
from estimation.identification.free_run.data import Channels, Scaling, blocks
from estimation.identification.free_run.dense_polynomial import RequestedSizes
from estimation.identification.free_run.held_back import BLOCKS, ComparedModel, block_error
from estimation.identification.free_run.linear_fit import COARSE
from estimation.identification.free_run.linear_problem import Form
from estimation.progress import report_progress

ORDERS = range(1, 6)
"""Orders of the linear part."""

BELOW, NEAR_ZERO = 0.05, 0.25
"""How far the lowest hundredth of an output without a sign may be below zero, and its lowest twentieth above it, over
its deviation: allowances for noise, and for a lag at a change of sign [dimensionless]."""


@dataclass(frozen=True, eq=False)
class AbsoluteCandidate(ComparedModel):
    """A fit with its held-back error.

    Parameters
    ----------
    zero : float
        The sensor's zero, in the data's scale [dimensionless].
    """

    fit: AbsoluteFit
    zero: float


def may_lack_sign(data: Channels, by: Scaling) -> bool:
    """Return whether an output comes near zero but not below, like the absolute value of a signal.

    Parameters
    ----------
    data, by : Channels, Scaling
        Scaled, and the scaling.
    """
    output = np.concatenate(data.y)
    low, near = np.nanquantile(output, [0.01, 0.05]) - _sensor_zero(by)
    return bool(low > -BELOW and near < NEAR_ZERO)


def absolute_candidates(data: Channels, by: Scaling, asked: RequestedSizes) -> list[AbsoluteCandidate]:
    """Return models of several orders, each judged on held-back blocks; none with a pole slower than a block.

    Parameters
    ----------
    data, by : Channels, Scaling
        Scaled, and the scaling.
    asked : Asked
        Sizes that the user gives.
    """
    counted, m = relative_to_zero(data, by), len(data.inputs)
    forms = [
        Form(order, (asked.n_numerator or order + (delay == 0),) * m, (delay,) * m)
        for order in (ORDERS if asked.order is None else [asked.order])
        for delay in ((0, 1) if asked.delay is None else [asked.delay])
    ]
    signs = signs_at_first(counted)
    first = [_with_progress_report(fit_absolute(form, counted, signs)) for form in forms]
    # the other orders also start from the signs that the best one has found
    best = min(first, key=lambda fit: fit.cost)
    found = list[AbsoluteCandidate]()
    for fit in first:
        again = _with_progress_report(fit_absolute(fit.linear.form, counted, [signs_of(best, counted)]))
        found.append(_judged_candidate(min(fit, again, key=lambda one: one.cost), counted, _sensor_zero(by)))
    slow = float(np.exp(-(BLOCKS + 1.0) / data.informative_samples))
    return [one for one in found if slowest_pole(one.fit.linear.f) <= slow]


def chosen_absolute(candidates: list[AbsoluteCandidate]) -> AbsoluteCandidate:
    """Return the model of least BIC among those nearly as good on held-back blocks as the best."""
    return smallest_good_candidate(candidates, min(one.held_back for one in candidates))


def relative_to_zero(data: Channels, by: Scaling) -> Channels:
    """Return the same data with the output relative to the sensor's zero.

    Parameters
    ----------
    data, by : Channels, Scaling
        Scaled, and how.
    """
    return replace(data, y=tuple(y - _sensor_zero(by) for y in data.y))


def _sensor_zero(by: Scaling) -> float:
    return -by.y_mean / by.y_std


def _with_progress_report(fit: AbsoluteFit) -> AbsoluteFit:
    report_progress("outputs without a sign")
    return fit


def _judged_candidate(fit: AbsoluteFit, data: Channels, zero: float) -> AbsoluteCandidate:
    """Return a fit with its errors on held-back blocks, each by a fit to the others."""
    target, errors = np.concatenate(data.y), list[float]()
    problem = AbsoluteProblem(fit.linear.form, data)
    for masks in blocks(data, BLOCKS):
        part: AbsoluteFit = refitted_absolute(fit, data.without(masks), COARSE)
        output: Array = problem.jacobian(part.theta)[0]
        errors.append(block_error(output - target, np.concatenate(masks) & np.isfinite(target)))
    bic = criteria(fit.cost, fit.theta.size, data.n_samples)[0]
    return AbsoluteCandidate(fit, zero, block_errors=tuple(errors), bic=bic)
