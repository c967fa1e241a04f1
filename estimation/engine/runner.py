"""Runs a rule's kernel on one filtering task."""

import math
from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Trace, empty_trace
from estimation.engine.kernels import compile_kernel
from estimation.engine.layout import Layout, layout, upper_triangle
from estimation.engine.rule import Rule, chosen_settings, weighing
from plant.compiled.native.load import NativeKernel


def constant_row(problem: FilterProblem, settings: dict[str, float]) -> Array:
    """Return the constants of a kernel, in the order of `Layout.rows`.

    Parameters
    ----------
    settings : dict[str, float]
        The rule's settings with their values, in the rule's order [each in its own unit].

    Returns
    -------
    ndarray, shape (rows,)
        Parameters [SI], process noise [dimensionless per second], variances [SI squared], settings, step [s], its
        share.
    """
    return constant_rows([problem], settings)[:, 0]


def constant_rows(problems: Sequence[FilterProblem], settings: dict[str, float]) -> Array:
    """Return the constants of a kernel for filters side by side.

    Parameters
    ----------
    problems : sequence of FilterProblem
        The tasks, with the same model and sampling.
    settings : dict[str, float]
        The rule's settings with their values, in the rule's order [each in its own unit].

    Returns
    -------
    ndarray, shape (rows, filters)
        One column for each filter, see `constant_row`.
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
    problem : FilterProblem
        The task; it may set the rule's settings, and how outliers count.

    Raises
    ------
    HydrostateError
        If a setting is not known or not what it must be, or the rule has no robust update and one is asked for.
    """
    trace = empty_trace(problem)
    places, kernel, work = prepared_kernel(rule, [problem])
    drives, measured = (np.ascontiguousarray(one, np.float64) for one in (problem.drives, problem.measured))
    where, logs = (drives.ctypes.data, measured.ctypes.data), np.zeros((len(problem.channels), 1))
    results = trace.track, trace.track_variance, logs, trace.residuals, trace.residual_variances
    kernel.steps(work.ravel(), *where, 0, 0, len(measured), problem.substeps, problem.every, results)
    return final_traces(places, [problem], work, logs, [trace])[0]


def prepared_kernel(rule: Rule, lanes: Sequence[FilterProblem]) -> tuple[Layout, NativeKernel, Array]:
    """Return layout and kernel of a rule, and the kernel's buffer before the first sample.

    Parameters
    ----------
    lanes : sequence of FilterProblem
        Tasks that differ only in numbers, side by side.

    Returns
    -------
    places : Layout
        The kernel's layout.
    kernel : NativeKernel
        The compiled kernel.
    work : ndarray, shape (slots, lanes)
        Its buffer [dimensionless].
    """
    first = lanes[0]
    settings, rule = chosen_settings(first, rule.name, rule.settings), weighing(rule, first.robust)
    places = layout(rule, first.model, first.channels)
    kernel = compile_kernel(rule, first.model, first.channels, len(lanes))
    carried, work = len(places.carried), aligned_array(kernel.LINES, len(lanes))
    work[:carried] = places.start(np.array([one.mean for one in lanes]), np.array([one.covariance for one in lanes]))
    work[carried : carried + len(places.rows)] = constant_rows(lanes, settings)
    return places, kernel, work


def aligned_array(*shape: int) -> Array:
    """Return an array that begins at a cache line: a vector across two cache lines takes twice as long.

    Parameters
    ----------
    *shape : int
        Its shape.

    Returns
    -------
    ndarray
        Not initialised.
    """
    size = math.prod(shape)
    buffer = np.empty(size + 8)
    begin = -buffer.ctypes.data % 64 // 8
    return buffer[begin : begin + size].reshape(shape)


def final_traces(
    places: Layout, lanes: Sequence[FilterProblem], work: Array, logs: Array, traces: Sequence[Trace]
) -> list[Trace]:
    """Read final beliefs and scores from a kernel's buffer.

    Parameters
    ----------
    work : ndarray, shape (slots, lanes)
        The kernel's buffer after the last sample [dimensionless].
    logs : ndarray, shape (channels, lanes)
        Logarithms of the flushed products [dimensionless].
    traces : sequence of Trace
        Traces with tracks and innovations, one for each task.
    """
    width, carried = lanes[0].model.width, work[: len(places.carried)]
    rows, columns = upper_triangle(width)
    covariance = np.empty((carried.shape[1], width, width))
    covariance[:, rows, columns] = covariance[:, columns, rows] = carried[width : width + len(rows)].T
    nis, count, product = (places.sums(carried, name) for name in ("nis", "count", "product"))
    variances = np.array([one.variances for one in lanes]).T
    with np.errstate(invalid="ignore", divide="ignore"):  # a diverged filter scores NaN
        spread = logs + np.log(product) + count * np.log(2.0 * math.pi * variances)
    score = -0.5 * np.sum(nis + spread, axis=0)
    final = zip(carried[:width].T.copy(), covariance, nis.T.copy(), count.T.copy(), map(float, score), strict=True)
    return [
        trace._replace(mean=mean, covariance=P, nis=own, count=present, log_likelihood=likelihood)
        for trace, (mean, P, own, present, likelihood) in zip(traces, final, strict=False)
    ]
