"""The interacting multiple model filter: several beliefs about how the plant behaves, mixed at every sample.

Source: Blom and Bar-Shalom (1988); Bar-Shalom, Li and Kirubarajan (2001), section 11.6.6, steps 1 to 5, which
`estimation.filters.imm_loops` takes in turn: mix, step every mode, weight, combine. A mode is any `Rule` on any task,
as long as all modes have the same states. Probabilities are logarithms throughout and are summed relative to the
largest: nothing underflows, and nothing is floored. A mode that stops being finite has no probability, and starts again
from the others at the next sample.

`imm` runs a bank of extended Kalman filters that assume different leakage and friction, so that those of the log need
not be known; `interacting` runs any bank.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from itertools import product
from math import log

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Trace, empty_trace
from estimation.engine.layout import upper_triangle
from estimation.engine.rule import Rule, chosen_settings, positive, weighing
from estimation.engine.runner import constant_row
from estimation.filters.ekf import EKF
from estimation.filters.imm_loops import compile_imm
from plant.errors import HydrostateError

LEAKAGE: Mapping[str, tuple[float, ...]] = {
    "leakage_coefficient": (1.0, 5.3, 12.6),
    "flow_bias": (1.0, 5.7, 6.1),
}
"""Levels of leakage in the bank, as multiples of the filter's given value: the rows of Table 3 relative to its
first."""

FRICTION: Mapping[str, tuple[float, ...]] = {
    "friction_quadratic": (1.0, 17.6, 67.7),
    "friction_linear": (1.0, -3.47, 8.69),
    "friction_coulomb": (1.0, 1.15, 1.26),
}
"""Levels of friction: the rows of Table 4 relative to its first; a_2 dips (errata E12)."""

IMM_SETTINGS = (positive("dwell_time", 10.0),)
"""Mean time that a mode lasts [s]: long compared with the sample time, so that a probability rests on many samples."""


def imm(problem: FilterProblem) -> Trace:
    """Run interacting extended Kalman filters, one for each combination of a leakage and a friction level.

    Parameters
    ----------
    problem : FilterProblem
        The task; it may set ``dwell_time`` [s]. Quantities that the model estimates itself are not varied.

    Raises
    ------
    HydrostateError
        If a setting is not known, or a mode would last no longer than a sample.
    """
    settings = chosen_settings(problem, "imm", IMM_SETTINGS)
    bank = [(EKF, replace(problem, parameters=row, settings={})) for row in bank_parameters(problem)]
    transitions = log_transitions([settings["dwell_time"]] * len(bank), problem.sample_time)
    trace, _ = interacting(bank, transitions, np.full(len(bank), -log(len(bank))))
    return trace


def bank_parameters(problem: FilterProblem) -> list[Array]:
    """Return the rows of parameters of the default bank.

    Returns
    -------
    list of ndarray, each shape (parameters,)
        One for each mode, that of the task itself first [SI].
    """
    names = [field.name for field in fields(problem.model.parameters)]
    estimated = {state.name for state in problem.model.states}
    rows: list[Array] = []
    for levels in product(range(3), repeat=2):
        row = problem.parameters.copy()
        for axis, level in zip((LEAKAGE, FRICTION), levels, strict=True):
            for name in set(axis).intersection(names) - estimated:
                row[names.index(name)] *= axis[name][level]
        if not any(np.array_equal(row, other) for other in rows):
            rows.append(row)
    return rows


def interacting(
    bank: Sequence[tuple[Rule, FilterProblem]], transitions: Array, log_probability: Array
) -> tuple[Trace, Array]:
    """Run the filters of a bank, mixed before every sample because the mode may have changed.

    Parameters
    ----------
    bank : sequence of (Rule, FilterProblem)
        The modes. They share prior, log and sampling, which are taken from the first one, and whether innovations are
        kept.
    transitions : ndarray, shape (modes, modes)
        Logarithm of the probability that a mode is followed by another, from row to column [dimensionless].
    log_probability : ndarray, shape (modes,)
        Logarithm of each mode's probability before the first sample [dimensionless]; overwritten with the value after
        the last sample.

    Returns
    -------
    tuple of (Trace, ndarray of shape (rows, modes))
        The mixture, and the logarithm of each mode's probability along its track [dimensionless].
    """
    first = bank[0][1]
    each = [(weighing(rule, problem.robust), problem.model) for rule, problem in bank]
    rows = [constant_row(problem, chosen_settings(problem, rule.name, rule.settings)) for rule, problem in bank]
    kinds = tuple(dict.fromkeys(each))
    kernel = compile_imm(kinds, first.channels)
    packed = np.concatenate([first.mean, first.covariance[upper_triangle(first.model.width)]])
    states = np.zeros((len(bank), kernel.carried))
    states[:, : len(packed)] = packed
    constants = np.zeros((len(bank), max(map(len, rows))))
    for i, row in enumerate(rows):
        constants[i, : len(row)] = row
    trace = empty_trace(first)
    history = np.empty((len(trace.track), len(bank)))
    order, chain = np.array([kinds.index(kind) for kind in each]), (transitions, log_probability)
    log_likelihood = kernel.run(states, constants, order, *chain, first.samples, history, trace)
    return trace._replace(log_likelihood=log_likelihood), history


def log_transitions(dwell_times: Sequence[float], sample_time: float) -> Array:
    """Return the log of a transition matrix in which each mode lasts some time on average and leads to all others.

    The duration of a mode is geometric: it ends at a sample with probability ``sample_time / dwell_time``.

    Parameters
    ----------
    dwell_times : sequence of float
        Mean time that each mode lasts [s]; infinite for a mode that never ends.
    sample_time : float
        Time between samples [s].

    Returns
    -------
    ndarray, shape (modes, modes)
        From row to column [dimensionless].

    Raises
    ------
    HydrostateError
        If a mode lasts no longer than a sample.

    Examples
    --------
    >>> np.exp(log_transitions([1.0, 0.5], 0.1)).round(3).tolist()
    [[0.9, 0.1], [0.2, 0.8]]
    """
    count = len(dwell_times)
    result = np.empty((count, count))
    for i, dwell_time in enumerate(dwell_times):
        if not dwell_time > sample_time:
            raise HydrostateError(f"a mode must last longer than a sample ({sample_time} s), got {dwell_time} s")
        leaving = sample_time / dwell_time if count > 1 else 0.0
        result[i] = log(leaving / (count - 1)) if leaving > 0.0 else -np.inf
        result[i, i] = np.log1p(-leaving)
    return result
