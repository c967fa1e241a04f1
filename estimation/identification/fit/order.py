"""Which order a linear model needs: singular values against the noise, and information criteria."""

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.identification.fit.fitted import NoEffectError
from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.model.lags import lagged
from estimation.identification.search.experiments import Signals
from estimation.identification.search.linear import least_squares
from plant.errors import HydrostateError, LogWarning

if TYPE_CHECKING:
    import pandas as pd

SURROGATES = 19
"""Noise-only records behind a floor; the largest of 19 is exceeded by one more in 5 % of cases."""


@dataclass(frozen=True, eq=False)
class OrderTest:
    """Singular values of a record, and those that noise alone would give.

    Parameters
    ----------
    hankel_singular_values : ndarray, shape (k,)
        Of the Hankel matrix of the estimated impulse response (Figure 7 of the EHA paper)
        [output unit per input unit].
    hankel_noise_floor : float
        Largest such value that noise with the residual's spectrum gives [output unit per input unit].
    projected_singular_values : ndarray, shape (i,)
        Of the future outputs projected on the past beside the future inputs (MOESP) [output unit].
    projected_noise_floor : float
        Likewise [output unit].
    """

    hankel_singular_values: Array
    hankel_noise_floor: float
    projected_singular_values: Array
    projected_noise_floor: float
    suggested_order: int


def markov_parameters(u: ArrayLike, y: ArrayLike, n_lags: int) -> Array:
    """Return the impulse response by least squares, ``y_t = sum_k g_k u_(t-k)``.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps.
    n_lags : int
        Values wanted; the response must have died out by then.

    Returns
    -------
    ndarray, shape (n_lags,)
        ``g_0, g_1, ...`` [output unit per input unit].

    Raises
    ------
    HydrostateError
        If the record is shorter than three times the response.

    Examples
    --------
    >>> u = np.random.default_rng(1).standard_normal(200)
    >>> markov_parameters(u, 0.5 * u, 2).round(3) + 0.0
    array([0.5, 0. ])
    """
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return _impulse_responses(inputs, outputs[None, :], n_lags)[0]


def order_test(
    u: ArrayLike,
    y: ArrayLike,
    *,
    n_lags: int | None = None,
    n_rows: int = 15,
    rng: np.random.Generator | None = None,
) -> OrderTest:
    """Return the singular values that show the order of a linear system (Figure 7 of the EHA paper).

    The floor is the same computation on records that hold only noise with the spectrum of the residual (with new random
    Fourier phases), so it also holds for coloured noise. The projected values are the sharper test: a slowly switching
    input determines the impulse response poorly at high frequency.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps.
    n_lags : int, optional
        Length of the impulse response; a fiftieth of the record, between 20 and 300, unless told.
    n_rows : int
        Block rows of the projection; more than the order looked for.
    rng : numpy.random.Generator, optional
        Draws the phases; a fixed seed unless given.

    Returns
    -------
    OrderTest
        Both sets of singular values with their floors, and the order that they suggest.

    Raises
    ------
    HydrostateError
        If the arrays do not match, hold gaps, or are too short.
    """
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    _require_record(inputs, outputs, max(3 * (n_lags or 0), 12 * n_rows))
    lags = int(np.clip(inputs.size // 50, 20, 300)) if n_lags is None else n_lags
    generator = np.random.default_rng(0) if rng is None else rng

    response = markov_parameters(inputs, outputs, lags)
    residual = outputs - np.convolve(inputs, response)[: inputs.size]
    noise = _surrogates(residual[lags:], inputs.size, generator)

    responses = _impulse_responses(inputs, np.concatenate([outputs[None, :], noise]), lags)
    values = [np.linalg.svdvals(sliding_window_view(g[1:], lags // 2)) for g in responses]
    projected = _projected_values(inputs, np.concatenate([outputs[None, :], noise]), outputs, n_rows)
    floor = float(max(value[0] for value in projected[1:]))
    return OrderTest(
        hankel_singular_values=np.asarray(values[0], dtype=np.float64),
        hankel_noise_floor=float(max(value[0] for value in values[1:])),
        projected_singular_values=projected[0],
        projected_noise_floor=floor,
        suggested_order=int(np.count_nonzero(projected[0] > floor)),
    )


def order_table(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    orders: tuple[int, ...] = (1, 2, 3, 4),
    delay: int = 0,
) -> "pd.DataFrame":
    """Return the information criteria of output-error fits over orders.

    Parameters
    ----------
    u, y : array_like of shape (n,), or a sequence of them
        Input and output, as `fit_output_error` takes them.
    sample_time : float
        Seconds between samples [s].
    orders : tuple of int
        Denominator coefficients; the numerator has one more, or as many behind a delay.
    delay : int
        Dead time [samples].

    Returns
    -------
    pandas.DataFrame
        Indexed by order, one that explains nothing left out: ``n_parameters``,
        ``fit_percent``, ``rmse``, ``aic``, ``aicc``, ``bic`` and ``fpe`` (smaller
        is better; AIC and FPE over-fit more often),
        ``slowest_pole`` (largest modulus), ``cancellations`` (poles that a zero nearly cancels).

    Raises
    ------
    HydrostateError
        As `fit_output_error`.
    """
    rows: dict[int, dict[str, float]] = {}
    for order in orders:
        n_numerator = order + (1 if delay == 0 else 0)
        with warnings.catch_warnings():  # the table counts cancelled poles instead
            warnings.simplefilter("ignore", LogWarning)
            try:
                model = fit_output_error(u, y, sample_time, n_numerator=n_numerator, n_denominator=order, delay=delay)
            except NoEffectError:
                if order == orders[-1] and not rows:
                    raise
                continue
        n, p = model.n_samples, n_numerator + order + model.initial_state.size
        deviance = n * float(np.log(model.rmse**2))
        rows[order] = {
            "n_parameters": p,
            "fit_percent": model.fit_percent,
            "rmse": model.rmse,
            "aic": deviance + 2.0 * p,
            "aicc": deviance + 2.0 * p * n / max(n - p - 1, 1),
            "bic": deviance + float(np.log(n)) * p,
            "fpe": model.rmse**2 * (n + p) / (n - p),
            "slowest_pole": float(np.abs(model.poles[0])),
            "cancellations": len(model.cancellations),
        }
    import pandas as pd

    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("order")


def _require_record(u: Array, y: Array, n_wanted: int) -> None:
    if u.ndim != 1 or u.shape != y.shape or u.size < n_wanted:
        raise HydrostateError(
            f"an order test needs input and output of one length, {n_wanted} samples or more, "
            f"got shapes {u.shape} and {y.shape}"
        )
    if not (np.isfinite(u).all() and np.isfinite(y).all()):
        raise HydrostateError("an order test needs input and output without gaps, got NaN or infinite values")
    if u.min() == u.max():
        raise HydrostateError(f"the input must vary, got the constant {u[0]:g}")


def _impulse_responses(u: Array, outputs: Array, n_lags: int) -> Array:
    """Return the least-squares impulse response for each row of outputs, shape (m, n_lags)."""
    _require_record(u, outputs[0], 3 * n_lags)
    begin = n_lags - 1
    gram = _lag_gram(u, n_lags)
    used = u.size - begin
    size = u.size + used
    spectrum = np.conj(np.fft.rfft(outputs[:, begin:], size))
    # sum_t y_t u_(t-k), for t from `begin` on
    correlation = np.fft.irfft(spectrum * np.fft.rfft(u, size), size)[:, :n_lags][:, ::-1]
    return least_squares(gram, correlation.T).T


def _lag_gram(u: Array, n_lags: int) -> Array:
    """Return ``sum_t u_(t-i) u_(t-j)`` over full lags by displacement along diagonals, (n_lags, n_lags)."""
    begin, n = n_lags - 1, u.size
    gram = np.empty((n_lags, n_lags))
    gram[0] = [u[begin:] @ u[begin - k : n - k] for k in range(n_lags)]
    gram[:, 0] = gram[0]
    early, late = u[begin::-1], u[n - 1 : n - 1 - n_lags : -1]
    for i in range(1, n_lags):
        gram[i, 1:] = gram[i - 1, :-1] + early[i] * early[1:] - late[i - 1] * late[:-1]
    return gram


def _surrogates(residual: Array, n_samples: int, rng: np.random.Generator) -> Array:
    """Return noise with the residual's spectrum and fresh phases, shape (SURROGATES, n_samples)."""
    magnitude = np.abs(np.fft.rfft(np.resize(residual, n_samples)))
    phases = np.exp(2j * np.pi * rng.random((SURROGATES, magnitude.size)))
    phases[:, 0] = 1.0
    return np.fft.irfft(magnitude * phases, n_samples)


def _projected_values(u: Array, outputs: Array, past: Array, n_rows: int) -> list[Array]:
    """Return the projected singular values for each row of outputs, with one set of instruments.

    Future outputs less the part that future inputs explain are projected on past inputs and outputs (Verhaegen and
    Dewilde, 1992), and divided by the square root of the number of samples.
    """
    width = u.size - 2 * n_rows + 1

    def block(x: Array, first: int) -> Array:
        return lagged(x, 0, n_rows)[first + n_rows - 1 : first + n_rows - 1 + width]

    known = np.concatenate([block(u, n_rows), block(u, 0), block(past, 0)], axis=1)
    basis = np.linalg.qr(known)[0][:, n_rows:]
    return [np.asarray(np.linalg.svdvals(basis.T @ block(y, n_rows)) / np.sqrt(width)) for y in outputs]
