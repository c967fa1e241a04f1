"""Output error of several inputs with one denominator, an offset, and a free initial state in every log."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.fit.output_error import FINAL_STEPS, descend_from, liveliest_section, screened
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.lagged_columns import columns_of
from estimation.identification.free_run.least_squares import least_squares
from estimation.identification.free_run.linear_kernel import decay_rows, record_length_pole
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem, long_dead_time
from estimation.identification.search.criterion import Structure, with_bounded_roots
from estimation.identification.search.experiments import Experiments

FIRST_STEPS = 20
"""Evaluations of each of several starts."""

MOST_SEARCHED = 100_000
"""Most samples for a global search; longer records begin at other starts only."""

COARSE = 1e-5
"""Relative gain of two successive steps below which a descent ends while models are compared: the chosen one is fitted
further."""

PASSES = 12
"""Iterations of Steiglitz and McBride."""

ADDED_POLES = (0.5, 0.9, 0.98)
"""Poles that are added, each with its zeros, to the minimum of the next lower order."""


def fit_linear(
    form: Form, data: Channels, starts: Sequence[Array] = (), *, bounded: bool = False, least_gain: float = 0.0
) -> LinearFit:
    """Return the best linear model of one form: the leader of the three best starts after a few steps is refined.

    Parameters
    ----------
    data : Channels
        Scaled.
    starts : sequence of ndarray, shape (n + 1,)
        Denominators at which to begin; if none are given, they are searched.
    bounded : bool
        Whether every time constant must be shorter than the record.
    least_gain : float
        As `levenberg` takes it [dimensionless].
    """
    problem = Problem(form, data)
    tried = list(starts) or [*steiglitz_mcbride(problem), *_searched_denominators(problem)]
    radius = record_length_pole(data.informative_samples) ** 1.5 if bounded else 1.0 - 0.3 / data.longest
    ranked = sorted(
        (problem.profiled(with_bounded_roots(f, data.longest, radius)) for f in tried), key=lambda one: one[0]
    )
    kept: list[tuple[float, Array]] = []
    for cost, theta in ranked:
        if len(kept) < 3 and all(cost - other > 1e-7 * cost for other, _ in kept):
            kept.append((cost, theta))
    theta = kept[0][1]
    if len(kept) > 1:
        begun = (problem.descend(x, bounded=bounded, least_gain=least_gain, most_steps=FIRST_STEPS) for _, x in kept)
        theta = min(begun, key=lambda fit: fit.cost).theta
    return problem.descend(theta, bounded=bounded, least_gain=least_gain)


def extended_denominators(fit: LinearFit) -> list[Array]:
    """Return denominators with one order more at the same minimum: a real pole is added, which zeros can cancel."""
    return [np.convolve(fit.f, [1.0, -pole]) for pole in ADDED_POLES]


def steiglitz_mcbride(problem: Problem) -> list[Array]:
    """Return denominators of the iteration of Steiglitz and McBride (1965), started from ARX; gaps end a run of rows.

    Parameters
    ----------
    problem : Problem
        Form and data.

    Returns
    -------
    list of ndarray, shape (n + 1,)
        The first, one from the middle, and the last.
    """
    form, n, n_samples = problem.form, problem.form.order, problem.data.longest
    f, found = np.concatenate([[1.0], np.zeros(n)]), list[Array]()
    for _ in range(PASSES):
        rows, wanted = list[Array](), list[Array]()
        for y, u in zip(problem.data.y, problem.data.u, strict=True):
            columns = columns_of(form, u)
            known = np.isfinite(y)
            whole = np.where(known, y, np.interp(np.arange(y.size), np.flatnonzero(known), y[known]))
            series = np.vstack([columns.T, np.ones(y.size), whole])
            decay_rows(f, series, np.zeros(series.shape[0]))
            out = series[-1]
            past = np.column_stack([np.concatenate([np.zeros(k), out[:-k]]) for k in range(1, n + 1)])
            near = np.convolve(~known, np.ones(n + 1))[: y.size] == 0.0
            near[: min(n + max(form.delays), y.size - 1)] = False
            rows.append(np.column_stack([series[:-1].T, -past])[near])
            wanted.append(out[near])
        values = least_squares(np.concatenate(rows), np.concatenate(wanted))[0]
        new = with_bounded_roots(np.concatenate([[1.0], values[form.n_b + 1 :]]), n_samples, 1.0 - 0.3 / n_samples)
        found.append(new)
        if np.abs(new - f).max() < 1e-6:
            break
        f = new
    return [found[0], found[len(found) // 2], found[-1]]


def _searched_denominators(problem: Problem) -> list[Array]:
    """Return the denominator of the search for the global minimum, of one input without its mean."""
    form, data = problem.form, problem.data
    if len(form.sizes) > 1 or data.longest * len(data.y) > MOST_SEARCHED:
        return []
    found: list[Array] = []
    # a log whose outputs are all left out has no information
    parts = [slice(*ends) for ends in pairwise(problem.bounds.tolist()) if problem.used[slice(*ends)].any()]
    bounds = np.cumsum([0, *(part.stop - part.start for part in parts)])
    used: BoolArray = np.concatenate([problem.used[part] for part in parts])
    inputs, y = np.concatenate(data.u), np.concatenate([problem.y[part] for part in parts])
    for index, (size, delay) in enumerate(zip(form.sizes, form.delays, strict=True)):
        u = np.concatenate([inputs[part, index] for part in parts])
        pair = Experiments(u, np.where(used, y, 0.0), used, bounds)
        structure = Structure(size, form.order, delay)
        if delay > long_dead_time(data.longest) and pair.has_outputs_after(delay + form.order):
            pair, structure = pair.advanced(delay), Structure(size, form.order)
        # the result is only a start, so only the best candidate after a few steps is continued
        begun = screened(structure, pair)[0][1]
        # the initial state of a section is not the record's
        begun = begun if liveliest_section(pair) is pair else begun[: structure.n_main]
        theta = descend_from(structure, begun, pair, FINAL_STEPS)[1]
        found.append(np.concatenate([[1.0], theta[size : size + form.order]]))
    return found


def quick_fit(form: Form, data: Channels) -> float:
    """Return the cost of the best denominator in the iteration of Steiglitz and McBride, without a descent."""
    problem = Problem(form, data)
    return min(problem.profiled(f)[0] for f in steiglitz_mcbride(problem))
