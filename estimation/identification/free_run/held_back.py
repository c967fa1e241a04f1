"""Errors of free runs on held-back data: blocks between fitted outputs, and halves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.free_run.data import Channels, blocks, halves
from estimation.identification.free_run.integrating import refitted_linear
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import LinearFit, Problem
from estimation.progress import report_progress

BLOCKS = 4
"""Blocks of every log, each held back once."""

CLEAR_MARGIN = 0.15
"""Share by which a nonlinear model must reduce the held-back error of the linear one, and an error model that of its
model [fraction]."""

STUDENT_95 = (6.314, 2.920, 2.353)
"""95 % quantile of a mean of two, three and four over its standard error (Student's distribution)."""

LEAST_ERROR = 1e-300
"""Replaces a zero error of a block, so that its logarithm is finite [dimensionless]."""

COMPARISON_GAIN = 1e-6
"""Relative gain of two successive steps below which a descent ends while forms are compared: the chosen one is fitted
further."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JudgedModel:
    """A model that was judged on held-back blocks.

    Parameters
    ----------
    block_errors : tuple of float
        Root-mean-square free-run error of each block, simulated by a fit to the others, over the output's deviation;
        NaN for an empty block [dimensionless].
    """

    block_errors: tuple[float, ...]

    @property
    def held_back(self) -> float:
        """Root mean square over the blocks [dimensionless]."""
        return pooled_error(self.block_errors)


@dataclass(frozen=True, eq=False, kw_only=True)
class ComparedModel(JudgedModel):
    """A model that was judged on held-back blocks, and by a criterion that favours smaller models.

    Parameters
    ----------
    bic : float
        Information criterion of the free run [dimensionless].
    """

    bic: float


def held_back_blocks(fit: LinearFit, data: Channels) -> tuple[float, ...]:
    """Return the root-mean-square free-run error of each held-back block, simulated by a fit to the others.

    Parameters
    ----------
    fit : LinearFit
        Fit to all data, at which each other fit begins.
    data : Channels
        Scaled.

    Returns
    -------
    tuple of float
        Over the output's deviation, one per block.
    """
    problem, errors = Problem(fit.form, data), list[float]()
    report_progress("linear models")
    for masks in blocks(data, BLOCKS):
        part = refitted_linear(fit, data.without(masks), least_gain=COMPARISON_GAIN)
        errors.append(block_error(problem.jacobian(part.theta)[0] - problem.y, np.concatenate(masks) & problem.used))
    return tuple(errors)


def block_error(error: Array, mask: BoolArray) -> float:
    """Return the root mean square of an error in a held-back block; NaN for an empty block.

    Parameters
    ----------
    error : ndarray, shape (n,)
        Simulated less measured.
    mask : ndarray of bool, shape (n,)
        The held-back block.

    Returns
    -------
    float
        In the error's unit.
    """
    return float(np.sqrt(np.mean(error[mask] ** 2))) if mask.any() else float("nan")


def pooled_error(errors: Sequence[float]) -> float:
    """Return the root mean square over blocks; infinite if there are none.

    Parameters
    ----------
    errors : sequence of float
        One per block [dimensionless].

    Returns
    -------
    float
        Likewise.

    Examples
    --------
    >>> round(pooled_error([3.0, 4.0, float("nan")]) ** 2, 6)
    12.5
    """
    known = [error**2 for error in errors if not np.isnan(error)]
    return float(np.sqrt(np.mean(known))) if known else float("inf")


def surely_better(errors: Sequence[float], others: Sequence[float]) -> bool:
    """Return whether a model beats another on the same blocks by more than one standard error.

    Parameters
    ----------
    errors, others : sequence of float
        Root-mean-square errors of the model and of the other, one per block; NaN for an empty block [dimensionless].

    Returns
    -------
    bool
        With a single block, whether it is better there.

    Examples
    --------
    >>> surely_better([1.0, 1.0, 1.0], [2.0, 2.1, 1.9]), surely_better([1.0, 1.0, 1.0], [0.9, 0.9, 2.0])
    (True, False)
    """
    gains = np.square(others) - np.square(errors)
    known = gains[~np.isnan(gains)]
    scatter = float(known.std(ddof=1)) / np.sqrt(known.size) if known.size > 1 else 0.0
    return known.size > 0 and bool(known.mean() > scatter)


def is_better_beyond_chance(errors: Sequence[float], others: Sequence[float]) -> bool:
    """Return whether a model beats another on the same blocks by more than chance, by the ratio of their errors.

    Ratios weight all blocks equally, however large the output is there. Their logarithms are tested as in Student
    (1908), at 5 %.

    Parameters
    ----------
    errors, others : sequence of float
        Root-mean-square errors of the model and of the other, one per block; NaN for an empty block [dimensionless].

    Returns
    -------
    bool
        With a single block, whether it is better there.

    Examples
    --------
    >>> [is_better_beyond_chance(one, [1.0] * 4) for one in ([0.5, 0.6, 0.4, 0.5], [0.1, 0.9, 1.1, 1.0])]
    [True, False]
    """
    pairs = [(one, other) for one, other in zip(errors, others, strict=True) if not (np.isnan(one) or np.isnan(other))]
    gains = np.log(np.maximum([other for _, other in pairs], LEAST_ERROR)) - np.log(
        np.maximum([one for one, _ in pairs], LEAST_ERROR)
    )
    if gains.size < 2:
        return bool(np.all(gains > 0.0)) and gains.size > 0
    bar = STUDENT_95[min(gains.size, len(STUDENT_95) + 1) - 2] * float(gains.std(ddof=1)) / np.sqrt(gains.size)
    return bool(gains.mean() > bar)


def halves_error(fit: LinearFit, data: Channels) -> float:
    """Return the error of a free run over each half of every log by a fit to the other halves, root mean square.

    Fitted outputs on both sides of a block hide the error of a slow pole; a half has only an initial state.

    Parameters
    ----------
    fit : LinearFit
        Fit to all data, at which each other fit begins.
    data : Channels
        Scaled.

    Returns
    -------
    float
        Over the output's deviation; NaN if a half has too few outputs.
    """
    first, second = halves(data)
    if min(first.n_samples, second.n_samples) < 2 * fit.theta.size:
        return float("nan")
    squares = list[Array]()
    for part, other in ((first, second), (second, first)):
        dynamics = LinearDynamics.of(refitted_linear(fit, part, least_gain=COMPARISON_GAIN))
        squares += [(dynamics.run(u, y) - y) ** 2 for u, y in zip(other.u, other.y, strict=True)]
    return float(np.sqrt(np.nanmean(np.concatenate(squares))))
