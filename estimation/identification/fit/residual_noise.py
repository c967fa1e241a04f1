"""Autocovariance of the noise behind a fit's residual: without what the fit has absorbed, and with slow noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, BoolArray

MOST_COEFFICIENTS = 12
"""Most coefficients of the autoregression that whitens a residual [count]."""

CORRECTIONS = 6
"""Passes in which the autocovariance gets back what the fit has absorbed of it [count]."""

FEWEST_PAIRS = 0.02
"""Least share of pairs of samples for an autocovariance to count [fraction]."""

LARGEST_REFLECTION = 0.9995
"""Largest reflection coefficient of a stable autoregression [dimensionless]."""


@dataclass(frozen=True, eq=False)
class NoiseSpectrum:
    """A residual's spectral density: that of an autoregression, times one of what it leaves.

    Parameters
    ----------
    coefficients : ndarray, shape (p + 1,)
        Of the autoregression, monic.
    whitened : ndarray, shape (k,)
        Autocovariance of what it leaves, from lag zero on, under a window.
    variance : float
        Of the residual, which the density adds up to [residual's unit squared].
    """

    coefficients: Array
    whitened: Array
    variance: float

    def on_grid(self, size: int) -> Array:
        """Return the density at the frequencies of a real transform of so many samples.

        Parameters
        ----------
        size : int
            Samples, at least twice the lags.

        Returns
        -------
        ndarray, shape (size // 2 + 1,)
            Not negative.
        """
        two_sided = np.zeros(size)
        two_sided[: self.whitened.size] = self.whitened
        two_sided[size - self.whitened.size + 1 :] = self.whitened[:0:-1]
        left = np.maximum(np.fft.rfft(two_sided).real, 0.0)
        density = left / np.abs(np.fft.rfft(self.coefficients, size)) ** 2
        # narrow lines widen under a window, and an autoregression does not narrow them again
        mean = float(np.fft.irfft(density, size)[0])
        return np.asarray(density * (self.variance / mean if mean > 0.0 else 1.0), dtype=np.float64)


def transform_size(samples: int) -> int:
    """Return the length of a transform in which a row of so many samples does not meet itself."""
    return 1 << int(np.ceil(np.log2(2 * samples)))


def noise_spectrum(rows: Sequence[tuple[Array, Array, BoolArray]]) -> NoiseSpectrum:
    """Return the spectral density of the noise behind residuals of one sensor.

    The autocovariance is that of pairs of samples that are there, and of all rows together: a short row tells little of
    slow noise. A fit absorbs part of the noise, of slow noise most: what an autocovariance loses by it is computed, and
    given back, in some passes. Slow noise needs more lags than a window has, so an autoregression whitens it before
    (Andrews and Monahan 1992).

    Parameters
    ----------
    rows : sequence of tuple of ndarray, shapes (n,), (n, p) and (n,)
        Residual, orthonormal columns of the fit over all rows together, and which samples are there; both others are
        zero elsewhere.
    """
    used = sum(int(np.count_nonzero(there)) for _, _, there in rows)
    longest = max(residual.size for residual, _, _ in rows)
    lags = max(1, min(used // 10, int(4.0 * used**0.5), longest - 1))
    reach = min(lags + MOST_COEFFICIENTS, longest - 1)
    pairs, raw = np.zeros(reach + 1), np.zeros(reach + 1)
    for residual, _, there in rows:
        pairs += _lagged_products(there.astype(np.float64)[:, None], there.astype(np.float64)[:, None], reach)
        raw += _lagged_products(residual[:, None], residual[:, None], reach)
    known = pairs > FEWEST_PAIRS * used
    divisor = np.maximum(pairs, 1.0)
    found = _spectrum(np.where(known, raw / divisor, 0.0), lags, used, known)
    for _ in range(CORRECTIONS):
        whole = raw + _absorbed(rows, found, reach)
        found = _spectrum(np.where(known, whole / divisor, 0.0), lags, used, known)
    return found


def noise_seen(found: NoiseSpectrum, columns: Array) -> Array:
    """Return ``J'RJ`` of one row of samples.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        J, zero where a sample is missing.

    Returns
    -------
    ndarray, shape (p, p)
        Not negative.
    """
    size = transform_size(max(len(columns), found.whitened.size))
    density = found.on_grid(size)
    density[1 : (size + 1) // 2] *= 2.0
    moved = np.fft.rfft(columns.T, size)
    return np.asarray(np.real((moved * density) @ np.conj(moved.T)) / size, dtype=np.float64)


def _spectrum(covariance: Array, lags: int, used: int, known: BoolArray) -> NoiseSpectrum:
    """Return the density of an autocovariance: an autoregression, and a window over what it leaves."""
    most = min(MOST_COEFFICIENTS, covariance.size - 1, used // 20)
    if not known[: most + 1].all():
        most = int(np.argmin(known[: most + 1])) - 1
    a = _autoregression(covariance, max(most, 0), used)
    both = np.convolve(a, a[::-1])  # the autocovariance of what an autoregression leaves
    reach = a.size - 1
    lags = min(lags, covariance.size - 1 - reach)
    two_sided = np.concatenate([covariance[:0:-1], covariance])
    left = np.convolve(two_sided, both, mode="same")[covariance.size - 1 :][: lags + 1]
    share = np.arange(lags + 1) / (lags + 1.0)
    window = np.where(share <= 0.5, 1.0 - 6.0 * share**2 + 6.0 * share**3, 2.0 * (1.0 - share) ** 3)
    return NoiseSpectrum(a, left * window, float(covariance[0]))


def _autoregression(covariance: Array, most: int, used: int) -> Array:
    """Return the autoregression of least AIC by Levinson's recursion, stable."""
    a, power = np.ones(1), float(covariance[0])
    best, least = a, used * float(np.log(max(power, 1e-300)))
    for order in range(1, most + 1):
        reflection = -float(a @ covariance[order:0:-1]) / power if power > 0.0 else 0.0
        if not abs(reflection) < LARGEST_REFLECTION:
            break
        a = np.concatenate([a, [0.0]]) + reflection * np.concatenate([[0.0], a[::-1]])
        power *= 1.0 - reflection**2
        price = used * float(np.log(max(power, 1e-300))) + 2.0 * order
        if price < least:
            best, least = a, price
    return best


def _absorbed(rows: Sequence[tuple[Array, Array, BoolArray]], found: NoiseSpectrum, reach: int) -> Array:
    """Return what sums of lagged products of a residual lack of those of its noise: of ``R - MRM``, M = I - QQ'."""
    seen = [_times_noise(found, columns, there) for _, columns, there in rows]
    within = sum(columns.T @ one for (_, columns, _), one in zip(rows, seen, strict=True))
    lost = np.zeros(reach + 1)
    for (_, columns, _), one in zip(rows, seen, strict=True):
        either = one - 0.5 * columns @ within
        lost += _lagged_products(columns, either, reach) + _lagged_products(either, columns, reach)
    return lost


def _times_noise(found: NoiseSpectrum, columns: Array, there: BoolArray) -> Array:
    """Return ``RQ`` where samples are there, zero elsewhere."""
    size = transform_size(max(len(columns), found.whitened.size))
    moved = np.fft.rfft(columns.T, size) * found.on_grid(size)
    return np.where(there[:, None], np.fft.irfft(moved, size).T[: len(columns)], 0.0)


def _lagged_products(first: Array, second: Array, reach: int) -> Array:
    """Return the sums over columns of ``first[t] second[t + k]`` for k from zero on, shape (reach + 1,)."""
    size = transform_size(len(first))
    both = np.sum(np.conj(np.fft.rfft(first.T, size)) * np.fft.rfft(second.T, size), axis=0)
    sums = np.fft.irfft(both, size)[: reach + 1]
    return np.asarray(np.pad(sums, (0, reach + 1 - sums.size)), dtype=np.float64)
