"""Output error of a linear model whose output is measured without its sign: the absolute value, smoothed by one lag.

A pulse counter gives the speed of a shaft and not its direction. With the sign known, the model is linear, so searches
begin with guessed signs: the square of the output is a quadratic form of filtered inputs, whose least-squares estimate
has the linear model as its largest eigenvector (the lifting of phase retrieval: Candes, Strohmer and Voroninski 2013).
See decision 307.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.least_squares import least_squares
from estimation.identification.free_run.linear_fit import COARSE, fit_linear, steiglitz_mcbride
from estimation.identification.free_run.linear_kernel import decay_rows, settles
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem
from estimation.identification.search.levenberg import levenberg

TOLERANCE, MOST_STEPS = 1e-9, 60
"""Relative gain of the cost below which a descent ends, and most evaluations."""

POLES = (0.3, 0.6, 0.8, 0.9)
"""Poles of the filtered inputs from which signs are first guessed."""

FILTERED = 8
"""Filtered inputs, all inputs together."""

PASSES = 8
"""Most iterations of signs from a linear fit and a linear model fitted to signed outputs."""

LAG = 0.2
"""Pole of the lag at which descents begin, beside zero."""

REFINED, ROUGH = 3, 1e-3
"""Starts that are refined, and relative gain of two successive steps below which the first descents end."""


@dataclass(frozen=True, eq=False)
class AbsoluteFit:
    """Result of a fit, in the data's scale, with the output relative to the sensor's zero.

    Parameters
    ----------
    lag : float
        Pole of the lag behind the absolute value; zero if there is none [dimensionless].
    linear : LinearFit
        What precedes the absolute value.
    """

    lag: float
    linear: LinearFit

    @property
    def cost(self) -> float:
        """Sum of squared residuals [dimensionless]."""
        return self.linear.cost

    @property
    def theta(self) -> Array:
        """All values [dimensionless], shape (p,)."""
        return np.concatenate([[self.lag], self.linear.theta])


class AbsoluteProblem:
    """Sensitivities of one form on given data."""

    def __init__(self, form: Form, data: Channels) -> None:
        self.inner = Problem(form, data)
        self.form = form

    def jacobian(self, theta: Array) -> tuple[Array, Array]:
        """Return the output and its derivative by every value.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            Lag, then the linear model's values.

        Returns
        -------
        tuple of ndarray, shapes (n,) and (n, p)
            Output and derivatives, scaled.
        """
        lag = float(theta[0])
        signed, behind = self.inner.jacobian(theta[1:])
        size = np.abs(signed)
        output, jacobian = np.empty_like(size), np.empty((size.size, theta.size), order="F")
        for first, last in zip(self.inner.bounds[:-1], self.inner.bounds[1:], strict=True):
            part = slice(int(first), int(last))
            rows = np.concatenate([size[part, None], np.sign(signed[part, None]) * behind[part]], axis=1).T
            rows = lagged(np.ascontiguousarray(rows), lag)
            output[part], jacobian[part, 1:] = rows[0], rows[1:].T
            before = np.concatenate([size[part][:1], rows[0, :-1]])
            moved = (before - size[part])[None, :]
            decay_rows(np.array([1.0, -lag]), moved, np.zeros(1))
            jacobian[part, 0] = moved[0]
        return output, jacobian

    def descend(self, theta: Array, *, lag: bool, least_gain: float = 0.0) -> AbsoluteFit:
        """Return the minimum from one start.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            Lag, then the linear model's values.
        lag : bool
            Whether the lag is fitted; otherwise it is constant.
        least_gain : float
            As `levenberg` takes it [dimensionless].
        """
        n_b, n, fixed = self.form.n_b, self.form.order, 0 if lag else 1

        def at(values: Array) -> tuple[float, Array, Array]:
            output, jacobian = self.jacobian(np.concatenate([theta[:fixed], values]))
            left = output - self.inner.y
            gram, slope = self.inner.counted.normal_equations(jacobian[:, fixed:], left)
            return self.inner.counted.square(left), gram, slope

        def acceptable(values: Array) -> bool:
            inner = values[1 - fixed :]
            return (bool(fixed) or 0.0 <= values[0] < 1.0) and settles(inner[n_b : n_b + n])

        steps: Any = {"tolerance": TOLERANCE, "most_steps": MOST_STEPS, "least_gain": least_gain}
        cost, best = levenberg(at, theta[fixed:], acceptable, **steps)
        values = np.concatenate([theta[:fixed], best])
        return AbsoluteFit(float(values[0]), LinearFit(self.form, values[1:], self.inner.share * cost))


def lagged(rows: Array, lag: float) -> Array:
    """Return series behind a lag of gain one, each constant at its first value before.

    Parameters
    ----------
    rows : ndarray, shape (r, n)
        One series a row; overwritten.
    lag : float
        Pole [dimensionless].

    Returns
    -------
    ndarray, shape (r, n)
        The same array.

    Examples
    --------
    >>> lagged(np.array([[1.0, 0.0, 0.0]]), 0.5).tolist()
    [[1.0, 0.5, 0.25]]
    """
    if lag != 0.0:
        rows *= 1.0 - lag
        decay_rows(np.array([1.0, -lag]), rows, rows[:, 0].copy())
    return rows


def fit_absolute(form: Form, data: Channels, signs: Sequence[Array]) -> AbsoluteFit:
    """Return the best model of one form.

    Parameters
    ----------
    data : Channels
        Scaled, with the output relative to the sensor's zero.
    signs : sequence of ndarray, shape (n,)
        Guessed signs of the output, at least one sequence.
    """
    problem = AbsoluteProblem(form, data)
    starts = [np.concatenate([[0.0], _followed(form, data, sign).theta]) for sign in signs]
    starts += [np.concatenate([[LAG], one[1:]]) for one in starts]

    def left(theta: Array) -> float:
        return problem.inner.counted.square(problem.jacobian(theta)[0] - problem.inner.y)

    ranked = sorted(starts, key=left)[:REFINED]
    fits = [problem.descend(theta, lag=bool(theta[0] > 0.0), least_gain=COARSE) for theta in ranked]
    return min(fits, key=lambda fit: fit.cost)


def refitted_absolute(fit: AbsoluteFit, data: Channels, least_gain: float = 0.0) -> AbsoluteFit:
    """Return the fit continued on the same data or a part of them.

    Parameters
    ----------
    data : Channels
        Scaled, with the output relative to the sensor's zero.
    least_gain : float
        As `levenberg` takes it [dimensionless].
    """
    return AbsoluteProblem(fit.linear.form, data).descend(fit.theta, lag=fit.lag > 0.0, least_gain=least_gain)


def signs_of(fit: AbsoluteFit, data: Channels) -> Array:
    """Return the signs of the output that the sensor does not measure.

    Parameters
    ----------
    data : Channels
        Scaled, the data of the fit.

    Returns
    -------
    ndarray, shape (n,)
        1 or -1.
    """
    return np.where(Problem(fit.linear.form, data).jacobian(fit.linear.theta)[0] < 0.0, -1.0, 1.0)


def signs_at_first(data: Channels) -> list[Array]:
    """Return possible signs of the output: from quadratic forms of filtered inputs, and one sign throughout.

    Parameters
    ----------
    data : Channels
        Scaled, the output counted from the sensor's zero.

    Returns
    -------
    list of ndarray, shape (n,)
        1 or -1 at every sample of all logs.
    """
    target = np.concatenate(data.y)
    known = np.isfinite(target)
    found = [np.ones(target.size)]
    for pole in POLES:
        filtered = _filtered(data, pole)
        first, second = np.triu_indices(filtered.shape[1])
        products = filtered[:, first] * filtered[:, second]
        values = least_squares(products[known], target[known] ** 2)[0]
        form = np.zeros((filtered.shape[1],) * 2)
        form[first, second] = values
        vectors = np.linalg.eigh(form + form.T)[1]
        found.append(np.where(filtered @ vectors[:, -1] < 0.0, -1.0, 1.0))
    return found


def _filtered(data: Channels, pole: float) -> Array:
    """Return Laguerre functions of all inputs, and a column of ones."""
    each = max(2, FILTERED // len(data.inputs))
    parts = list[Array]()
    for u in data.u:
        columns = list[Array]()
        for k in range(u.shape[1]):
            series = u[None, :, k] * np.sqrt(1.0 - pole * pole)
            decay_rows(np.array([1.0, -pole]), series, series[:, 0].copy())
            columns.append(series[0].copy())
            for _ in range(each - 1):
                last = series[0].copy()
                series = (np.concatenate([last[:1], last[:-1]]) - pole * last)[None, :]
                decay_rows(np.array([1.0, -pole]), series, series[:, 0].copy())
                columns.append(series[0].copy())
        parts.append(np.column_stack([*columns, np.ones(len(u))]))
    return np.concatenate(parts)


def _followed(form: Form, data: Channels, sign: Array) -> LinearFit:
    """Return the linear fit to outputs with signs from the fit before, until no sign changes."""
    ends = np.cumsum([y.size for y in data.y])[:-1]
    fit = _signed_fit(form, data, sign, ends, ())
    for _ in range(PASSES - 1):
        again = signs_of(AbsoluteFit(0.0, fit), data)
        if np.array_equal(again, sign):
            break
        sign = again
        fit = _signed_fit(form, data, sign, ends, [fit.f])
    return fit


def _signed_fit(form: Form, data: Channels, sign: Array, ends: IntArray, starts: Sequence[Array]) -> LinearFit:
    """Return the linear fit to signed outputs, from given denominators or from the data's own."""
    signed = replace(data, y=tuple(part * y for part, y in zip(np.split(sign, ends), data.y, strict=True)))
    return fit_linear(form, signed, starts or steiglitz_mcbride(Problem(form, signed)), least_gain=ROUGH)
