"""Fractional derivatives: Caputo's, from rest, sampled by Grünwald and Letnikov, or as states by Oustaloup.

From rest (all zero before the start) the derivatives of Caputo, Riemann-Liouville and Grünwald-Letnikov are equal; the
diaphragm-motor paper uses it in equations 5 and 6 (errata M5, M6). Between order 0, a spring, and 2, a mass, lies the
damper of order 1; damping is proportional to ``sin(a pi/2)``. Sources: Podlubny, Fractional Differential Equations
(1999), chapter 7; Oustaloup, Levron, Mathieu, Nanot (2000), IEEE Trans. Circuits Syst. I 47, 25.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import convolve

from plant.arrays import Array
from plant.errors import HydrostateError


def gl_weights(order: float, count: int) -> Array:
    """Return the weights of Grünwald and Letnikov, ``w_k = w_(k-1) (1 - (a + 1)/k)`` (Podlubny, section 7.2).

    Parameters
    ----------
    order : float
        Order a [dimensionless]; negative to integrate.

    Returns
    -------
    ndarray, shape (count,)
        Weights of the newest sample, of the previous one, and so on.

    Examples
    --------
    >>> gl_weights(0.5, 4).tolist()
    [1.0, -0.5, -0.125, -0.0625]
    """
    weights = np.ones(count)
    weights[1:] = np.cumprod(1.0 - (order + 1.0) / np.arange(1, count))
    return weights


def fractional_history(weights: Array, ring: Array, newest: int) -> float:
    """Return the sum of weights 1, 2, ... on the samples before the next one; also usable in a kernel.

    With ``weights = gl_weights(a, m)``, ``ring = zeros(2 (m - 1))``, ``newest = 0`` and step h, the derivative at the
    next sample is ``h**-a * (sample + fractional_history(weights, ring, newest))``: all but the sample is known, so
    that an implicit step is linear in it. Then ``newest = fractional_push(ring, newest, sample)``. The first sample is
    subtracted from all samples.

    Parameters
    ----------
    weights : ndarray, shape (m,)
        Weights of `gl_weights` [dimensionless].
    ring : ndarray, shape (2 (m - 1),)
        Past samples from `newest` on, newest first [any unit].
    newest : int
        Index of the newest sample.

    Returns
    -------
    float
        The sum, in the samples' unit.
    """
    total = 0.0
    for k in range(weights.shape[0] - 1):
        total += weights[k + 1] * ring[newest + k]
    return total


def fractional_push(ring: Array, newest: int, sample: float) -> int:
    """Store a sample in the ring, twice, so that the last half of the ring's length is always contiguous.

    Parameters
    ----------
    ring : ndarray, shape (2 (m - 1),)
        Past samples, see `fractional_history` [any unit].
    newest : int
        Index of the newest sample so far.
    sample : float
        The new one [any unit].
    """
    length = ring.shape[0] // 2
    newest = newest - 1 if newest > 0 else length - 1
    ring[newest] = sample
    ring[newest + length] = sample
    return newest


def grunwald_letnikov(samples: Array, order: float, sample_time: float, memory: int | None = None) -> Array:
    """Return the fractional derivative of a signal that is zero before its first sample; first order in sample time.

    Source: Podlubny, equation 7.3; errata M6.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        The signal [any unit].
    order : float
        Order [dimensionless], -2 to 2; negative to integrate.
    sample_time : float
        Time between samples [s].
    memory : int, optional
        Number of samples that are weighted, the newest included; all by default.

    Returns
    -------
    ndarray, shape (n,)
        Derivative, in the signal's unit over s to the power of the order.

    Raises
    ------
    HydrostateError
        If the order or the memory is out of its range.

    Examples
    --------
    >>> grunwald_letnikov(np.arange(5.0), 1.0, 0.5).tolist()
    [0.0, 2.0, 2.0, 2.0, 2.0]
    """
    if not -2.0 <= order <= 2.0:
        raise HydrostateError(f"fractional order must be between -2 and 2, got {order:g}")
    if memory is not None and memory < 2:
        raise HydrostateError(f"memory must be 2 samples or more, got {memory}")
    n = samples.shape[0]
    weights = gl_weights(order, min(n, memory or n))
    return convolve(samples, weights)[:n] / sample_time**order


def caputo_from_rest(samples: Array, order: float, sample_time: float, memory: int | None = None) -> Array:
    """Return Caputo's derivative of a signal at rest before its first sample: that of its change since (errata M6).

    Parameters
    ----------
    samples : ndarray, shape (n,)
        The signal, in any unit.
    order : float
        Order [dimensionless], 0 to 2.
    sample_time : float
        Time between samples [s].
    memory : int, optional
        Number of samples that are weighted, the newest included; all by default.

    Returns
    -------
    ndarray, shape (n,)
        Derivative; that of a constant is zero.

    Raises
    ------
    HydrostateError
        If the order or the memory is out of its range.

    Examples
    --------
    >>> time = 1e-3 * np.arange(1001)
    >>> round(float(caputo_from_rest(7.0 + time**2, 0.5, 1e-3)[-1]), 3)  # 2/Gamma(2.5) is 1.5045
    1.504
    """
    _require_order(order)
    return grunwald_letnikov(samples - samples[0], order, sample_time, memory)


def _require_order(order: float) -> None:
    if not 0.0 <= order <= 2.0:
        raise HydrostateError(f"order of fractional damping must be between 0 and 2, got {order:g}")


@dataclass(frozen=True)
class FractionalStates:
    """A fractional derivative as a linear system, `dz/dt = A z + B w`, `D^a x = C z + D w`.

    Parameters
    ----------
    A : ndarray, shape (n, n)
        Diagonal [1/s].
    B : ndarray, shape (n,)
        Each state settles to its input [1/s].
    C : ndarray, shape (n,)
        Output, in s to the power of minus the order, plus one if the input is the velocity.
    D : float
        Feed-through, in the unit of C.
    on_velocity : bool
        Whether the input w is the velocity x' instead of x: for orders of 1 and more.
    """

    A: Array
    B: Array
    C: Array
    D: float
    on_velocity: bool

    def response(self, frequency: Array) -> NDArray[np.complex128]:
        """Return the response from x to its derivative.

        Parameters
        ----------
        frequency : ndarray, shape (m,)
            Frequencies [Hz].

        Returns
        -------
        ndarray of complex, shape (m,)
            Approximates ``(2 pi i f)**a``.
        """
        s = 2j * np.pi * frequency
        poles = -np.diag(self.A)
        filtered = self.D + (self.C * self.B / (s[:, None] + poles)).sum(axis=1)
        return filtered * (s if self.on_velocity else 1.0)


def oustaloup_states(order: float, low_hz: float, high_hz: float, count: int = 5) -> FractionalStates:
    """Return a fractional derivative as first-order states, valid between two frequencies (Oustaloup et al. 2000).

    Parameters
    ----------
    order : float
        Order a [dimensionless], 0 or more and below 2; 0 and 1 are exact and need no state.
    low_hz, high_hz : float
        The band; for an error below one percent, two decades wider on either side than the band of interest [Hz].
    count : int
        Number of states, each with one pole and one zero.

    Raises
    ------
    HydrostateError
        If the order is out of its range, or the band is empty.

    Examples
    --------
    >>> half = oustaloup_states(0.5, 1.0, 1e4)
    >>> exact = (2j * np.pi * 100.0) ** 0.5
    >>> round(float(abs(half.response(np.array([100.0]))[0] / exact - 1.0)), 4)
    0.0004
    """
    if not 0.0 <= order < 2.0:
        raise HydrostateError(f"order must be 0 or more and below 2, which is a mass, got {order:g}")
    if not (0.0 < low_hz < high_hz and count >= 1):
        raise HydrostateError(f"band must rise from above 0 Hz, got {low_hz:g} to {high_hz:g} Hz in {count} states")
    on_velocity = order >= 1.0
    a = order - 1.0 if on_velocity else order
    if a == 0.0:
        return FractionalStates(np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0, on_velocity)
    low, high = 2.0 * np.pi * low_hz, 2.0 * np.pi * high_hz
    places = np.arange(count)
    poles = low * (high / low) ** ((places + 0.5 * (1.0 + a)) / count)
    zeros = low * (high / low) ** ((places + 0.5 * (1.0 - a)) / count)
    gain = high**a
    others = np.where(np.eye(count, dtype=bool), 1.0, poles[None, :] - poles[:, None])
    residues = np.prod(zeros[None, :] - poles[:, None], axis=1) / np.prod(others, axis=1)
    return FractionalStates(-np.diag(poles), poles, gain * residues / poles, gain, on_velocity)
