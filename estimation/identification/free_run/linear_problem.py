"""A linear model's size and values, and the free run's sensitivities to them on given data."""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.lagged_columns import lay_shifted
from estimation.identification.free_run.least_squares import Counted, least_squares
from estimation.identification.free_run.linear_kernel import decay_rows, record_length_pole, settles
from estimation.identification.search.descent import stable
from estimation.identification.search.levenberg import levenberg
from estimation.identification.search.reflections import stable_step

TOLERANCE, MOST_STEPS = 1e-9, 80
"""Relative gain of the cost below which a descent ends, and most evaluations."""

LONG_DEAD_TIME, LONG_SHARE = 20, 20
"""Dead time above which the outputs before the first response are left out of a fit, and inverse share of a log above
which they are as well, if that is less. For shorter ones the free initial state and the input's first value determine
nearly all of them [samples, dimensionless]."""


def long_dead_time(length: int) -> int:
    """Return the longest dead time that is still a short one in a log of some length, both in samples.

    Examples
    --------
    >>> long_dead_time(1000), long_dead_time(200)
    (20, 10)
    """
    return min(LONG_DEAD_TIME, length // LONG_SHARE)


def undetermined_outputs(dead_time: int, length: int) -> int:
    """Return how many first outputs of a log are left out, because they depend on inputs from before it.

    Parameters
    ----------
    dead_time, length : int
        The longest of the inputs, and of the log [samples].

    Returns
    -------
    int
        The dead time, if it is a long one; for a shorter log all of it [samples].

    Examples
    --------
    >>> [undetermined_outputs(*one) for one in ((12, 1000), (80, 1000), (12, 200), (80, 60))]
    [0, 80, 12, 60]
    """
    return min(dead_time, length) if dead_time > long_dead_time(length) else 0


@dataclass(frozen=True)
class Form:
    """Size of a linear model.

    Parameters
    ----------
    order : int
        Denominator coefficients without the leading 1.
    sizes, delays : tuple of int
        Numerator coefficients of each input, and its dead time in samples.
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

    def undetermined_outputs(self, length: int) -> int:
        """Return how many first outputs of a log of a given length [samples] depend on inputs from before it."""
        return undetermined_outputs(max(self.delays), length)


@dataclass(frozen=True, eq=False)
class LinearFit:
    """Result of a linear fit, in the data's scale.

    Parameters
    ----------
    theta : ndarray, shape (p,)
        Numerators, denominator without its leading 1, offset, and the initial state of each log; then the difference of
        each log's offset from the first one's, if logs have their own.
    cost : float
        Sum of squared residuals; outputs that are left out count as the average [dimensionless].
    bounded : bool
        Whether time constants were limited to the record.
    integrates : bool
        Whether a pole at 1 was given.
    """

    form: Form
    theta: Array
    cost: float
    bounded: bool = False
    integrates: bool = False

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
        told = int(np.count_nonzero(self.used))
        self.begins = [form.undetermined_outputs(y.size) for y in data.y]
        for first, begin in zip(self.bounds[:-1], self.begins, strict=True):
            self.used[first : first + begin] = False
        self.share = told / max(int(np.count_nonzero(self.used)), 1)
        self.counted = Counted(self.used)
        self.n_own = len(data.y) - 1 if data.own_offsets else 0
        self.n_parameters = form.n_values + form.order * len(data.y) + self.n_own

    def linear_columns(self, f: Array) -> Array:
        """Return the output's derivative by numerators, offset and initial states for a denominator.

        Parameters
        ----------
        f : ndarray, shape (order + 1,)
            Denominator, monic.

        Returns
        -------
        ndarray, shape (n, n_b + 1 + order * logs), or more
            Numerators, offset, initial states of each log, and their offsets where they have their own.
        """
        out = np.zeros((self.y.size, self.n_parameters - self.form.order), order="F")
        self._lay_linear(f, out, self.form.n_b)
        return out

    def _lay_linear(self, f: Array, out: Array, offset: int) -> None:
        """Write the linear columns to their places: numerators first, the offset and initial states from a column on.

        Rows without an effect of initial states are not written: they are zero.
        """
        form, n = self.form, self.form.order
        out[:, offset] = 1.0
        for index, u in enumerate(self.data.u):
            first, last = int(self.bounds[index]), int(self.bounds[index + 1])
            # before the log each input had its first value, so lags are shifts, filtered or not
            rows, levels = np.zeros((u.shape[1] + 1, last - first)), np.zeros(u.shape[1] + 1)
            rows[:-1], levels[:-1], rows[-1, 0] = u.T, u[0], 1.0
            decay_rows(f, rows, levels)
            place = 0
            for answer, level, size, delay in zip(rows, levels / float(f.sum()), form.sizes, form.delays, strict=False):
                for k in range(size):
                    lay_shifted(out[first:last, place + k], answer, delay + k, level)
                place += size
            begin = first + self.begins[index]
            for k in range(min(n, last - begin)):
                out[begin + k : last, offset + 1 + index * n + k] = rows[-1, : last - begin - k]
            if index and self.n_own:
                out[first:last, index - 1 - self.n_own] = 1.0

    def first_columns(self, index: int) -> Array:
        """Return the lagged inputs before a log: every lag has the first value."""
        return np.repeat(self.data.u[index][0], self.form.sizes)

    def profiled(self, f: Array) -> tuple[float, Array]:
        """Return the least cost for a denominator, and all values.

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
        return self.share * cost, np.concatenate([values[:n_b], f[1:], values[n_b:]])

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
        """Return the output; its derivatives are written into an array that was zero, or was filled here before."""
        n_b, n = self.form.n_b, self.form.order
        f = np.concatenate([[1.0], theta[n_b : n_b + n]])
        self._lay_linear(f, jacobian, n_b + n)
        output = jacobian[:, :n_b] @ theta[:n_b] + jacobian[:, n_b + n :] @ theta[n_b + n :]
        for index, first in enumerate(self.bounds[:-1]):
            part = slice(int(first), int(self.bounds[index + 1]))
            # before the log the input had its first value, and the output that it drives was steady
            before = float(self.first_columns(index) @ theta[:n_b]) / float(f.sum())
            level = theta[n_b + n] + (theta[index - 1 - self.n_own] if index and self.n_own else 0.0)
            moved = -(output[part] - level)[None, :]
            decay_rows(f, moved, np.array([-before]))
            for k in range(1, n + 1):
                lay_shifted(jacobian[part, n_b + k - 1], moved[0], k, -before / float(f.sum()))
        return output

    def descend(
        self, theta: Array, *, bounded: bool = False, least_gain: float = 0.0, most_steps: int = MOST_STEPS
    ) -> LinearFit:
        """Return the minimum from one start.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            All values.
        bounded : bool
            Whether every time constant must be shorter than the record.
        least_gain : float
            As `levenberg` takes it [dimensionless].
        most_steps : int
            Most evaluations.
        """
        n_b, n = self.form.n_b, self.form.order
        jacobian = np.zeros((self.y.size, theta.size), order="F")

        def at(values: Array) -> tuple[float, Array, Array]:
            left = self._lay(values, jacobian) - self.y
            return self.counted.square(left), *self.counted.normal_equations(jacobian, left)

        # all poles are within radius r if those with the coefficients f_k r^-k are within the unit circle
        stretched = (
            record_length_pole(self.data.informative_samples) ** -np.arange(1.0, n + 1.0) if bounded else np.ones(n)
        )

        poles = slice(n_b, n_b + n)

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
            within=lambda now, gram, slope, damping: stable_step(now, gram, slope, damping, poles, stretched),
        )
        return LinearFit(self.form, best, self.share * cost, bounded)
