"""A coarse search for the poles of an output-error model over their possible places, in the frequency domain.

For a given denominator the best numerator is a small least-squares problem whose terms are sums over the
periodogram. Summed once into logarithmic bands, they cost microseconds a candidate, so a few hundred pole
positions can be tried and every basin of the criterion gets a start.
"""

from dataclasses import dataclass

import numpy as np

from estimation.identification.criterion import Structure, polynomial
from estimation.identification.linear_model import ComplexArray, FloatArray

BANDS = 400
"""Frequency bands that the periodogram is summed into."""

BEAM = 6
"""Candidates of each order kept for building the next."""

STARTS = 4
"""Candidates handed on."""

CANCELLED = 3
"""Candidates with a nearly cancelled real pole that are handed on beside these."""

NUDGES = np.linspace(-0.15, 0.15, 13)
"""Relative changes of the poles' logarithms, within the spacing of the grid."""

DAMPING_RATIOS = (0.03, 0.1, 0.25, 0.5, 0.8)
"""Damping ratios of the complex pairs that are tried."""

DISTINCT = 0.2
"""Two candidates are one start if every pole moves by less than this share of its distance to z = 1."""


@dataclass(frozen=True)
class _Spectra:
    omega: FloatArray
    input_power: FloatArray
    cross: ComplexArray


def search_poles(structure: Structure, u: FloatArray, y: FloatArray) -> list[FloatArray]:
    """Return the denominators of the best pole positions found on a grid, distinct from each other.

    Orders are built up by a beam search: a real pole is added to the best models of one order less, a pair to
    those of two less.

    Parameters
    ----------
    structure : Structure
        The model's structure.
    u, y : ndarray, shape (n,)
        Input and output, no gaps.

    Returns
    -------
    list of ndarray, shape (n_denominator + 1,)
        Monic, stable, best first.
    """
    spectra = _banded_spectra(u, y)
    singles, pairs = _real_poles(u.size), _pole_pairs(u.size)
    best: list[ComplexArray] = [np.empty((1, 0), dtype=np.complex128)]
    for order in range(1, structure.n_denominator + 1):
        candidates = _extended(best[order - 1], singles)
        if order >= 2:
            candidates = np.concatenate([candidates, _extended(best[order - 2], pairs)])
        explained = _explained_power(structure, candidates, spectra)
        ranked = candidates[np.argsort(-explained, kind="stable")]
        best.append(_distinct(ranked, STARTS if order == structure.n_denominator else BEAM))
    slow = _nearly_cancelled(structure, best[-2][0], singles, spectra)
    return [polynomial(poles) for poles in [*best[-1], *slow]]


def _nearly_cancelled(
    structure: Structure, fewer: ComplexArray, singles: ComplexArray, spectra: _Spectra
) -> list[ComplexArray]:
    """Return the best model of one order less with a real pole added wherever that is locally best.

    A slow pole that a zero nearly cancels, as in the fourth model of Table 6, explains little power and never
    ranks among the best, but has a basin of its own.
    """
    # the poles already there sit on the grid: all are let move a little, lest the new one serve to correct them
    # (a negative real pole stays, since its power would be complex without a conjugate)
    movable = (fewer.imag != 0.0) | (fewer.real > 0.0)
    shifted = fewer ** (1.0 + movable * NUDGES[:, None])
    candidates = _extended(shifted, singles)
    power = _explained_power(structure, candidates, spectra).reshape(NUDGES.size, len(singles))
    candidates = candidates.reshape(NUDGES.size, len(singles), -1)[power.argmax(axis=0), np.arange(len(singles))]
    explained = np.pad(power.max(axis=0), 1, constant_values=-np.inf)
    peak = (explained[1:-1] > explained[:-2]) & (explained[1:-1] > explained[2:])
    order = np.argsort(-np.where(peak, explained[1:-1], -np.inf))
    return list(candidates[order[: min(CANCELLED, int(peak.sum()))]])


def _banded_spectra(u: FloatArray, y: FloatArray) -> _Spectra:
    spectrum_u, spectrum_y = np.fft.rfft(u), np.fft.rfft(y)
    bins = np.arange(1, spectrum_u.size)
    band = np.floor((BANDS - 1) * np.log(bins) / np.log(bins[-1])).astype(np.intp)
    band = np.concatenate([[0], np.unique(band, return_inverse=True)[1] + 1])
    count = np.bincount(band)
    power = np.abs(spectrum_u) ** 2
    cross = spectrum_y * np.conj(spectrum_u)
    omega = 2.0 * np.pi / u.size * np.bincount(band, np.arange(spectrum_u.size)) / count
    summed = np.bincount(band, cross.real) + 1j * np.bincount(band, cross.imag)
    return _Spectra(omega, np.bincount(band, power).astype(np.float64), summed)


def _real_poles(n_samples: int) -> ComplexArray:
    time_constants = np.geomspace(0.5, n_samples / 4.0, 40)
    poles = np.concatenate([[-0.95, -0.7, -0.3], np.exp(-1.0 / time_constants)])
    return poles.astype(np.complex128)[:, None]


def _pole_pairs(n_samples: int) -> ComplexArray:
    frequencies = np.geomspace(8.0 * np.pi / n_samples, 0.95 * np.pi, 24)
    zeta = np.array(DAMPING_RATIOS)[:, None]
    pole = np.exp(frequencies * (-zeta + 1j * np.sqrt(1.0 - zeta**2))).ravel()
    complex_pairs = np.stack([pole, pole.conj()], axis=1)
    real = _real_poles(n_samples)[::2, 0]
    first, second = np.triu_indices(real.size, 1)
    return np.concatenate([complex_pairs, np.stack([real[first], real[second]], axis=1)])


def _extended(kept: ComplexArray, additions: ComplexArray) -> ComplexArray:
    left = np.repeat(kept, len(additions), axis=0)
    right = np.tile(additions, (len(kept), 1))
    return np.concatenate([left, right], axis=1)


def _explained_power(structure: Structure, poles: ComplexArray, spectra: _Spectra) -> FloatArray:
    """Return the output power that the best numerator explains, one value a candidate (row of poles)."""
    shift = np.exp(-1j * spectra.omega)
    inverse = np.ones((len(poles), shift.size), dtype=np.complex128)
    for column in poles.T:
        inverse *= 1.0 - column[:, None] * shift
    inverse = 1.0 / inverse
    n_b = structure.n_numerator
    lags = np.arange(n_b)
    gram_terms = (np.abs(inverse) ** 2 * spectra.input_power) @ np.cos(np.outer(spectra.omega, lags))
    gram = gram_terms[:, np.abs(lags[:, None] - lags[None, :])]
    phases = shift[:, None] ** (structure.delay + lags)
    target = np.real((inverse * np.conj(spectra.cross)) @ phases)
    # a band-limited input makes the Gram matrix nearly singular; the ridge is far below what ranks candidates
    gram += 1e-12 * gram_terms[:, :1, None] * np.eye(n_b)
    return np.einsum("ij,ij->i", target, np.linalg.solve(gram, target[:, :, None])[:, :, 0])


def _distinct(ranked: ComplexArray, count: int) -> ComplexArray:
    chosen: list[ComplexArray] = []
    for poles in ranked:
        ordered = np.sort_complex(poles)
        if all((np.abs(ordered - other) > DISTINCT * np.abs(1.0 - other)).any() for other in chosen):
            chosen.append(ordered)
        if len(chosen) == count:
            break
    return np.array(chosen)
