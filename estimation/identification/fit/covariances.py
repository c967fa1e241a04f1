"""Covariance of fitted coefficients: for a white residual, and robust for a coloured one."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.fit.residual_noise import noise_seen, noise_spectrum
from estimation.identification.fit.residual_tests import DEFAULT_LAGS, ljung_box
from estimation.identification.search.experiments import Experiments
from estimation.identification.search.linear import inverse_of_triangle

COLOURED_P_VALUE = 1e-3
"""p-value of the whiteness test below which a residual counts as coloured."""


@dataclass(frozen=True, eq=False)
class Spread:
    """Covariances of fitted values.

    Parameters
    ----------
    white, robust : ndarray, shape (p, p)
        As `covariances` returns them.
    coloured : bool
        Whether the residual is not white.
    determined : bool
        Whether the data tell the values apart.
    """

    white: Array
    robust: Array
    coloured: bool
    determined: bool

    @property
    def taken(self) -> Array:
        """The one that deviations are from."""
        return self.robust if self.coloured else self.white


def covariances(jacobian: Array, residual: Array, data: Experiments, outputs: int = 1) -> tuple[Array, Array, bool]:
    """Return ``s^2 (J'J)^-1`` and the sandwich ``(J'J)^-1 J'RJ (J'J)^-1``.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Derivatives of the model's output; zero rows where a sample is missing.
    residual : ndarray, shape (n,)
        Residual at the optimum; zero where a sample is missing.
    data : Experiments
        Says which samples are there, and which belong together.
    outputs : int
        Outputs whose experiments follow one another; the noise of each has a colour of its own [count].

    Returns
    -------
    white : ndarray, shape (p, p)
        Right if the residual is white.
    robust : ndarray, shape (p, p)
        With the autocovariance R of the noise behind the residual: right, too, where it is coloured.
    determined : bool
        Whether the data tell the coefficients apart; otherwise both covariances are lower bounds.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    # an initial state whose samples are all missing has no effect, and costs no degree of freedom
    felt = scale > 0.0
    scale[~felt] = 1.0
    columns = (jacobian / scale)[:, felt]
    triangle = np.asarray(np.linalg.qr(columns, mode="r"), dtype=np.float64)
    n_parameters = columns.shape[1]
    determined = bool(np.linalg.matrix_rank(triangle) == n_parameters)
    inverse = inverse_of_triangle(triangle) if determined else np.linalg.pinv(triangle)
    # orthonormal columns avoid squaring, so that the sandwich stays positive if coefficients are nearly dependent
    upright = columns @ inverse
    freedom = data.n_used - n_parameters
    white = inverse @ inverse.T * float(residual @ residual) / freedom
    meat = np.zeros_like(inverse)
    stride, filled = _rows_apart(data)
    for group in np.array_split(np.arange(data.count), outputs):
        parts = [slice(one.start, one.stop, stride) for one in (filled[k] for k in group) if one.stop > one.start]
        found = noise_spectrum([(residual[part], upright[part], data.used[part]) for part in parts])
        for part in parts:
            meat += noise_seen(found, upright[part])
    robust = inverse @ meat @ inverse.T
    unscale = np.outer(scale[felt], scale[felt])
    return _spread(white / unscale, felt), _spread(robust / unscale, felt), determined


def _spread(matrix: Array, felt: BoolArray) -> Array:
    whole = np.full((felt.size, felt.size), np.nan)
    whole[np.ix_(felt, felt)] = matrix
    return whole


def spread_of_fit(jacobian: Array, residual: Array, used: BoolArray, bounds: IntArray, outputs: int = 1) -> Spread:
    """Return the covariance of a fit to rows of samples: the robust one if what an output leaves is not white.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Derivatives of the model's output; changed to zero where a sample is missing.
    residual : ndarray, shape (n,)
        Residual at the optimum; zero where a sample is missing.
    used : ndarray of bool, shape (n,)
        Where samples are.
    bounds : ndarray of int, shape (rows + 1,)
        Where each row begins, and the end.
    outputs : int
        As `covariances` takes it.
    """
    jacobian[~used] = 0.0
    data = Experiments(np.zeros(residual.size), residual, used, bounds)
    white, robust, determined = covariances(jacobian, residual, data, outputs)
    ends = bounds[:: (bounds.size - 1) // outputs]
    coloured = any(is_coloured(residual[begin:end], used[begin:end]) for begin, end in pairwise(ends.tolist()))
    return Spread(white, robust, coloured, determined)


def is_coloured(residual: Array, used: BoolArray) -> bool:
    """Return whether a residual is surely not white; a short one is tested at fewer lags.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Of one output.
    used : ndarray of bool, shape (n,)
        Where samples are.
    """
    count = int(np.count_nonzero(used))
    lags = DEFAULT_LAGS if count > DEFAULT_LAGS else count // 2
    return ljung_box(np.where(used, residual, np.nan), n_lags=lags).p_value < COLOURED_P_VALUE


def _rows_apart(data: Experiments) -> tuple[int, list[slice]]:
    """Return how many rows apart samples are, which a slow sensor leaves empty between, and each experiment's rows."""
    stride, filled = 0, list[slice]()
    for part in data.slices:
        there = part.start + np.flatnonzero(data.used[part])
        filled.append(slice(int(there[0]), int(there[-1]) + 1) if there.size else slice(part.start, part.start))
        stride = int(np.gcd.reduce(np.diff(there), initial=stride))
    return max(stride, 1), filled
