"""Tests whether an output moves against its input within one sample, as behind a controller, and returns a note."""

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.identification.fit.feedback import FEEDBACK_PROBABILITY, FEEDBACK_SAMPLES
from estimation.identification.fit.residual_tests import DEFAULT_LAGS
from estimation.identification.model.lags import lagged
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.notes import IdentificationCode
from estimation.trust.chi_square import chi_square_tail
from plant.notes import Note

SURE_SIGN = 3.0
"""Standard deviations by which a gain is away from zero for its sign to count [dimensionless]."""

NOT_ALIKE = 1e-10
"""Share of a signal's variance that the past leaves, below which it is rounding, or the past was cut off there."""

UNTOLD = (float("nan"), float("nan"))
"""What is returned where the samples do not tell the coefficient."""


def answer_at_once(u: ArrayLike, y: ArrayLike, *, n_lags: int = DEFAULT_LAGS) -> tuple[float, float]:
    """Return by how much the unforeseen part of an output moves with that of the input in the same sample.

    Both are what the past of input and output does not foretell (Granger 1969). Of the deviation for equal noise and
    the one for any noise (White 1980) the larger counts.

    Parameters
    ----------
    u : array_like, shape (n,)
        Input, no gaps.
    y : array_like, shape (n,)
        Output, NaN where missing: only samples behind a full past count.
    n_lags : int
        Earlier samples that are the past.

    Returns
    -------
    tuple of float
        Coefficient and its standard deviation [output unit / input unit]; NaN if the samples do not tell it.
    """
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    past = np.column_stack([lagged(inputs, 1, n_lags), lagged(outputs, 1, n_lags)])
    known = np.isfinite(past).all(axis=1) & np.isfinite(outputs)
    known[:n_lags] = False
    freedom = int(np.count_nonzero(known)) - past.shape[1] - 2
    if freedom < past.shape[1]:
        return UNTOLD
    past, moved, answer = (one[known] - one[known].mean(axis=0) for one in (past, inputs, outputs))
    size = np.linalg.norm(past, axis=0)
    basis, strength, _ = np.linalg.svd(past / np.where(size > 0.0, size, 1.0), full_matrices=False)
    basis = basis[:, strength > NOT_ALIKE**0.5 * strength[0]]
    wholes = [float(one @ one) for one in (moved, answer)]
    moved, answer = (one - basis @ (basis.T @ one) for one in (moved, answer))
    if not all(float(one @ one) > NOT_ALIKE * whole for one, whole in zip((moved, answer), wholes, strict=True)):
        return UNTOLD
    power = float(moved @ moved)
    slope = float(moved @ answer) / power
    left = answer - slope * moved
    spread = max(power * float(left @ left), left.size * float(np.sum((moved * left) ** 2)))
    return slope, (spread / freedom) ** 0.5 / power


def at_once_note(model: LinearModel, u: Array, y: Array) -> Note | None:
    """Return a note if an output moves against its model's gain in the very sample of the input; None otherwise.

    A sampled plant answers later, and in the direction of its gain. A controller that computes the input from the
    output of the same row does neither: with negative feedback, noise that raises the output lowers the input at once.
    Only a gain larger than this answer counts: an acceleration answers a force at once, and its gain is nearly zero.

    Parameters
    ----------
    model : LinearModel
        From the input to the output.
    u : ndarray, shape (n,)
        Input, no gaps.
    y : ndarray, shape (n,)
        Output; NaN where missing.

    Returns
    -------
    Note or None
        With the probability of such a record in open loop.
    """
    part, n_b = slice(0, FEEDBACK_SAMPLES), model.free_numerator.size
    total, spread = float(model.free_numerator.sum()), float(model.covariance[:n_b, :n_b].sum())
    with np.errstate(divide="ignore", invalid="ignore"):  # a pole at 1 exactly
        gain, uncertainty = abs(model.dc_gain), model.dc_gain_std
    # where parts cancel only the gain has a sure sign, and where an output integrates only the numerator
    sure = abs(total) > SURE_SIGN * spread**0.5 or gain > SURE_SIGN * uncertainty
    if u[part].size < 8 * DEFAULT_LAGS or not sure:
        return None
    slope, deviation = answer_at_once(u[part], y[part])
    if not 0.0 < -np.sign(total) * slope < gain:
        return None
    probability = 0.5 * (chi_square_tail((slope / deviation) ** 2, 1) if deviation > 0.0 else 0.0)
    if not probability < FEEDBACK_PROBABILITY:
        return None
    told = {"input": model.input_name, "output": model.output_name, "p_value": probability}
    return IdentificationCode.FEEDBACK_AT_ONCE.note(**told)
