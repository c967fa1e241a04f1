"""Output error of several inputs with one denominator, an offset, and a free initial state in every log."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.fit.output_error import FINAL_STEPS, descend_from, screened
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.lagged_columns import columns_of, lay_shifted
from estimation.identification.free_run.least_squares import Counted, least_squares
from estimation.identification.free_run.linear_kernel import decay_rows, longest_pole, settles
from estimation.identification.search.criterion import Structure, held_within
from estimation.identification.search.descent import stable
from estimation.identification.search.experiments import Experiments
from estimation.identification.search.levenberg import levenberg
from estimation.identification.search.reflections import stable_step

TOLERANCE, MOST_STEPS, FIRST_STEPS = 1e-9, 80, 20
"""Share of the cost that a further step may promise at the end, evaluations at most, and those of each of several
starts."""

MOST_SEARCHED = 100_000
"""Samples of which the global minimum is searched; more begin at other starts alone."""

COARSE = 1e-5
"""Share of the cost that two steps in a row must gain each while models are compared: what is taken is fitted on."""

PASSES = 12
"""Of the iteration of Steiglitz and McBride."""

SLOWER = (0.5, 0.9, 0.98)
"""Poles that are added, each with its zeros, to the minimum of one order less."""


@dataclass(frozen=True)
class Form:
    """Size of a linear model.

    Parameters
    ----------
    order : int
        Coefficients of the denominator behind its 1.
    sizes, delays : tuple of int
        Coefficients of each input's numerator, and the samples before them.
    """

    order: int
    sizes: tuple[int, ...]
    delays: tuple[int, ...]

    @property
    def n_b(self) -> int:
        """Coefficients of all numerators."""
        return sum(self.sizes)

    @property
    def n_values(self) -> int:
        """Coefficients of numerators and denominator, and the offset."""
        return self.n_b + self.order + 1


@dataclass(frozen=True, eq=False)
class LinearFit:
    """Where a linear fit has ended, in the data's scale.

    Parameters
    ----------
    theta : ndarray, shape (p,)
        Numerators, denominator behind its 1, offset, and the initial state of each log.
    cost : float
        Sum of squared residuals [dimensionless].
    bounded : bool
        Whether time constants were held within the record.
    """

    form: Form
    theta: Array
    cost: float
    bounded: bool = False

    @property
    def numerators(self) -> list[Array]:
        """Free numerator of each input."""
        return np.split(self.theta[: self.form.n_b], np.cumsum(self.form.sizes)[:-1])

    @property
    def f(self) -> Array:
        """Denominator, monic."""
        n_b = self.form.n_b
        return np.concatenate([[1.0], self.theta[n_b : n_b + self.form.order]])


class Problem:
    """Sensitivities of one form on given data."""

    def __init__(self, form: Form, data: Channels) -> None:
        self.form, self.data = form, data
        self.bounds = np.concatenate([[0], np.cumsum([y.size for y in data.y])])
        self.y = np.concatenate(data.y)
        self.used: BoolArray = np.isfinite(self.y)
        self.counted = Counted(self.used)
        self.n_parameters = form.n_values + form.order * len(data.y)

    def linear_columns(self, f: Array) -> Array:
        """Return the output's derivative by numerators, offset and initial states for a denominator.

        Parameters
        ----------
        f : ndarray, shape (order + 1,)
            Denominator, monic.

        Returns
        -------
        ndarray, shape (n, n_b + 1 + order * logs)
            Numerators, offset, initial states of each log.
        """
        out = np.zeros((self.y.size, self.form.n_b + 1 + self.form.order * len(self.data.y)), order="F")
        self._lay_linear(f, out, self.form.n_b)
        return out

    def _lay_linear(self, f: Array, out: Array, offset: int) -> None:
        """Put the linear columns where they belong: numerators first, the offset and initial states from a column on.

        Where initial states have no part is left as it is: zero.
        """
        form, n = self.form, self.form.order
        out[:, offset] = 1.0
        for index, u in enumerate(self.data.u):
            first, last = int(self.bounds[index]), int(self.bounds[index + 1])
            # an input that stood at its first value before the log: lags are shifts, filtered or not
            rows, levels = np.zeros((u.shape[1] + 1, last - first)), np.zeros(u.shape[1] + 1)
            rows[:-1], levels[:-1], rows[-1, 0] = u.T, u[0], 1.0
            decay_rows(f, rows, levels)
            place = 0
            for answer, level, size, delay in zip(rows, levels / float(f.sum()), form.sizes, form.delays, strict=False):
                for k in range(size):
                    lay_shifted(out[first:last, place + k], answer, delay + k, level)
                place += size
            for k in range(n):
                out[first + k : last, offset + 1 + index * n + k] = rows[-1, : last - first - k]

    def first_columns(self, index: int) -> Array:
        """Return the lagged inputs before a log: every lag stands at the first value."""
        return np.repeat(self.data.u[index][0], self.form.sizes)

    def profiled(self, f: Array) -> tuple[float, Array]:
        """Return the least cost that a denominator allows, and all values.

        Parameters
        ----------
        f : ndarray, shape (order + 1,)
            Denominator, monic.

        Returns
        -------
        tuple of float and ndarray, shape (p,)
            Sum of squared residuals, and values.
        """
        n_b, columns = self.form.n_b, self.linear_columns(f)
        values, cost = least_squares(columns, self.y, self.counted)
        return cost, np.concatenate([values[:n_b], f[1:], values[n_b:]])

    def jacobian(self, theta: Array) -> tuple[Array, Array]:
        """Return the output and its derivative by every value.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            All values.

        Returns
        -------
        tuple of ndarray, shapes (n,) and (n, p)
            Output and derivatives, scaled.
        """
        jacobian = np.zeros((self.y.size, theta.size), order="F")
        return self._lay(theta, jacobian), jacobian

    def _lay(self, theta: Array, jacobian: Array) -> Array:
        """Return the output; its derivatives go into an array that was zero, or has been laid out by this before."""
        n_b, n = self.form.n_b, self.form.order
        f = np.concatenate([[1.0], theta[n_b : n_b + n]])
        self._lay_linear(f, jacobian, n_b + n)
        output = jacobian[:, :n_b] @ theta[:n_b] + jacobian[:, n_b + n :] @ theta[n_b + n :]
        for index, first in enumerate(self.bounds[:-1]):
            part = slice(int(first), int(self.bounds[index + 1]))
            # before the log the input stood at its first value, and so did what it drives
            before = float(self.first_columns(index) @ theta[:n_b]) / float(f.sum())
            moved = -(output[part] - theta[n_b + n])[None, :]
            decay_rows(f, moved, np.array([-before]))
            for k in range(1, n + 1):
                lay_shifted(jacobian[part, n_b + k - 1], moved[0], k, -before / float(f.sum()))
        return output

    def descend(
        self, theta: Array, *, bounded: bool = False, least_gain: float = 0.0, most_steps: int = MOST_STEPS
    ) -> LinearFit:
        """Return the minimum that one start leads to.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            All values.
        bounded : bool
            Whether every time constant must stay within the record.
        least_gain : float
            As `levenberg` takes it [dimensionless].
        most_steps : int
            Evaluations at most.
        """
        n_b, n = self.form.n_b, self.form.order
        jacobian = np.zeros((self.y.size, theta.size), order="F")

        def at(values: Array) -> tuple[float, Array, Array]:
            left = self._lay(values, jacobian) - self.y
            return self.counted.square(left), *self.counted.normal_equations(jacobian, left)

        # poles within a circle are those of the polynomial stretched by its radius within the unit circle
        stretched = longest_pole(self.data.longest) ** -np.arange(1.0, n + 1.0)

        poles, circle = slice(n_b, n_b + n), stretched if bounded else np.ones(n)

        def acceptable(values: Array) -> bool:
            f = values[poles]
            return settles(f) and (not bounded or bool(stable(f * stretched)))

        cost, best = levenberg(
            at,
            theta,
            acceptable,
            tolerance=TOLERANCE,
            most_steps=most_steps,
            least_gain=least_gain,
            within=lambda now, gram, slope, damping: stable_step(now, gram, slope, damping, poles, circle),
        )
        return LinearFit(self.form, best, cost, bounded)


def fit_linear(
    form: Form, data: Channels, starts: Sequence[Array] = (), *, bounded: bool = False, least_gain: float = 0.0
) -> LinearFit:
    """Return the best linear model of one form: of the three best starts, what leads after a few steps goes on alone.

    Parameters
    ----------
    data : Channels
        Scaled.
    starts : sequence of ndarray, shape (n + 1,)
        Denominators to begin at beside those that are searched; where some are given, only they are.
    bounded : bool
        Whether every time constant must stay within the record.
    least_gain : float
        As `levenberg` takes it [dimensionless].

    Returns
    -------
    LinearFit
        The lowest minimum found.
    """
    problem = Problem(form, data)
    tried = list(starts) or [*_steiglitz_mcbride(problem), *_searched(problem)]
    radius = longest_pole(data.longest) ** 1.5 if bounded else 1.0 - 0.3 / data.longest
    ranked = sorted((problem.profiled(held_within(f, data.longest, radius)) for f in tried), key=lambda one: one[0])
    kept: list[tuple[float, Array]] = []
    for cost, theta in ranked:
        if len(kept) < 3 and all(cost - other > 1e-7 * cost for other, _ in kept):
            kept.append((cost, theta))
    theta = kept[0][1]
    if len(kept) > 1:
        begun = (problem.descend(x, bounded=bounded, least_gain=least_gain, most_steps=FIRST_STEPS) for _, x in kept)
        theta = min(begun, key=lambda fit: fit.cost).theta
    return problem.descend(theta, bounded=bounded, least_gain=least_gain)


def fit_coarsely(form: Form, data: Channels, starts: Sequence[Array] = (), *, bounded: bool = False) -> LinearFit:
    """Return the best linear model of one form, as near to its minimum as a comparison of models needs.

    Parameters
    ----------
    data : Channels
        Scaled.
    starts : sequence of ndarray, shape (n + 1,)
        As `fit_linear` takes them.
    bounded : bool
        Likewise.

    Returns
    -------
    LinearFit
        The lowest minimum found.
    """
    return fit_linear(form, data, starts, bounded=bounded, least_gain=COARSE)


def extended(fit: LinearFit) -> list[Array]:
    """Return denominators of one order more that hold a minimum: a real pole is added, which zeros can cancel."""
    return [np.convolve(fit.f, [1.0, -pole]) for pole in SLOWER]


def _steiglitz_mcbride(problem: Problem) -> list[Array]:
    """Return denominators of the iteration of Steiglitz and McBride (1965), begun at ARX; gaps end a run of rows."""
    form, n, n_samples = problem.form, problem.form.order, problem.data.longest
    f, found = np.concatenate([[1.0], np.zeros(n)]), list[Array]()
    for _ in range(PASSES):
        rows, wanted = list[Array](), list[Array]()
        for y, u in zip(problem.data.y, problem.data.u, strict=True):
            columns = columns_of(form, u)
            known = np.isfinite(y)
            whole = np.where(known, y, np.interp(np.arange(y.size), np.flatnonzero(known), y[known]))
            series = np.vstack([columns.T, np.ones(y.size), whole])
            decay_rows(f, series, np.zeros(series.shape[0]))
            out = series[-1]
            past = np.column_stack([np.concatenate([np.zeros(k), out[:-k]]) for k in range(1, n + 1)])
            near = np.convolve(~known, np.ones(n + 1))[: y.size] == 0.0
            near[: min(n + max(form.delays), y.size - 1)] = False
            rows.append(np.column_stack([series[:-1].T, -past])[near])
            wanted.append(out[near])
        values = least_squares(np.concatenate(rows), np.concatenate(wanted))[0]
        new = held_within(np.concatenate([[1.0], values[form.n_b + 1 :]]), n_samples, 1.0 - 0.3 / n_samples)
        found.append(new)
        if np.abs(new - f).max() < 1e-6:
            break
        f = new
    return [found[0], found[len(found) // 2], found[-1]]


def _searched(problem: Problem) -> list[Array]:
    """Return the denominator of the search for the global minimum, of one input without its mean."""
    form, data = problem.form, problem.data
    if len(form.sizes) > 1 or data.longest * len(data.y) > MOST_SEARCHED:
        return []
    found: list[Array] = []
    bounds = problem.bounds.astype(np.int64)
    for index, (size, delay) in enumerate(zip(form.sizes, form.delays, strict=True)):
        u = np.concatenate([one[:, index] for one in data.u])
        pair = Experiments(u, np.where(problem.used, problem.y, 0.0), problem.used, bounds)
        structure = Structure(size, form.order, delay)
        # what is found there is a start: the best after a few steps goes on alone
        theta = descend_from(structure, screened(structure, pair)[0][1], pair, FINAL_STEPS)[1]
        found.append(np.concatenate([[1.0], theta[size : size + form.order]]))
    return found


def quick_fit(form: Form, data: Channels) -> float:
    """Return the cost of the best denominator that the iteration of Steiglitz and McBride passes, undescended."""
    problem = Problem(form, data)
    return min(problem.profiled(f)[0] for f in _steiglitz_mcbride(problem))
