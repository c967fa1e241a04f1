"""Polynomial models: sums of products of lagged signals, fitted to their free run with exact sensitivities."""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_problem import LinearFit
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.polynomial_variables import SIGNAL_MARGIN, Variables
from estimation.identification.search.levenberg import levenberg

OUTPUT_MARGIN = 0.2
"""Share of its range by which the output itself may leave it, with products [dimensionless]."""

STEPS, FINAL_STEPS = 8, 40
"""Evaluations after each added term, and at the end."""

TOLERANCE = 1e-8
"""Relative gain of the cost below which a descent ends."""


@dataclass(frozen=True, eq=False)
class PolynomialFit:
    """Terms and their coefficients, in the data's scale.

    Parameters
    ----------
    terms : ndarray of int, shape (k, 3)
        Variables of each term, followed by -1 if there are fewer than three; -1 stands for 1.
    theta : ndarray, shape (k + n_start * logs + n_friction,)
        Coefficients, the first outputs of each log, and the values of the friction.
    cost : float
        Sum of squared residuals of the free run [dimensionless].
    """

    variables: Variables
    terms: IntArray
    theta: Array
    cost: float

    @property
    def coefficients(self) -> Array:
        """One per term."""
        return self.theta[: self.terms.shape[0]]

    @property
    def friction(self) -> Array:
        """Values of the friction; empty if there is none."""
        return self.theta[self.theta.size - self.variables.n_friction :]


def variables_of(linear: LinearFit, data: Channels) -> tuple[Variables, IntArray, Array]:
    """Return the lagged signals of a linear model, its terms and coefficients.

    Parameters
    ----------
    data : Channels
        Scaled.

    Returns
    -------
    tuple of Variables, ndarray of int (k, 3) and ndarray (k,)
        With the constant as the first term.
    """
    form = linear.form
    source, lag = [0] * form.order, list(range(1, form.order + 1))
    for index, (size, delay) in enumerate(zip(form.sizes, form.delays, strict=True)):
        source += [index + 1] * size
        lag += list(range(delay, delay + size))
    outputs = np.concatenate(data.y)
    ends = [(float(np.nanmin(outputs)), float(np.nanmax(outputs)))]
    together = np.concatenate(data.u)
    ends += [(float(one.min()), float(one.max())) for one in together.T]
    limits = np.array([ends[k] for k in source])
    span = limits[:, 1] - limits[:, 0]
    limits = limits + SIGNAL_MARGIN * np.column_stack([-span, span])
    terms = np.full((1 + len(source), 3), -1, dtype=np.int64)
    terms[1:, 0] = np.arange(len(source))
    n_b = form.n_b
    offset = linear.theta[n_b + form.order] * float(linear.f.sum())
    values = np.concatenate([[offset], -linear.f[1:], linear.theta[:n_b]])
    return Variables(np.array(source, dtype=np.int64), np.array(lag, dtype=np.int64), limits), terms, values


def ends_of(variables: Variables, terms: IntArray) -> Array:
    """Return the ends at which a run's output is clipped: infinite without products.

    Parameters
    ----------
    terms : ndarray of int, shape (k, 3)
        Variables of each term, followed by -1 if there are fewer than three; -1 stands for 1.

    Returns
    -------
    ndarray, shape (2,)
        Least and greatest output, scaled.
    """
    free = not (terms[:, 1] >= 0).any()
    return np.array([-1e9, 1e9]) if free else variables.extended_ends(OUTPUT_MARGIN)


class Runs:
    """Free runs of one set of terms on given data.

    Parameters
    ----------
    terms : ndarray of int, shape (k, 3)
        Variables of each term, followed by -1 if there are fewer than three; -1 stands for 1.
    data : Channels
        Scaled.
    early : bool
        Whether runs begin as early as the output's lags allow, with inputs at their first values before the log. By
        default they begin where no earlier input counts, and earlier outputs are as measured.
    """

    def __init__(self, variables: Variables, terms: IntArray, data: Channels, *, early: bool = False) -> None:
        self.variables, self.terms, self.data = variables, terms, data
        self.target = np.concatenate(data.y)
        n, longest = variables.n_start, int(variables.lag.max(initial=0))
        self.begins = [n if early else max(min(longest, y.size), n) for y in data.y]
        given = [np.arange(y.size) < begin - n for y, begin in zip(data.y, self.begins, strict=True)]
        self.used: BoolArray = np.isfinite(self.target) & ~np.concatenate(given)

    def start_values(self) -> Array:
        """Return the measured outputs with which each log's run begins; gaps are filled by the first valid one."""
        n = self.variables.n_start
        ends = zip(self.data.y, self.begins, strict=True)
        return np.concatenate([first_values(y, begin)[begin - n :] for y, begin in ends]) if n else np.zeros(0)

    def outputs(self, theta: Array) -> Array | None:
        """Return the outputs; None if one diverges.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            All values.

        Returns
        -------
        ndarray, shape (n,), or None
            Of all logs, one after the other.
        """
        return NormalEquations(self, self.ends).outputs(theta)

    @property
    def ends(self) -> Array:
        """Ends at which the output is clipped: infinite without products, shape (2,)."""
        return ends_of(self.variables, self.terms)

    def outputs_before_run(self, theta: Array, index: int) -> Array:
        """Return the outputs of a log before its run, followed by zeros.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            All values.
        index : int
            Index of the log.

        Returns
        -------
        ndarray, shape (n,)
            Scaled.
        """
        n, y, begin = self.variables.n_start, self.data.y[index], self.begins[index]
        out, first = np.zeros(y.size), self.terms.shape[0] + index * n
        out[: begin - n] = first_values(y, begin - n)
        out[begin - n : begin] = theta[first : first + n]
        return out

    def fit(self, theta: Array, steps: int, penalty: float = 0.0, least_gain: float = 0.0) -> PolynomialFit | None:
        """Return the minimum of the squared free-run error from given values, if they run at all.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            All values.
        penalty : float
            Weight of the squared coefficients of products beside the mean squared error [dimensionless].
        least_gain : float
            As `levenberg` takes it [dimensionless].
        """
        equations, count = NormalEquations(self, self.ends), int(np.count_nonzero(self.used))
        weight = np.zeros(theta.size)
        weight[: self.terms.shape[0]] = penalty * count * (self.terms[:, 1] >= 0)
        nowhere, least = (np.eye(theta.size), np.zeros(theta.size)), np.inf

        def at(values: Array) -> tuple[float, Array, Array]:
            nonlocal least
            ran = equations.outputs(values)
            if ran is None:
                return np.inf, *nowhere
            left = ran - self.target
            reached = float(np.sum(left[self.used] ** 2) + weight @ values**2)
            if not reached < least:  # the step is rejected, so its slopes are not needed
                return reached, *nowhere
            gram, right = equations.sums(left)
            # the small diagonal term: first values of a log whose outputs are held back have no effect
            gram[np.diag_indices_from(gram)] += 1e-12 * max(float(np.diag(gram).max()), 1.0) + weight
            if not np.isfinite(gram).all():
                return np.inf, *nowhere
            least = reached
            return reached, gram, right + weight * values

        rubbing = slice(theta.size - self.variables.n_friction, theta.size)

        def acceptable(values: Array) -> bool:
            return bool((values[rubbing][:2] >= 0.0).all())

        cost, best = levenberg(at, theta, acceptable, tolerance=TOLERANCE, most_steps=steps, least_gain=least_gain)
        if not np.isfinite(cost):
            return None
        return PolynomialFit(self.variables, self.terms, best, cost - float(weight @ best**2))


def first_values(y: Array, count: int) -> Array:
    """Return the first outputs of a log; gaps are filled by the first valid one.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Output; NaN where missing.

    Returns
    -------
    ndarray, shape (count,)
        First outputs.
    """
    known = y[np.isfinite(y)]
    first = y[:count]
    return np.where(np.isfinite(first), first, known[0] if known.size else 0.0)
