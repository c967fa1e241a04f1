"""A linear model in the data's scale: its free run and its JSON form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.dynamics import OutputErrorDynamics
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem


@dataclass(frozen=True, eq=False)
class LinearDynamics(OutputErrorDynamics):
    """Transfer functions with one denominator, and an offset.

    Parameters
    ----------
    theta : ndarray, shape (p,)
        Numerators, denominator without its leading 1, offset.
    """

    form: Form
    theta: Array
    kind: ClassVar[str] = "linear"

    @property
    def n_values(self) -> int:
        """Fitted coefficients."""
        return self.theta.size

    @property
    def f(self) -> Array:
        """Denominator, monic."""
        n_b = self.form.n_b
        return np.concatenate([[1.0], self.theta[n_b : n_b + self.form.order]])

    @property
    def level(self) -> float:
        """Output at zero inputs [scaled]."""
        return float(self.theta[-1])

    def transfer_functions(self) -> list[tuple[Array, Array]]:
        """Return numerator and denominator from each input [scaled], in powers of the delay operator."""
        parts = np.split(self.theta[: self.form.n_b], np.cumsum(self.form.sizes)[:-1])
        return [
            (np.concatenate([np.zeros(delay), b]), self.f) for b, delay in zip(parts, self.form.delays, strict=True)
        ]

    def gain_slopes(self) -> Array:
        """Return the derivative of the steady gain from each input by numerators and denominator, shape (m, p)."""
        total, ends = float(self.f.sum()), np.cumsum([0, *self.form.sizes])
        slopes = np.zeros((len(self.form.sizes), self.form.n_b + self.form.order))
        for k, slope in enumerate(slopes):
            own = slice(int(ends[k]), int(ends[k + 1]))
            slope[own] = 1.0 / total
            slope[self.form.n_b :] = -float(self.theta[own].sum()) / total**2
        return slopes

    def undetermined_outputs(self, length: int) -> int:
        """Return how many first outputs of a log of a given length [samples] depend on inputs from before it."""
        return self.form.undetermined_outputs(length)

    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, with its initial state by least squares of the available outputs.

        With a long dead time it begins with the first output that responds to the log's inputs; outputs before it have
        the same value.
        """
        form, n_b = self.form, self.form.n_b
        columns = Problem(form, Channels((), "", 1.0, (u,), (y,))).linear_columns(self.f)
        driven = columns[:, : n_b + 1] @ np.concatenate([self.theta[:n_b], self.theta[-1:]])
        known = np.isfinite(y)
        if np.count_nonzero(known) <= form.order:
            return driven
        free, begin = columns[:, n_b + 1 :], self.undetermined_outputs(y.size)
        run = driven + free @ np.linalg.lstsq(free[known], (y - driven)[known], rcond=None)[0]
        run[:begin] = run[begin : begin + 1] if begin < y.size else driven
        return run

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        form = self.form
        return {
            "order": form.order,
            "sizes": list(form.sizes),
            "delays": list(form.delays),
            "values": self.theta.tolist(),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "LinearDynamics":
        """Return the dynamics that `to_dict` wrote."""
        form = Form(int(values["order"]), tuple(values["sizes"]), tuple(values["delays"]))
        return cls(form, np.array(values["values"], dtype=np.float64))

    @classmethod
    def of(cls, fit: LinearFit) -> "LinearDynamics":
        """Return the dynamics of a fit."""
        return cls(fit.form, fit.theta[: fit.form.n_values])
