"""A linear model whose output is measured without its sign, in the data's scale: its free run and its JSON form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.absolute_output import AbsoluteFit, lagged
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.dynamics import OutputErrorDynamics
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Problem

PASSES = 10
"""Most iterations of signs from a run and initial states fitted to signed outputs."""

BEGINNINGS = (0.02, 0.1)
"""Shares of a log over which the output is first assumed to have one sign."""


@dataclass(frozen=True, eq=False)
class AbsoluteDynamics(OutputErrorDynamics):
    """Transfer functions and offset, the absolute value, and a lag.

    Parameters
    ----------
    zero : float
        The sensor's zero, over the output's deviation from its mean [dimensionless].
    lag : float
        Pole of the lag; zero if there is none [dimensionless].
    linear : LinearDynamics
        What precedes the absolute value; its output is relative to the sensor's zero.
    """

    zero: float
    lag: float
    linear: LinearDynamics
    kind: ClassVar[str] = "absolute"

    @property
    def n_values(self) -> int:
        """Fitted coefficients."""
        return self.linear.n_values + (self.lag > 0.0)

    def undetermined_outputs(self, length: int) -> int:
        """Return how many first outputs of a log of a given length [samples] depend on inputs from before it."""
        return self.linear.form.undetermined_outputs(length)

    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, with its initial state by least squares of the available outputs."""
        form, size = self.linear.form, y - self.zero
        columns = Problem(form, Channels((), "", 1.0, (u,), (y,))).linear_columns(self.linear.f)
        driven = columns[:, : form.n_b + 1] @ np.concatenate([self.linear.theta[: form.n_b], self.linear.theta[-1:]])
        free, known = columns[:, form.n_b + 1 :], np.isfinite(y)
        rest = self._measured(driven)
        if np.count_nonzero(known) <= form.order:
            return self.zero + rest
        runs = [rest]
        for share in BEGINNINGS:
            for side in (1.0, -1.0):
                near = known & (np.arange(y.size) < max(share * y.size, 4 * form.order))
                if np.count_nonzero(near) <= form.order:
                    continue
                state = np.linalg.lstsq(free[near], (side * size - driven)[near], rcond=None)[0]
                runs.append(self._measured(driven + free @ state))
                for _ in range(PASSES):
                    signed = np.where(driven + free @ state < 0.0, -size, size)
                    state = np.linalg.lstsq(free[known], (signed - driven)[known], rcond=None)[0]
                    runs.append(self._measured(driven + free @ state))
        return self.zero + min(runs, key=lambda one: float(np.sum((one - size)[known] ** 2)))

    def _measured(self, signed: Array) -> Array:
        return lagged(np.abs(signed)[None, :], self.lag)[0]

    def nonlinearity(self, sample_time: float) -> dict[str, Any]:
        """Return the kind, and the time constant of the lag behind it.

        Parameters
        ----------
        sample_time : float
            Of the model [s].

        Returns
        -------
        dict
            ``lag_s``, without an interval; zero if there is none [s].
        """
        lag = -sample_time / float(np.log(self.lag)) if self.lag > 0.0 else 0.0
        return {"kind": "absolute-value", "lag_s": {"value": lag, "std": None, "ci95": None}}

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        return {"zero": self.zero, "lag": self.lag, "linear": self.linear.to_dict()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "AbsoluteDynamics":
        """Return the dynamics that `to_dict` wrote."""
        return cls(float(values["zero"]), float(values["lag"]), LinearDynamics.from_dict(values["linear"]))

    @classmethod
    def of(cls, fit: AbsoluteFit, zero: float) -> "AbsoluteDynamics":
        """Return the dynamics of a fit.

        Parameters
        ----------
        zero : float
            The sensor's zero, over the output's deviation from its mean [dimensionless].
        """
        return cls(zero, fit.lag, LinearDynamics.of(fit.linear))
