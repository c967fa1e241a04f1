"""Chi-square tests of a residual: whether it is white, and whether it depends on past inputs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.identification.model.lags import lagged
from estimation.identification.model.linear_model import LinearModel
from estimation.trust.chi_square import chi_square_tail
from plant.errors import HydrostateError

DEFAULT_LAGS = 25
"""Lags that the residual tests look at."""


SINGULAR = 1e-10
"""Share of the largest variance below which a direction of two models' difference is only rounding."""


@dataclass(frozen=True)
class ResidualTest:
    """A chi-square test of a residual.

    Parameters
    ----------
    statistic : float
        The test statistic [dimensionless].
    degrees_of_freedom : int
        Of its chi-square distribution under the null hypothesis.
    p_value : float
        Probability of a statistic at least this large if the model is right.
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float

    def passed(self, level: float = 0.05) -> bool:
        """Return whether the model passes the test.

        Parameters
        ----------
        level : float
            Significance level [probability].
        """
        return self.p_value >= level


def ljung_box(residual: ArrayLike, *, n_lags: int = DEFAULT_LAGS, n_parameters: int = 0) -> ResidualTest:
    """Test whether a residual is white (Ljung and Box, 1978).

    Parameters
    ----------
    residual : array_like, shape (n,)
        NaN where missing.
    n_parameters : int
        Parameters of a *noise* model fitted to it; none for output error.

    Returns
    -------
    ResidualTest
        A small p-value says that the residual is coloured: the fit may stand, its white-noise covariance not.

    Raises
    ------
    HydrostateError
        If there are not more samples than lags, or not more lags than parameters.
    """
    values = np.asarray(residual, dtype=np.float64)
    known = np.isfinite(values)
    n = int(known.sum())
    if n <= n_lags or n_lags <= n_parameters:
        raise HydrostateError(
            f"a whiteness test needs n_parameters < n_lags < samples, got {n_parameters}, {n_lags} and {n}"
        )
    centred = np.where(known, values - values[known].mean(), 0.0)
    weight = known.astype(np.float64)
    variance = float(centred @ centred) / n
    if variance == 0.0:  # a zero residual cannot be coloured
        return _chi_square(0.0, n_lags - n_parameters)
    lags = np.arange(1, n_lags + 1)
    pairs = np.maximum([weight[k:] @ weight[:-k] for k in lags], 1.0)
    correlation = np.array([centred[k:] @ centred[:-k] for k in lags]) / (pairs * variance)
    # without missing samples, pairs is n - k and this is n (n + 2) sum(r_k^2 / (n - k)), with r_k divided by n
    statistic = float((n + 2.0) / n * np.sum(pairs * correlation**2))
    return _chi_square(statistic, n_lags - n_parameters)


def cross_correlation_test(
    residual: ArrayLike,
    u: ArrayLike,
    *,
    n_lags: int = DEFAULT_LAGS,
    jacobian: ArrayLike | None = None,
) -> ResidualTest:
    """Test whether a residual depends on past inputs.

    The residual is projected on the lagged inputs, after removal of everything that the fit could already absorb (the
    columns of `jacobian`). Without that step the usual statistic rejects a correct model too often.

    Parameters
    ----------
    residual : array_like, shape (n,)
        White if the model is right; NaN where missing.
    u : array_like, shape (n,)
        Input, no gaps.
    n_lags : int
        Lags 0 to ``n_lags`` are counted.
    jacobian : array_like, shape (n, p), optional
        Sensitivities of the model's output, if the model was fitted to these data.

    Returns
    -------
    ResidualTest
        A small p-value says that a better model exists: another order, delay, or a nonlinearity.

    Raises
    ------
    HydrostateError
        If the arrays do not match, or there are too few samples.
    """
    values, inputs = np.asarray(residual, dtype=np.float64), np.asarray(u, dtype=np.float64)
    if values.shape != inputs.shape:
        raise HydrostateError(f"residual and input must match, got shapes {values.shape} and {inputs.shape}")
    known = np.isfinite(values)
    known[:n_lags] = False
    absorbed = np.ones((values.size, 1)) if jacobian is None else np.asarray(jacobian, dtype=np.float64)
    few = HydrostateError(f"a cross-correlation test over {n_lags} lags needs more samples, got {known.sum()}")
    freedom = int(known.sum()) - absorbed.shape[1]
    if freedom <= 0:
        raise few
    columns = _orthogonal_to(absorbed[known], _unit_columns(lagged(inputs, 0, n_lags + 1)[known]))
    left, strength, _ = np.linalg.svd(columns, full_matrices=False)
    rank = int(np.count_nonzero(strength > max(columns.shape) * np.finfo(float).eps * 1e2 * strength[0]))
    if freedom <= rank:
        raise few
    remaining = values[known]
    if jacobian is None:
        remaining = remaining - remaining.mean()
    variance = float(remaining @ remaining) / freedom
    if variance == 0.0:  # a zero residual follows nothing
        return _chi_square(0.0, rank)
    statistic = float(np.sum((left[:, :rank].T @ remaining) ** 2)) / variance
    return _chi_square(statistic, rank)


def feedback_test(residual: ArrayLike, u: ArrayLike, *, n_lags: int = DEFAULT_LAGS) -> ResidualTest:
    """Test whether inputs follow earlier noise of the output, which shows a closed loop around the plant.

    A long autoregression whitens the residual, and past and present inputs are removed from it, so that neither its
    colour nor a model that is too simple counts as feedback. The test then looks for future inputs in it.

    Parameters
    ----------
    residual : array_like, shape (n,)
        Measured less simulated; NaN where missing.
    u : array_like, shape (n,)
        Input, no gaps.
    n_lags : int
        Future inputs counted, and past ones removed.

    Returns
    -------
    ResidualTest
        A small p-value says that the input was fed back: output error and spectra are then biased, and models of the
        noise (ARMAX, Box-Jenkins) needed.

    Raises
    ------
    HydrostateError
        If the arrays do not match, or there are too few samples.
    """
    values, inputs = np.asarray(residual, dtype=np.float64), np.asarray(u, dtype=np.float64)
    if values.shape != inputs.shape or values.size < 8 * n_lags:
        raise HydrostateError(
            f"a feedback test needs residual and input of one length, {8 * n_lags} samples or more, "
            f"got shapes {values.shape} and {inputs.shape}"
        )
    known = np.isfinite(values)
    filled = np.where(known, values, 0.0)
    past = lagged(filled, 1, n_lags)
    white = filled - past @ np.linalg.lstsq(past.T @ past, past.T @ filled, rcond=None)[0]
    white[~known] = np.nan
    white[:n_lags] = np.nan
    before = np.concatenate([np.ones((inputs.size, 1)), lagged(inputs, 0, n_lags + 1)], axis=1)
    return cross_correlation_test(white[::-1], inputs[::-1], n_lags=n_lags, jacobian=before[::-1])


def contrast_test(model: LinearModel, robust: LinearModel) -> ResidualTest:
    """Test whether two fits of one form to the same data differ by more than their uncertainty (Hausman 1978).

    Both covariances are added, as if the fits were independent. Fits to the same data differ less, so the test seldom
    accuses.

    Parameters
    ----------
    model : LinearModel
        A fit that assumes something of the noise.
    robust : LinearModel
        One that does not, with the same numbers of coefficients; its robust covariance counts.

    Returns
    -------
    ResidualTest
        A small p-value says that one of both is biased.
    """
    values = [np.concatenate([one.free_numerator, one.denominator[1:]]) for one in (model, robust)]
    spread = model.covariance + robust.covariance_robust
    scale = np.sqrt(np.diag(spread))
    apart = (values[0] - values[1]) / scale
    strength, directions = np.linalg.eigh(spread / np.outer(scale, scale))
    kept = strength > SINGULAR * strength[-1]
    moved = (directions.T @ apart)[kept]
    return _chi_square(float(np.sum(moved**2 / strength[kept])), int(np.count_nonzero(kept)))


def correlations(residual: ArrayLike, other: ArrayLike, lags: ArrayLike) -> Array:
    """Return the correlation of a residual with another signal, or with itself, some samples earlier.

    Parameters
    ----------
    residual, other : array_like, shape (n,)
        Both NaN where missing.
    lags : array_like of int, shape (k,)
        How many samples earlier the other is taken; later, where negative.

    Returns
    -------
    ndarray, shape (k,)
        From -1 to 1 [dimensionless].

    Examples
    --------
    >>> pulse = np.zeros(100)
    >>> pulse[50] = 1.0
    >>> correlations(np.roll(pulse, 3), pulse, [0, 3]).round(2).tolist()
    [-0.01, 1.0]
    """
    first, second = (np.asarray(values, dtype=np.float64) for values in (residual, other))
    first, second = (np.where(np.isfinite(one), one - np.nanmean(one), 0.0) for one in (first, second))
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    n = first.size
    products = [
        first[max(k, 0) : n + min(k, 0)] @ second[max(-k, 0) : n - max(k, 0)] for k in np.asarray(lags).tolist()
    ]
    return np.array(products) / size


def _unit_columns(columns: Array) -> Array:
    scale = np.linalg.norm(columns, axis=0)
    return columns / np.where(scale > 0.0, scale, 1.0)


def _orthogonal_to(absorbed: Array, columns: Array) -> Array:
    basis = np.linalg.qr(_unit_columns(absorbed))[0]
    return columns - basis @ (basis.T @ columns)


def _chi_square(statistic: float, freedom: int) -> ResidualTest:
    return ResidualTest(statistic, freedom, chi_square_tail(statistic, freedom))
