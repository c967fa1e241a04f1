"""Runs a rule's kernel on one filtering task."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Trace, empty_trace
from estimation.engine.kernels import compile_kernel
from estimation.engine.layout import Layout, layout, upper_triangle
from estimation.engine.rule import Rule, chosen_settings, weighing


def constant_row(problem: FilterProblem, settings: dict[str, float]) -> Array:
    """Return what a kernel reads and never changes, in the order of `Layout.rows`.

    Parameters
    ----------
    problem : FilterProblem
        The task.
    settings : dict[str, float]
        The rule's settings with their values, in the rule's order [each in its own unit].

    Returns
    -------
    ndarray, shape (rows,)
        Parameters [SI], process noise [dimensionless a second], variances [SI squared], settings, step [s], its share.
    """
    return constant_rows([problem], settings)[:, 0]


def constant_rows(problems: Sequence[FilterProblem], settings: dict[str, float]) -> Array:
    """Return what a kernel reads and never changes for filters side by side.

    Parameters
    ----------
    problems : sequence of FilterProblem
        The tasks, alike in model and sampling.
    settings : dict[str, float]
        The rule's settings with their values, in the rule's order [each in its own unit].

    Returns
    -------
    ndarray, shape (rows, filters)
        One column a filter, see `constant_row`.
    """
    first = problems[0]
    known = np.array([problem.parameters for problem in problems]).T[: len(fields(first.model.parameters))]
    noise = np.array([problem.noise for problem in problems]).T
    variances = np.array([problem.variances for problem in problems]).T
    shared = [*settings.values(), first.sample_time / first.substeps, 1.0 / first.substeps]
    return np.concatenate([known, noise, variances, np.repeat([shared], len(problems), axis=0).T])


def run_rule(rule: Rule, problem: FilterProblem) -> Trace:
    """Run a compiled filter.

    Parameters
    ----------
    rule : Rule
        The filter.
    problem : FilterProblem
        The task; it may set the rule's settings, and say how outliers count.

    Returns
    -------
    Trace
        Its result.

    Raises
    ------
    HydrostateError
        If a setting is not known or not what it must be, or the rule has no robust update and one is asked for.
    """
    settings, rule = chosen_settings(problem, rule.name, rule.settings), weighing(rule, problem.robust)
    trace = empty_trace(problem)
    places = layout(rule, problem.model, problem.channels)
    kernel = compile_kernel(rule, problem.model, problem.channels)
    carried, logs = len(places.carried), np.zeros((len(problem.channels), 1))
    work = np.empty(len(kernel.SLOTS))
    work[:carried] = places.start(problem.mean, problem.covariance)
    work[carried : carried + len(places.rows)] = constant_row(problem, settings)
    drives, measured = (np.ascontiguousarray(one, np.float64) for one in (problem.drives, problem.measured))
    kernel.steps(
        work,
        drives.ctypes.data,
        measured.ctypes.data,
        0,
        0,
        len(measured),
        problem.substeps,
        problem.every,
        trace.track,
        trace.track_variance,
        logs,
        trace.residuals,
        trace.residual_variances,
    )
    final = read_off(places, problem.model.width, work[:carried, None], logs, problem.variances[:, None])
    return replace(
        trace,
        mean=final.mean[0],
        covariance=final.covariance[0],
        nis=final.nis[0],
        count=final.count[0],
        log_likelihood=float(final.log_likelihood[0]),
    )


@dataclass(frozen=True, eq=False)
class Final:
    """Final belief and scores of filters side by side.

    Parameters
    ----------
    mean, covariance : ndarray, shapes (filters, n) and (filters, n, n)
        Beliefs after the last sample, in the filter's units [dimensionless].
    nis, count : ndarray, shape (filters, channels)
        Sums of squared normalised innovations, and of samples present [dimensionless].
    log_likelihood : ndarray, shape (filters,)
        Log-likelihoods [dimensionless].
    """

    mean: Array
    covariance: Array
    nis: Array
    count: Array
    log_likelihood: Array


def read_off(places: Layout, width: int, carried: Array, logs: Array, variances: Array) -> Final:
    """Read final beliefs and scores off what a kernel carried.

    Parameters
    ----------
    places : Layout
        The kernel's layout.
    width : int
        Count of states.
    carried : ndarray, shape (carried, filters)
        What it carried after the last sample [dimensionless].
    logs : ndarray, shape (channels, filters)
        Logarithms of the products flushed on the way [dimensionless].
    variances : ndarray, shape (channels, filters)
        Measurement variances [SI squared].

    Returns
    -------
    Final
        Beliefs and scores.
    """
    rows, columns = upper_triangle(width)
    covariance = np.empty((carried.shape[1], width, width))
    covariance[:, rows, columns] = covariance[:, columns, rows] = carried[width : width + len(rows)].T
    nis, count, product = (places.sums(carried, name) for name in ("nis", "count", "product"))
    with np.errstate(invalid="ignore", divide="ignore"):  # the score of a filter that diverged is not a number
        spread = logs + np.log(product) + count * np.log(2.0 * math.pi * variances)
    log_likelihood = -0.5 * np.sum(nis + spread, axis=0)
    return Final(carried[:width].T.copy(), covariance, nis.T.copy(), count.T.copy(), log_likelihood)
