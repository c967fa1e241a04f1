"""The exact discrete model of a continuous one whose input is held between samples."""

import numpy as np

from estimation.arrays import Array


def held_input_model(
    numerator: Array, denominator: Array, dead_time: float, sample_time: float
) -> tuple[Array, Array, int]:
    """Return the exact discrete model of a continuous one whose input is held between samples.

    Parameters
    ----------
    numerator : ndarray, shape (m + 1,)
        Descending powers of s, m no more than the denominator's degree.
    denominator : ndarray, shape (n,)
        Descending powers of s behind the leading 1.
    dead_time : float
        Delay of the input [s].
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    numerator : ndarray
        In ``q^0, q^-1, ...``, whole samples of delay as leading zeros.
    denominator : ndarray, shape (n + 1,)
        Monic.
    delay : int
        The leading zeros.

    Examples
    --------
    >>> b, f, delay = held_input_model(np.array([1.0]), np.array([1.0]), 0.0, np.log(2.0))
    >>> b.round(9).tolist(), f.round(9).tolist(), delay
    ([0.0, 0.5], [1.0, -0.5], 1)
    """
    n = denominator.size
    padded = np.concatenate([np.zeros(n + 1 - numerator.size), numerator])
    through = padded[0]
    A = np.zeros((n, n))
    A[0] = -denominator
    A[1:, :-1] = np.eye(n - 1)
    B = np.eye(n)[:, :1]
    C = padded[1:] - through * denominator
    whole = int(np.floor(dead_time / sample_time + 1e-9))
    part = max(dead_time - whole * sample_time, 0.0)
    late, new_gain = _held_transition(A, B, sample_time - part)
    early_gain = _held_transition(A, B, part)[1]
    whole_step = _held_transition(A, B, sample_time)[0]
    f = np.asarray(np.real(np.poly(whole_step)), dtype=np.float64)
    b = np.zeros(n + 2)
    b[: n + 1] += np.real(np.poly(whole_step - new_gain @ C[None, :])) - f
    if part > 0.0:
        old = late @ early_gain
        b[1:] += np.real(np.poly(whole_step - old @ C[None, :])) - f
        b[1:] += through * f
    else:
        b[: n + 1] += through * f
        b = b[: n + 1]
    leading = 0 if through != 0.0 and part == 0.0 else 1
    b[:leading] = 0.0
    return np.concatenate([np.zeros(whole), b]), f, whole + leading


def _held_transition(A: Array, B: Array, duration: float) -> tuple[Array, Array]:
    from scipy.linalg import expm  # importing it takes longer than fitting a discrete model

    n = A.shape[0]
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n:] = A * duration, B * duration
    moved = expm(block)
    return moved[:n, :n], moved[:n, n:]
