"""A linear model whose output saturates or is held by stops, in the data's scale: its free run and its JSON form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.limited_output import LimitedProblem, Limits
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Form, LinearFit


@dataclass(frozen=True, eq=False)
class LimitedDynamics(LinearDynamics):
    """Transfer functions with one denominator, an offset, and limits of the output."""

    limits: Limits
    kind: ClassVar[str] = "limited"

    @property
    def n_values(self) -> int:
        """Fitted coefficients, including limits."""
        return self.theta.size + self.limits.count

    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, with its initial state by least squares of the available outputs."""
        problem = LimitedProblem(self.form, Channels((), "", 1.0, (u,), (y,)), self.limits)
        if np.count_nonzero(np.isfinite(y)) > self.form.order:
            return problem.jacobian(problem.with_initial_states(self.theta))[0]
        return problem.jacobian(np.concatenate([self.theta, np.zeros(self.form.order)]))[0]

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        return {**super().to_dict(), "limits": self.limits.to_dict()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "LimitedDynamics":
        """Return the dynamics that `to_dict` wrote."""
        form = Form(int(values["order"]), tuple(values["sizes"]), tuple(values["delays"]))
        return cls(form, np.array(values["values"], dtype=np.float64), Limits.from_dict(values["limits"]))

    @classmethod
    def within(cls, fit: LinearFit, limits: Limits) -> "LimitedDynamics":
        """Return the dynamics of a fit between limits."""
        return cls(fit.form, fit.theta[: fit.form.n_values], limits)
