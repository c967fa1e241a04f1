"""Tests whether an input follows the noise of the output that it drives, and returns a note."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.residual_tests import DEFAULT_LAGS, feedback_test
from estimation.identification.notes import IdentificationCode
from plant.notes import Note

FEEDBACK_PROBABILITY = 1e-6
"""Probability below which an input is held to follow the output's noise; a model's errors must not look like it."""

FEEDBACK_SAMPLES = 20_000
"""Samples that are asked for feedback, from the beginning."""


def feedback_note(residual: Array, u: Array, names: tuple[str, str]) -> Note | None:
    """Return a note if an input follows the residual of a model; None otherwise, and for short records.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Measured less simulated; NaN where missing.
    u : ndarray, shape (n,)
        Input, no gaps.
    names : tuple of str
        Of input and output.

    Returns
    -------
    Note or None
        With the probability of such a record in open loop.
    """
    part = slice(0, FEEDBACK_SAMPLES)
    if u[part].size < 8 * DEFAULT_LAGS or np.count_nonzero(np.isfinite(residual[part])) < 3 * DEFAULT_LAGS:
        return None
    found = feedback_test(residual[part], u[part])
    if not found.p_value < FEEDBACK_PROBABILITY:
        return None
    return IdentificationCode.FEEDBACK.note(input=names[0], output=names[1], p_value=found.p_value)
