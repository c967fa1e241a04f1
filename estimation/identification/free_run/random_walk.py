"""Outputs with a random walk: linear models fitted to changes from sample to sample.

Accumulated noise, such as the drift of a sensor, does not average out in a free run: the fit follows it with slow
poles, and its gain is arbitrary. Changes from sample to sample obey the same transfer function, and those of a random
walk are white (Box and Jenkins 1970). Whether there is a walk is decided by the residual of such a fit: its sum does
not return to its trend (Dickey and Fuller 1979), and its changes have no memory beyond one sample. The residual of a
plant's nonlinearity or a missing pole returns, or is smooth. White sensor noise beside the walk adds to neighbouring
changes with opposite signs, so these may be negatively correlated.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.fit.residual_tests import DEFAULT_LAGS
from estimation.identification.fit.validate import estimate_initial_state
from estimation.identification.free_run.believable import believable_candidate
from estimation.identification.free_run.candidate_rows import linear_row
from estimation.identification.free_run.choose_linear import Candidate, linear_candidates
from estimation.identification.free_run.data import Channels, Scaling, blocks, in_scale, scaled
from estimation.identification.free_run.dead_times import ORDER, estimate_delays
from estimation.identification.free_run.held_back import BLOCKS, block_error, pooled_error
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.integrating import refitted_linear
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_fit import COARSE, fit_linear
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.transfer_function import linear_model
from estimation.identification.notes import IdentificationCode
from estimation.stretches import stretches
from estimation.trust.chi_square import chi_square_tail
from plant.notes import Note

FEWEST = 200
"""Least number of consecutive outputs to distinguish a walk from slow noise; the statistic of white noise is -7
there."""

LARGEST_WALK_STATISTIC = -3.96
"""Statistic of Dickey and Fuller, with a trend, below which a walk falls in 1 % of all long records (their table)."""

LAGS_SHARE = 50
"""Inverse of the largest number of changes in the test over the number of samples, so that white noise has a statistic
of about -7, the root of this number; and at most as many as Schwert (1989) uses for noise beside a walk."""

MEMORY_SIGNIFICANCE = 1e-3
"""Significance level at which changes have memory beyond one sample: a walk is missed as often."""

SMOOTH_CORRELATION = 3.0
"""Correlation of neighbouring changes from which they are smooth, not white [standard errors]: the same significance
level."""

LARGEST_MEMORY_SHARE = 0.1
"""Share of the power of changes that earlier ones than the previous explain beyond chance, from which no more poles
than `ORDER` are tested for a walk: missing poles leave less, and nonlinearities more (0.2 to 4; judged)."""

LEAST_WALK_ERROR = 0.15
"""Least root mean square of the walk on held-back blocks, over the output's deviation: a nonlinearity leaves up to 0.12
behind a linear model that looks like a walk with white noise (five of 99 logs without one), and a smaller walk changes
a gain by little."""


@dataclass(frozen=True, eq=False)
class WalkModel:
    """A linear model fitted to changes, applied to the levels of its data.

    Parameters
    ----------
    fit : LinearFit
        Scaled as the levels are; offset and initial states by least squares of the levels.
    changes, by : Channels, Scaling
        The fitted changes, scaled, and the scaling.
    of_changes : LinearFit
        The fit in their scale.
    held_back : float
        Free-run error on blocks held back, over the output's deviation [dimensionless].
    candidates : tuple of Candidate
        Models that were compared, on changes.
    """

    fit: LinearFit
    changes: Channels
    by: Scaling
    of_changes: LinearFit
    held_back: float
    candidates: tuple[Candidate, ...]


def walk_model(
    data: Channels, part: Channels, orders: Sequence[int], delays: tuple[int, ...] | None, sizes: int | None
) -> WalkModel | None:
    """Return the linear model of changes of an output with a random walk; None if it has none.

    Parameters
    ----------
    data, part : Channels
        Levels, scaled: all, and those on which models are compared.
    orders : sequence of int
        As in `linear_candidates`.
    delays : tuple of int or None
        Dead time of each input [samples]; None estimates it.
    sizes : int, optional
        Numerator coefficients of each input.
    """
    changes = changes_of(part)
    known = [np.count_nonzero(np.isfinite(y)) for y in changes.y]
    if sum(known) < FEWEST or not all(known):
        return None
    changed, by = scaled(changes)
    if not all(np.isfinite(y).any() for y in changed.y):  # the output always changes by the same amount
        return None
    # a random walk may spoil the estimate of the dead time, so zero is tried too
    late = {estimate_delays(changed), (0,) * len(data.inputs)} if delays is None else {delays}
    firsts = [fit_linear(Form(ORDER, (ORDER + 1,) * len(one), one), changed, least_gain=COARSE) for one in late]
    first = min(firsts, key=lambda fit: fit.cost)
    rest = longest_residual(first, changed)
    if (
        rest.size < FEWEST
        or dickey_fuller_statistic(rest) <= LARGEST_WALK_STATISTIC
        or _explained_share(rest) > LARGEST_MEMORY_SHARE
    ):
        return None
    candidates = linear_candidates(changed, orders, delays, sizes)
    best, _ = believable_candidate(candidates, changed, by)
    settles = not (best.doubt or best.fit.integrates or best.outlasts_block(changed))
    if not settles or not best.held_back < 1.0 or not is_random_walk(best.fit, changed):
        return None
    whole = in_scale(changes_of(data), by)
    found = refitted_linear(best.fit, whole)
    errors = [_held_back_error(best.fit, part, masks, by) for masks in blocks(part, BLOCKS)]
    left = pooled_error(errors)
    if not left > LEAST_WALK_ERROR:
        return None
    return WalkModel(fit_of_levels(found, data, by), whole, by, found, left, tuple(candidates))


def identified_walk(walk: WalkModel, data: Channels, by: Scaling) -> Identified:
    """Return the model of an output with a random walk, with the covariance of the changes.

    Parameters
    ----------
    data : Channels
        Levels, in units of the channels.
    by : Scaling
        Of the levels.
    """
    dynamics = LinearDynamics.of(walk.fit)
    model = FreeRunModel(data.inputs, data.output, data.sample_time, "output-error", by, dynamics)
    quality = model.quality(data.u, data.y)
    if len(data.inputs) == 1:
        units = Scaling(walk.by.u_mean, by.u_std * walk.by.u_std, walk.by.y_mean, by.y_std * walk.by.y_std)
        linear = linear_model(walk.of_changes, walk.changes, units)
        simulated = model.simulate(data.u[0], data.y[0])
        linear = replace(linear, offset=model.offset, fit_percent=quality.fit_percent, rmse=quality.rmse)
        linear = replace(linear, initial_state=estimate_initial_state(linear, data.u[0][:, 0], simulated))
        model = replace(model, linear=linear)
    note = IdentificationCode.RANDOM_WALK.note(output=data.output, rmse=quality.rmse)
    rows = tuple(map(linear_row, walk.candidates))
    return Identified(model, quality, 100.0 * (1.0 - walk.held_back), rows, (note,), sound=True)


def walk_followed_notes(data: Channels, part: Channels, orders: Sequence[int], structure: str) -> list[Note]:
    """Return a note if an output has a random walk and a structure fitted to levels was requested.

    Parameters
    ----------
    data, part : Channels
        As in `walk_model`.
    orders : sequence of int
        Likewise.
    structure : str
        The requested structure.
    """
    return [] if walk_model(data, part, orders, None, None) is None else [walk_followed_note(data.output, structure)]


def walk_followed_note(output: str, structure: str) -> Note:
    """Return the note on a structure fitted to levels of an output with a random walk."""
    return IdentificationCode.WALK_FOLLOWED.note(output=output, structure=structure)


def changes_of(data: Channels) -> Channels:
    """Return the change of each channel from the sample before; that of the first input sample is zero.

    Parameters
    ----------
    data : Channels
        Levels.
    """
    return replace(
        data,
        u=tuple(np.diff(u, axis=0, prepend=u[:1]) for u in data.u),
        y=tuple(np.diff(y, prepend=np.nan) for y in data.y),
    )


def is_random_walk(fit: LinearFit, changes: Channels) -> bool:
    """Return whether the residual of changes is white beyond one sample, and its sum does not return.

    Parameters
    ----------
    fit : LinearFit
        Of these changes.
    changes : Channels
        Scaled.
    """
    left = longest_residual(fit, changes)
    return left.size >= FEWEST and dickey_fuller_statistic(left) > LARGEST_WALK_STATISTIC and not has_long_memory(left)


def dickey_fuller_statistic(changes: Array) -> float:
    """Return the statistic of Dickey and Fuller of the sum of changes: how surely it returns to its trend.

    Parameters
    ----------
    changes : ndarray, shape (n,)
        Without gaps.

    Returns
    -------
    float
        Negative if it returns [standard errors].

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal(1000)
    >>> [dickey_fuller_statistic(one) > LARGEST_WALK_STATISTIC for one in (noise, np.diff(noise))]
    [True, False]
    """
    n = changes.size
    lags = min(int(12.0 * (n / 100.0) ** 0.25), n // LAGS_SHARE)
    level = np.cumsum(changes) - changes
    past = [changes[lags - k : n - k] for k in range(1, lags + 1)]
    columns = np.column_stack([level[lags:], np.ones(n - lags), np.arange(n - lags) / n, *past])
    values, *_ = np.linalg.lstsq(columns, changes[lags:], rcond=None)
    left = changes[lags:] - columns @ values
    variance = float(left @ left) / (left.size - columns.shape[1])
    spread = float(np.linalg.pinv(columns.T @ columns)[0, 0]) * variance
    return float(values[0]) / float(np.sqrt(spread)) if spread > 0.0 else -np.inf


def has_long_memory(changes: Array) -> bool:
    """Return whether changes depend on earlier ones otherwise than white noise beside a walk makes them.

    Neighbours may be negatively correlated, not positively; larger lags are tested as in Box and Pierce (1970).

    Parameters
    ----------
    changes : ndarray, shape (n,)
        Without gaps.

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal(1000)
    >>> has_long_memory(noise), has_long_memory(np.diff(noise)), has_long_memory(noise[2:] + noise[1:-1] + noise[:-2])
    (False, False, True)
    """
    found = _correlations(changes)
    if found[0] > SMOOTH_CORRELATION / np.sqrt(changes.size):
        return True
    statistic = float(np.sum(found[1:] ** 2)) / _chance_variance(found, changes)
    return chi_square_tail(statistic, DEFAULT_LAGS - 1) < MEMORY_SIGNIFICANCE


def fit_of_levels(fit: LinearFit, data: Channels, by: Scaling) -> LinearFit:
    """Return a fit of changes as one of levels, with offset and initial states by least squares.

    Parameters
    ----------
    data : Channels
        Levels, scaled.
    by : Scaling
        Scaling of the changes.
    """
    form = fit.form
    b = [one * by.y_std / std for one, std in zip(fit.numerators, by.u_std, strict=True)]
    problem = Problem(form, data)
    columns, used = problem.linear_columns(fit.f), problem.used
    driven = columns[:, : form.n_b] @ np.concatenate(b)
    free = columns[:, form.n_b :]
    values: Array = np.linalg.lstsq(free[used], (problem.y - driven)[used], rcond=None)[0].astype(np.float64)
    left = (problem.y - driven - free @ values)[used]
    return LinearFit(form, np.concatenate([*b, fit.f[1:], values]), problem.share * float(left @ left))


def _correlations(changes: Array) -> Array:
    """Return the autocorrelation of changes at one sample, two, and so on [dimensionless]."""
    centred = changes - changes.mean()
    power = max(float(centred @ centred), 1e-300)
    return np.array([centred[k:] @ centred[:-k] for k in range(1, DEFAULT_LAGS + 1)]) / power


def _chance_variance(correlations: Array, changes: Array) -> float:
    """Return the variance of autocorrelations at lags without correlation, for changes with memory of one sample."""
    # Bartlett (1946), for a moving average of one term
    return (1.0 + 2.0 * float(correlations[0]) ** 2) / changes.size


def _explained_share(changes: Array) -> float:
    """Return the share of the power of changes that those two samples ago or more explain, beyond chance."""
    found = _correlations(changes)
    return float(np.sum(found[1:] ** 2 - _chance_variance(found, changes)))


def longest_residual(fit: LinearFit, changes: Channels) -> Array:
    """Return the residual of a model over the longest row of outputs without gaps.

    Parameters
    ----------
    fit : LinearFit
        The model.
    changes : Channels
        Changes, or levels; scaled as for the model.

    Returns
    -------
    ndarray, shape (n,)
        Measured less simulated [dimensionless].
    """
    problem = Problem(fit.form, changes)
    left = np.where(problem.used, problem.y - problem.jacobian(fit.theta)[0], np.nan)
    return longest_gap_free_row(np.split(left, problem.bounds[1:-1]))


def longest_gap_free_row(parts: Sequence[Array]) -> Array:
    """Return the longest row without gaps; empty if there is none.

    Parameters
    ----------
    parts : sequence of ndarray, shape (n,)
        NaN where missing.

    Returns
    -------
    ndarray, shape (n,)
        In their unit.
    """
    rows = [part[begin:end] for part in parts for begin, end in zip(*stretches(np.isfinite(part)), strict=True)]
    return max(rows, key=lambda row: row.size, default=np.zeros(0))


def _held_back_error(fit: LinearFit, part: Channels, masks: Sequence[BoolArray], by: Scaling) -> float:
    """Return the free-run error on a block of levels by a fit to changes outside it."""
    outside = part.without(masks)
    found = fit_of_levels(refitted_linear(fit, in_scale(changes_of(outside), by), least_gain=COARSE), outside, by)
    problem = Problem(found.form, part)
    return block_error(problem.jacobian(found.theta)[0] - problem.y, np.concatenate(masks) & problem.used)
