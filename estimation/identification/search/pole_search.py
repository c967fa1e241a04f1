"""A search for the poles of an output-error model over all possible positions, in the frequency domain.

For a given denominator the best numerator is a small least-squares problem whose terms are sums over the periodogram.
Summed once into logarithmic bands, they take microseconds for each candidate. So the search can try thousands of pole
positions and refine the best, and every basin of the criterion gets a start.
"""

from typing import NamedTuple

import numpy as np

from estimation.arrays import Array, ComplexArray
from estimation.identification.search.banded import explained_power, refine_banded
from estimation.identification.search.criterion import Structure, polynomial

BANDS = 400
"""Frequency bands that the periodogram is summed into."""

BEAM = 5
"""Models of each order kept for building the next."""

REFINED = 16
"""Candidates of each order that are refined before they are ranked again."""

STARTS = 24
"""Candidates of the wanted order that are refined and handed on."""

REFINEMENTS = 25
"""Evaluations of the banded criterion a candidate."""

DAMPING_RATIOS = (0.01, 0.03, 0.1, 0.25, 0.5, 0.8)
"""Damping ratios of the complex pairs that are tried."""

DISTINCT_SHARE = 0.2
"""Two candidates are one start if every pole moves by less than this share of its distance to z = 1."""

SAME_COST = 1e-6
"""Refined candidates whose costs agree to this share have reached the same minimum."""


class BandedSpectra(NamedTuple):
    """Periodograms summed into bands.

    Parameters
    ----------
    omega : ndarray, shape (k,)
        Mean frequency of each band [rad/sample].
    power : ndarray, shape (k,)
        Input power, positive [input unit squared].
    cross : ndarray of complex, shape (k,)
        Output times conjugate input [output unit times input unit].
    """

    omega: Array
    power: Array
    cross: ComplexArray


def banded_spectra(pairs: list[tuple[Array, Array]]) -> BandedSpectra:
    """Return the spectra of one or more experiments in common logarithmic bands.

    Parameters
    ----------
    pairs : list of pairs of ndarray, shape (n,)
        Input and output of each experiment, no gaps.

    Returns
    -------
    BandedSpectra
        Bands without input power are left out.
    """
    longest = max(u.size for u, _ in pairs)
    lowest = 2.0 * np.pi / longest
    totals = np.zeros((5, BANDS + 1))
    for u, y in pairs:
        spectrum_u, spectrum_y = np.fft.rfft(u), np.fft.rfft(y)
        omega = 2.0 * np.pi / u.size * np.arange(spectrum_u.size)
        band = np.zeros(omega.size, dtype=np.intp)
        band[1:] = 1 + np.floor((BANDS - 1) * np.log(omega[1:] / lowest) / np.log(np.pi / lowest) + 1e-9)
        # one side of a two-sided sum: zero frequency counts half
        share = np.where(np.arange(omega.size) == 0, 0.5, 1.0)
        cross = share * spectrum_y * np.conj(spectrum_u)
        power = share * np.abs(spectrum_u) ** 2
        for row, values in enumerate((share, share * omega, power, cross.real, cross.imag)):
            totals[row] += np.bincount(band, values, minlength=BANDS + 1)[: BANDS + 1]
    count, omega, power = totals[:3]
    kept = power > 1e-14 * power.max()
    return BandedSpectra(omega[kept] / count[kept], power[kept], totals[3][kept] + 1j * totals[4][kept])


def search_poles(structure: Structure, spectra: BandedSpectra, n_samples: int) -> tuple[Array, Array]:
    """Return starts from a search over pole positions, distinct from each other, best first.

    Orders are built up: a real pole is added to the best refined models of one order less, a pair to those of two
    less. A slow pole that a zero nearly cancels explains little power but has a basin of its own, so the
    places where a real pole is *locally* best are kept beside the globally best.

    Returns
    -------
    cost : ndarray, shape (m,)
        Banded criterion less its constant.
    theta : ndarray, shape (m, n_numerator + n_denominator)
        Numerator, and denominator behind its 1.
    """
    singles, pairs = _real_poles(n_samples), _pole_pairs(n_samples)
    best: list[Array] = [np.empty((1, 0))]
    costs, thetas = np.empty(0), np.empty((0, structure.n_numerator))
    for order in range(1, structure.n_denominator + 1):
        last = order == structure.n_denominator
        candidates, peaks = _single_candidates(structure, best[order - 1], singles, spectra)
        if order >= 2:
            candidates = np.concatenate([candidates, _multiplied(best[order - 2][:2], pairs)])
        explained, _ = _explained(structure, candidates, spectra)
        ranked = candidates[np.argsort(-explained, kind="stable")]
        chosen = _distinct(ranked, STARTS if last else REFINED)
        costs, thetas = refine(structure, np.concatenate([chosen, peaks]), spectra)
        best.append(thetas[:BEAM, structure.n_numerator :])
    return costs, thetas


def refine(structure: Structure, denominators: Array, spectra: BandedSpectra) -> tuple[Array, Array]:
    """Return banded minima reached from given denominators, each once, best first.

    Parameters
    ----------
    denominators : ndarray, shape (m, n_f)
        Behind the leading 1; stable.

    Returns
    -------
    cost : ndarray, shape (k,)
        Banded criterion less its constant.
    theta : ndarray, shape (k, n_numerator + n_f)
        Numerator, and denominator behind its 1.
    """
    _, numerators = _explained(structure, denominators, spectra)
    starts = np.concatenate([numerators, denominators], axis=1)
    costs, thetas = refine_banded(starts, structure.n_numerator, structure.delay, *spectra, REFINEMENTS)
    order = np.argsort(costs, kind="stable")
    order = order[np.isfinite(costs[order])]
    rises = np.diff(costs[order]) > SAME_COST * costs[order[1:]]
    kept = order[np.concatenate([np.ones(min(order.size, 1), dtype=bool), rises])]
    return costs[kept], thetas[kept]


def _explained(structure: Structure, denominators: Array, spectra: BandedSpectra) -> tuple[Array, Array]:
    denominators = np.ascontiguousarray(denominators)
    return explained_power(denominators, structure.n_numerator, structure.delay, *spectra)


def _single_candidates(
    structure: Structure, fewer: Array, singles: Array, spectra: BandedSpectra
) -> tuple[Array, Array]:
    """Return every extension by a real pole, and those where the explained power peaks along the pole."""
    candidates = _multiplied(fewer, singles)
    explained, _ = _explained(structure, candidates, spectra)
    table = np.pad(explained.reshape(len(fewer), len(singles)), ((0, 0), (1, 1)), constant_values=-np.inf)
    peak = (table[:, 1:-1] > table[:, :-2]) & (table[:, 1:-1] >= table[:, 2:])
    return candidates, candidates[peak.ravel()]


def _real_poles(n_samples: int) -> Array:
    """Return first-order denominators after the 1, in the order of the pole, shape (m, 1)."""
    time_constants = np.geomspace(0.4, n_samples / 3.0, 44)
    poles = np.concatenate([[-0.98, -0.9, -0.7, -0.45, -0.2, 0.02], np.exp(-1.0 / time_constants)])
    return -poles[:, None]


def _pole_pairs(n_samples: int) -> Array:
    """Return second-order denominators after the 1, shape (m, 2)."""
    frequencies = np.geomspace(8.0 * np.pi / n_samples, 0.97 * np.pi, 32)
    zeta = np.array(DAMPING_RATIOS)[:, None]
    pole = np.exp(frequencies * (-zeta + 1j * np.sqrt(1.0 - zeta**2))).ravel()
    complex_pairs = np.stack([-2.0 * np.real(pole), np.abs(pole) ** 2], axis=1)
    real = -_real_poles(n_samples)[::2, 0]
    first, second = np.triu_indices(real.size, 1)
    real_pairs = np.stack([-(real[first] + real[second]), real[first] * real[second]], axis=1)
    return np.concatenate([complex_pairs, real_pairs])


def _multiplied(kept: Array, additions: Array) -> Array:
    """Return every product of two lists of monic polynomials, each given after its leading 1."""
    left = np.concatenate([np.ones((len(kept), 1)), kept], axis=1)
    right = np.concatenate([np.ones((len(additions), 1)), additions], axis=1)
    product = np.zeros((len(kept), len(additions), left.shape[1] + right.shape[1] - 1))
    for i in range(left.shape[1]):
        for j in range(right.shape[1]):
            product[:, :, i + j] += left[:, None, i] * right[None, :, j]
    return product.reshape(-1, product.shape[2])[:, 1:]


def _distinct(ranked: Array, count: int) -> Array:
    rows = ranked[: 12 * count]
    poles, n = _sorted_poles(rows), ranked.shape[1]
    chosen: list[int] = []
    for index in np.flatnonzero((np.abs(poles) < 1.0).all(axis=1)) if n else ():
        apart = np.abs(poles[index] - poles[chosen]) > DISTINCT_SHARE * np.abs(1.0 - poles[chosen])
        if apart.any(axis=1).all():
            chosen.append(int(index))
        if len(chosen) == count:
            break
    return rows[chosen].reshape(-1, n)


def _sorted_poles(rows: Array) -> ComplexArray:
    """Return the roots of monic polynomials given behind their 1, all at once by their companion matrices."""
    n = rows.shape[1]
    companion = np.zeros((len(rows), n, n))
    companion[:, np.arange(1, n), np.arange(n - 1)] = 1.0
    companion[:, 0] = -rows
    return np.sort(np.linalg.eigvals(companion).astype(np.complex128), axis=1)


def reflected(denominators: list[Array]) -> Array:
    """Return monic denominators as rows after their 1, with unstable roots reflected into the unit circle.

    Parameters
    ----------
    denominators : list of ndarray, shape (n_f + 1,)
        Monic.

    Returns
    -------
    ndarray, shape (m, n_f)
        Stable.
    """
    rows: list[Array] = []
    for denominator in denominators:
        roots = np.roots(denominator).astype(np.complex128)
        radius = np.abs(roots)
        outside = radius >= 1.0
        shrink = np.where(outside, np.minimum(radius**-2.0, 1.0 - 1e-4), 1.0) if outside.any() else 1.0
        rows.append(polynomial(roots * shrink)[1:])
    return np.array(rows)
