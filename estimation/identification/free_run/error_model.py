"""`error_model_of(runs, data) -> ErrorModel`: what a model leaves, predicted from its own free run and its inputs.

This is a model error model (Ljung 1999, Model validation and model error modeling): a polynomial of the free run and
the inputs, now and earlier. Nothing is fed back, so a run is as stable as without it. Its coefficients are penalised
(ridge regression, Hoerl and Kennard 1970); penalty, degree and times are chosen by what held-back blocks leave.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import comb
from operator import itemgetter
from typing import Any

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.free_run.data import Channels, blocks
from estimation.identification.free_run.fallback import jackknife
from estimation.identification.free_run.held_back import (
    BLOCKS,
    CLEAR_MARGIN,
    block_error,
    is_better_beyond_chance,
    pooled_error,
)
from estimation.identification.free_run.polynomial_variables import SIGNAL_MARGIN
from estimation.progress import report_progress

EARLIER = (1, 4)
"""Earlier times of the signals, over the step between times [dimensionless]."""

SHORTEST_SHARE = 50
"""Samples of a log over the longest step between times [dimensionless]; steps are 1, 2, 4 and so on."""

MOST_CUBED = 6
"""Signals, at all times together, up to which products of three are tried [count]: 83 products."""

PENALTIES = np.logspace(-4.0, 1.0, 11)
"""Penalties of squared coefficients that are tried, per output, for products of unit deviation [dimensionless]."""


MOST_ROWS = 10_000
"""Samples whose products are held in memory at once [count]."""


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """A polynomial that predicts what a model leaves.

    Parameters
    ----------
    lags : tuple of int
        Times of the signals before now [samples].
    degree : int
        Of the polynomial.
    ends : ndarray, shape (2, m + 1)
        Least and greatest value of the free run and of each input that count, scaled.
    means, deviations : ndarray, shape (p,)
        Of the products in the fitted data.
    values : ndarray, shape (p + 1,)
        Constant, and coefficients of the products in units of their deviations, scaled.
    parts : ndarray, shape (blocks, p + 1)
        The same, each fitted without one block.
    error, plain_error : float
        Error on held-back blocks with this model, and without it, over the output's deviation [dimensionless].
    """

    lags: tuple[int, ...]
    degree: int
    ends: Array
    means: Array
    deviations: Array
    values: Array
    parts: Array
    error: float
    plain_error: float

    @property
    def n_values(self) -> int:
        """Fitted coefficients."""
        return self.values.size

    def facts(self) -> dict[str, Any]:
        """Return degree and times of the polynomial, under the names of the JSON contract."""
        return {"degree": self.degree, "lags_samples": list(self.lags), "n_values": self.n_values}

    def predicted(self, u: Array, run: Array) -> Array | None:
        """Return the predicted error of a free run, or None if these inputs do not determine it.

        Fits without one block each show how well it is determined (the jackknife).

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        run : ndarray, shape (n,)
            Free run, scaled.

        Returns
        -------
        ndarray, shape (n,), or None
            What the output lies above the run, scaled.
        """
        if not np.isfinite(run).all():
            return None
        signals = np.clip(np.column_stack([run, u]), *self.ends)
        fits, pieces = np.column_stack([self.values, *self.parts]), -(-run.size // MOST_ROWS)
        found, *others = np.concatenate(
            [
                _columns(_products(signals, rows, self.lags, self.degree), self.means, self.deviations) @ fits
                for rows in np.array_split(np.arange(run.size), pieces)
            ]
        ).T
        apart = jackknife(found, others)
        return found if np.hypot(self.error, apart) < self.plain_error else None

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            "lags": list(self.lags),
            "degree": self.degree,
            "ends": self.ends.tolist(),
            "means": self.means.tolist(),
            "deviations": self.deviations.tolist(),
            "values": self.values.tolist(),
            "parts": self.parts.tolist(),
            "error": self.error,
            "plain_error": self.plain_error,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], inputs: int) -> "ErrorModel":
        """Return the error model that `to_dict` wrote.

        Parameters
        ----------
        inputs : int
            Of the model whose error it predicts [count].

        Raises
        ------
        ValueError
            If its arrays do not fit together.
        """
        ends, means, deviations, found, parts = (
            np.array(values[name], dtype=np.float64) for name in ("ends", "means", "deviations", "values", "parts")
        )
        lags, degree = tuple(map(int, values["lags"])), int(values["degree"])
        sizes = float(values["error"]), float(values["plain_error"])
        if degree not in (2, 3) or min(lags) < 0 or ends.shape != (2, inputs + 1):
            raise ValueError(
                f"degree 2 or 3, lags from 0 and ends of {inputs + 1} signals are needed, got {degree}, {lags} and "
                f"{ends.shape}"
            )
        single = ends.shape[1] * len(lags)
        count = sum(comb(single + one - 1, one) for one in range(1, degree + 1))
        shapes = [means.shape, deviations.shape, found.shape, parts.shape[1:]]
        if shapes != [(count,), (count,), (count + 1,), (count + 1,)]:
            raise ValueError(f"an error model of {count} products is needed, got arrays of {shapes}")
        return cls(lags, degree, ends, means, deviations, found, parts, *sizes)


def error_model_of(runs: Sequence[Array], data: Channels, undetermined: Sequence[int]) -> ErrorModel | None:
    """Return the model of what free runs leave; None if it does not surely reduce the error on held-back blocks.

    Parameters
    ----------
    runs : sequence of ndarray, shape (n,)
        Free run of a model on each log, scaled.
    data : Channels
        The logs, scaled.
    undetermined : sequence of int
        First outputs of each log that the model does not determine [samples].
    """
    errors = _Errors.of(runs, data, undetermined)
    plain = [block_error(errors.left, mask) for mask in errors.masks]
    best: tuple[ErrorModel, list[float]] | None = None
    for lags in _times(data.longest):
        for degree in (2, 3) if len(lags) * errors.ends.shape[1] <= MOST_CUBED else (2,):
            report_progress("error models")
            found = errors.fitted(lags, degree, pooled_error(plain))
            if found is not None and (best is None or found[0].error < best[0].error):
                best = found
    if best is None or not best[0].error < (1.0 - CLEAR_MARGIN) * pooled_error(plain):
        return None
    return best[0] if is_better_beyond_chance(best[1], plain) else None


def _times(longest: int) -> Iterator[tuple[int, ...]]:
    """Yield the times of the signals before now that are compared [samples]."""
    yield (0,)
    step = 1
    while SHORTEST_SHARE * step <= longest:
        yield (0, *(step * one for one in EARLIER))
        step *= 2


@dataclass(frozen=True, eq=False)
class _Errors:
    """What a model's free runs leave of the outputs.

    Parameters
    ----------
    signals : sequence of ndarray, shape (n, m + 1)
        Free run and inputs of each log, scaled.
    ends : ndarray, shape (2, m + 1)
        As in `ErrorModel`.
    left : ndarray, shape (n,)
        Errors of all logs, scaled; NaN where the output is missing.
    used : ndarray of bool, shape (n,)
        Which of them count.
    masks : sequence of ndarray of bool, shape (n,)
        Those of each held-back block.
    """

    signals: Sequence[Array]
    ends: Array
    left: Array
    used: BoolArray
    masks: Sequence[BoolArray]

    @classmethod
    def of(cls, runs: Sequence[Array], data: Channels, undetermined: Sequence[int]) -> "_Errors":
        signals = [np.column_stack([run, u]) for run, u in zip(runs, data.u, strict=True)]
        together = np.concatenate(signals)
        low, high = together.min(axis=0), together.max(axis=0)
        ends = np.array([low - SIGNAL_MARGIN * (high - low), high + SIGNAL_MARGIN * (high - low)])
        left = np.concatenate([y - run for y, run in zip(data.y, runs, strict=True)])
        begun = np.concatenate([np.arange(y.size) >= first for y, first in zip(data.y, undetermined, strict=True)])
        used = np.isfinite(left) & begun
        return cls(signals, ends, left, used, [np.concatenate(mask) & used for mask in blocks(data, BLOCKS)])

    def fitted(self, lags: tuple[int, ...], degree: int, plain_error: float) -> tuple[ErrorModel, list[float]] | None:
        """Return the fit with the penalty that held-back blocks prefer, and its error on each of them.

        None if there are fewer than two outputs for each coefficient.
        """
        products = np.concatenate([_products(one, np.arange(len(one)), lags, degree) for one in self.signals])
        count = int(np.count_nonzero(self.used))
        if count < 2 * (products.shape[1] + 1):
            return None
        means, deviations = products[self.used].mean(axis=0), products[self.used].std(axis=0)
        deviations = np.where(deviations > 0.0, deviations, 1.0)
        columns = _columns(products, means, deviations)
        gram, side = _sums(columns, self.left, self.used)
        held = [_sums(columns, self.left, mask) for mask in self.masks]
        free = np.diag(np.arange(columns.shape[1]) > 0).astype(np.float64)  # the constant is not penalised
        compared: list[tuple[float, float, list[float], Array]] = []
        for penalty in count * PENALTIES:
            parts = np.array([np.linalg.solve(gram - g + penalty * free, side - s) for g, s in held])
            errors = [
                block_error(self.left - columns @ part, mask) for part, mask in zip(parts, self.masks, strict=True)
            ]
            compared.append((pooled_error(errors), float(penalty), errors, parts))
        error, penalty, errors, parts = min(compared, key=itemgetter(0))
        values = np.linalg.solve(gram + penalty * free, side).astype(np.float64)
        return ErrorModel(lags, degree, self.ends, means, deviations, values, parts, error, plain_error), errors


def _sums(columns: Array, left: Array, mask: BoolArray) -> tuple[Array, Array]:
    """Return the normal equations of the samples in a mask: products of columns, and of columns and errors."""
    chosen = columns[mask]
    return chosen.T @ chosen, chosen.T @ left[mask]


def _columns(products: Array, means: Array, deviations: Array) -> Array:
    """Return a column of ones, and products less their means over their deviations, shape (n, p + 1)."""
    return np.column_stack([np.ones(len(products)), (products - means) / deviations])


def _products(signals: Array, rows: IntArray, lags: Sequence[int], degree: int) -> Array:
    """Return the signals at rows and earlier, and their products, shape (rows, p); before a log they stand still."""
    single = np.column_stack([signals[np.maximum(rows - lag, 0)] for lag in lags])
    found = [single]
    for count in range(2, degree + 1):
        places = np.array(list(combinations_with_replacement(range(single.shape[1]), count)))
        found.append(np.prod([single[:, column] for column in places.T], axis=0))
    return np.concatenate(found, axis=1)
