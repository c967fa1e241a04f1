"""Starts of an output-error fit: several denominators, because one start often ends in a local minimum.

From a random stable start Levenberg-Marquardt reaches the global minimum of a Table 6 model in 64 to 96 % of
runs; the fourth of them at high noise has two basins side by side. The starts here are of three kinds:
least-squares ARX and a high-order ARX model reduced through the Hankel matrix of its impulse response, both refined on
banded spectra, and a search over pole positions (`estimation.identification.search.pole_search`).
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from estimation.arrays import Array
from estimation.identification.model.lags import lagged
from estimation.identification.model.recursion import filtered
from estimation.identification.search.criterion import Structure, polynomial, stabilised_denominator
from estimation.identification.search.experiments import Experiments
from estimation.identification.search.linear import least_squares
from estimation.identification.search.pole_search import banded_spectra, refine, reflected, search_poles

HIGH_ORDER = 30
"""Most coefficients on either side of the high-order ARX model."""

IMPULSE_SAMPLES = 400
"""Most samples of the impulse response that is reduced to a low order."""

TWIN_DISTANCE = 1e-6
"""Denominators closer than this are one start."""


def starting_values(structure: Structure, data: Experiments, count: int) -> list[Array]:
    """Return candidate numerators and denominators, stable, the most promising first.

    Parameters
    ----------
    data : Experiments
        Input and output of order one.
    count : int
        Candidates wanted at most.

    Returns
    -------
    list of ndarray, shape (n_numerator + n_denominator,)
        Numerator, and denominator behind its 1.
    """
    pairs = data.bridged()
    u, y = max(pairs, key=lambda pair: pair[0].size)
    crude = [
        least_squares_arx(structure.n_numerator, structure.n_denominator, structure.delay, u, y)[1],
        reduced_high_order_arx(structure.n_denominator, u, y),
    ]
    spectra = banded_spectra(pairs)
    found = search_poles(structure, spectra, u.size)
    others = refine(structure, reflected(crude), spectra)
    costs, thetas = (np.concatenate(both) for both in zip(found, others, strict=True))
    return _without_twins(thetas[np.argsort(costs, kind="stable")])[:count]


def _without_twins(ranked: Array) -> list[Array]:
    kept: list[Array] = []
    for row in ranked:
        if all(np.abs(row - other).max() > TWIN_DISTANCE * (1.0 + np.abs(row).max()) for other in kept):
            kept.append(row)
    return kept


def least_squares_arx(n_numerator: int, n_denominator: int, delay: int, u: Array, y: Array) -> tuple[Array, Array]:
    """Return numerator and denominator of the least-squares ARX model ``F y = B u + e``.

    Parameters
    ----------
    n_numerator, n_denominator, delay : int
        As in `Structure`.
    u, y : ndarray, shape (n,)
        Input and output, no gaps.

    Returns
    -------
    numerator : ndarray, shape (delay + n_numerator,)
        ``b``.
    denominator : ndarray, shape (n_denominator + 1,)
        ``f``, monic; biased under output noise, and not necessarily stable.
    """
    regressors = np.concatenate([-lagged(y, 1, n_denominator), lagged(u, delay, n_numerator)], axis=1)
    begin = max(n_denominator, delay + n_numerator - 1)
    regressors, target = regressors[begin:], y[begin:]
    values = least_squares(regressors.T @ regressors, regressors.T @ target)
    f, b = values[:n_denominator], values[n_denominator:]
    return np.concatenate([np.zeros(delay), b]), np.concatenate([[1.0], f])


def reduced_high_order_arx(n_denominator: int, u: Array, y: Array) -> Array:
    """Return the denominator of a high-order ARX model reduced by the eigensystem realisation (Kung, 1978).

    A long ARX model is nearly unbiased under any noise; the shift structure of the leading singular vectors
    of its impulse response's Hankel matrix has the poles as eigenvalues.

    Parameters
    ----------
    u, y : ndarray, shape (n,)
        Input and output, no gaps.

    Returns
    -------
    ndarray, shape (n_denominator + 1,)
        Monic, not necessarily stable.
    """
    order = min(HIGH_ORDER, u.size // 10)
    b, f = least_squares_arx(order + 1, order, 0, u, y)
    pulse = np.zeros(min(IMPULSE_SAMPLES, max(u.size // 4, 10 * n_denominator)))
    pulse[0] = 1.0
    response = filtered(b, stabilised_denominator(f, u.size), pulse)[1:]
    half = (response.size + 1) // 2
    left = np.linalg.svd(sliding_window_view(response, response.size - half + 1))[0][:, :n_denominator]
    shift = least_squares(left[:-1], left[1:])
    return polynomial(np.linalg.eigvals(shift).astype(np.complex128))
