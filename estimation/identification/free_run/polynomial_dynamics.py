"""A polynomial model in the data's scale: its free run, its prediction one step ahead and its JSON form."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.free_run.data import Channels, Scaling
from estimation.identification.free_run.fallback import Fallback
from estimation.identification.free_run.linear_problem import undetermined_outputs
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.polynomial_fit import PolynomialFit, Runs, ends_of
from estimation.identification.free_run.polynomial_variables import Variables, lagged_signals, products

START_STEPS = 12
"""Refinements of the first outputs of a polynomial run."""

LARGEST_RELEASE_RATIO = 0.6
"""Uncertainty of a run with released products over that with clipped ones, up to which products are released: with four
fits each, a smaller ratio occurs by chance in one case of six (Fisher's ratio of variances) [fraction]."""

SMOOTHING_SAMPLES = (8, 24)
"""Samples through which a constant and a straight line give first outputs without their noise."""


@dataclass(frozen=True, eq=False)
class PolynomialDynamics:
    """A sum of products of lagged signals.

    Parameters
    ----------
    terms : ndarray of int, shape (k, d)
        Variables of each term; -1 stands for 1.
    coefficients : ndarray, shape (k,)
        One per term.
    friction : ndarray, shape (f,)
        Values of the friction; empty without friction.
    fallback : Fallback, optional
        The model that is run on inputs for which this one is not determined.
    """

    variables: Variables
    terms: IntArray
    coefficients: Array
    friction: Array = field(default_factory=lambda: np.empty(0))
    fallback: Fallback | None = None
    kind: ClassVar[str] = "polynomial"

    @property
    def n_values(self) -> int:
        """Fitted coefficients."""
        return self.coefficients.size + self.friction.size

    def undetermined_outputs(self, length: int) -> int:
        """Return how many first outputs of a log of a given length [samples] depend on inputs from before it."""
        return undetermined_outputs(int(self.variables.lag.max(initial=0)), length)

    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, or that of the linear model if that replaces it.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        ndarray, shape (n,)
            Output, scaled.
        """
        return self.judged_run(u, y)[0]

    def judged_run(self, u: Array, y: Array) -> tuple[Array, tuple[float, float] | None]:
        """Return the free run with the expected errors of this model and of the linear one.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        tuple of ndarray, shape (n,), and tuple of float or None
            Output, scaled, and the result of `Fallback.errors`; None without a linear model.
        """
        own = self.own_run(u, y)
        if self.fallback is None:
            return own, None
        told = self.fallback.judged(u, y, own, ends_of(self.variables, self.terms))
        single, held = lagged_signals(self.variables, u, own)
        if np.array_equal(single, held):
            return told
        # outside the fitted range, products are clipped farther out if fits without a block agree better on that run
        parts = (
            one._with_wider_clipping() if isinstance(one, PolynomialDynamics) else one for one in self.fallback.parts
        )
        released, farther = self._with_wider_clipping(), replace(self.fallback, parts=tuple(parts))
        freed = farther.judged(u, y, released.own_run(u, y), ends_of(released.variables, self.terms))
        return freed if freed[1][0] < LARGEST_RELEASE_RATIO * told[1][0] else told

    def _with_wider_clipping(self) -> "PolynomialDynamics":
        """Return the same products, clipped farther out."""
        return replace(self, variables=self.variables.with_wider_clipping(), fallback=None)

    def own_run(self, u: Array, y: Array) -> Array:
        """Return the free run, with its first outputs fitted to the available ones; NaN from where it diverges.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        ndarray, shape (n,)
            Output, scaled.
        """
        data = Channels((), "", 1.0, (np.ascontiguousarray(u),), (y,))
        runs, early = (Runs(self.variables, self.terms, data, early=one) for one in (False, True))
        first = self._begun(early, y)
        begin = runs.begins[0] - self.variables.n_start
        if not begin or np.count_nonzero(runs.used) <= 4 * self.variables.n_start:
            return first
        # from here on, inputs before the log have no effect, and the state has its own fit
        return np.concatenate([first[:begin], self._begun(runs, y)[begin:]])

    def _begun(self, runs: Runs, y: Array) -> Array:
        """Return the run whose first outputs fit the available ones best; NaN from where it diverges."""
        measured = runs.start_values()
        if np.count_nonzero(runs.used) <= 4 * measured.size:
            return self._refined(runs, y, measured, 1)[0]
        best, cost = self._refined(runs, y, measured, START_STEPS)
        # with fast sampling, noise of the first outputs is a speed, and may throw the run where no step leads back
        smooth = smoothed_starts(y, runs.begins[0] - measured.size, measured.size)
        costs = [self._refined(runs, y, one, 1)[1] for one in smooth]
        if smooth and min(costs) < cost:
            other, less = self._refined(runs, y, smooth[int(np.argmin(costs))], START_STEPS)
            best = other if less < cost else best
        return best

    def _refined(self, runs: Runs, y: Array, start: Array, steps: int) -> tuple[Array, float]:
        """Return the best run after refinement of first outputs, and its squared error; infinite if there is none."""
        known, equations = runs.used, NormalEquations(runs, runs.ends)
        best, cost = np.full(y.size, np.nan), np.inf
        for step in range(steps):
            ran = equations.outputs(np.concatenate([self.coefficients, start, self.friction]))
            if ran is None:
                break
            left = (y - ran)[known]
            now = float(left @ left)
            if not now < cost * (1.0 - 1e-6):
                break
            best, cost = ran, now
            if step + 1 == steps:  # no step follows that would need slopes
                break
            moved = equations.start_slopes()[known]
            if not np.isfinite(moved).all():
                break
            start = start + np.linalg.lstsq(moved, left, rcond=None)[0]
        return best, cost

    def one_step(self, u: Array, y: Array) -> Array:
        """Return the one-step prediction from measured past outputs; NaN if some are missing.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        ndarray, shape (n,)
            Output, scaled.
        """
        out = products(self.variables, self.terms, u, y) @ self.coefficients
        if self.friction.size:
            stay = np.concatenate([y[:1], y[:-1]]) if self.variables.friction == "position" else self.friction[2]
            low, high = self.friction[:2]
            out = np.where(out - stay > high, out - high, np.where(stay - out > low, out + low, stay + 0.0 * out))
        out[: self.variables.n_start] = np.nan
        return out

    def nonlinearity(self, by: Scaling, sample_time: float) -> dict[str, Any] | None:
        """Return the friction of an output: its deceleration of downward and upward motion, and the resting place.

        Parameters
        ----------
        by : Scaling
            Of the fitted data.
        sample_time : float
            Between samples [s].

        Returns
        -------
        dict or None
            For a velocity ``below`` and ``above`` in its unit per second, for a position in its unit per second
            squared.
        """
        if not self.friction.size:
            return None
        moves = by.y_std / sample_time ** (2 if self.variables.friction == "position" else 1)
        told = {"below": moves * self.friction[0], "above": moves * self.friction[1]}
        told |= {"rest": by.y_mean + by.y_std * self.friction[2]} if self.friction.size > 2 else {}
        values = {name: {"value": float(one), "std": None, "ci95": None} for name, one in told.items()}
        return {"kind": f"{self.variables.friction}-friction", **values}

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        one = self.variables
        return {
            "source": one.source.tolist(),
            "lag": one.lag.tolist(),
            "limits": one.limits.tolist(),
            "terms": [[int(v) for v in term if v >= 0] for term in self.terms],
            "values": self.coefficients.tolist(),
            **({"friction": {"of": one.friction, "values": self.friction.tolist()}} if one.friction else {}),
            **({} if self.fallback is None else {"fallback": self.fallback.to_dict()}),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "PolynomialDynamics":
        """Return the dynamics that `to_dict` wrote."""
        source, lag = (np.array(values[name], dtype=np.int64) for name in ("source", "lag"))
        rub = values.get("friction", {"of": "", "values": []})
        limits = np.array(values["limits"], dtype=np.float64).reshape(-1, 2)
        variables = Variables(source, lag, limits, str(rub["of"]))
        friction = np.array(rub["values"], dtype=np.float64)
        if friction.size != variables.n_friction:
            raise ValueError(f"friction of {variables.n_friction} values is needed, got {friction.size}")
        terms = np.full((len(values["terms"]), 3), -1, dtype=np.int64)
        for row, term in zip(terms, values["terms"], strict=True):
            row[: len(term)] = term
        other = values.get("fallback")
        fallback = None if other is None else Fallback.from_dict(other, cls.from_dict)
        return cls(variables, terms, np.array(values["values"], dtype=np.float64), friction, fallback)

    @classmethod
    def of(cls, fit: PolynomialFit) -> "PolynomialDynamics":
        """Return the dynamics of a fit."""
        return cls(fit.variables, fit.terms, fit.coefficients, fit.friction)


def smoothed_starts(y: Array, first: int, count: int) -> list[Array]:
    """Return first outputs on constants and straight lines through the samples after them.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Output; NaN where missing.
    first : int
        Sample of the first of them.
    count : int
        Number of outputs.

    Returns
    -------
    list of ndarray, shape (count,)
        Empty if there are too few outputs.

    Examples
    --------
    >>> smoothed_starts(np.arange(8.0), 0, 2)[1].round(6).tolist()
    [0.0, 1.0]
    """
    found = list[Array]()
    for length in SMOOTHING_SAMPLES:
        part = y[first : first + length]
        there = np.flatnonzero(np.isfinite(part))
        for degree in (0, 1):
            if there.size > degree + 1:
                line = np.polynomial.Polynomial.fit(there, part[there], degree)
                found.append(np.asarray(line(np.arange(count)), dtype=np.float64))
    return found
