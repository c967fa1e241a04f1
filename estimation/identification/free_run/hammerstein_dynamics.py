"""A linear model behind a nonlinearity at its input, in the data's scale: its free run and its JSON form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from estimation.arrays import Array
from estimation.finding import interval_95
from estimation.identification.free_run.data import Scaling
from estimation.identification.free_run.dynamics import OutputErrorDynamics
from estimation.identification.free_run.fallback import Fallback
from estimation.identification.free_run.hammerstein_fit import HammersteinFit
from estimation.identification.free_run.input_nonlinearity import NONLINEARITIES
from estimation.identification.free_run.linear_dynamics import LinearDynamics

MOST_INITIAL_STATES = 5
"""Initial states of a play that are tried."""


@dataclass(frozen=True, eq=False)
class HammersteinDynamics(OutputErrorDynamics):
    """A nonlinearity at the input, and transfer function and offset behind it.

    Parameters
    ----------
    at_input : str
        One of `NONLINEARITIES`.
    values, std : ndarray, shape (k,)
        Fitted values and standard deviations, scaled.
    linear : LinearDynamics
        What follows the nonlinearity.
    fallback : Fallback, optional
        The model that is run on inputs for which this one is not determined.
    """

    at_input: str
    values: Array
    std: Array
    linear: LinearDynamics
    fallback: Fallback | None = None
    kind: ClassVar[str] = "hammerstein"

    @property
    def n_values(self) -> int:
        """Fitted coefficients."""
        return self.values.size + self.linear.n_values

    def undetermined_outputs(self, length: int) -> int:
        """Return how many first outputs of a log of a given length [samples] depend on inputs from before it."""
        return self.linear.form.undetermined_outputs(length)

    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, or that of the linear model if that replaces it."""
        return self.judged_run(u, y)[0]

    def judged_run(self, u: Array, y: Array) -> tuple[Array, tuple[float, float] | None]:
        """Return the free run with the expected errors of this model and of the linear one.

        Parameters
        ----------
        u : ndarray, shape (n, 1)
            Input, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        tuple of ndarray, shape (n,), and tuple of float or None
            Output, scaled, and the result of `Fallback.errors`; None without a linear model.
        """
        own = self._own_run(u, y)
        return (own, None) if self.fallback is None else self.fallback.judged(u, y, own)

    def _own_run(self, u: Array, y: Array) -> Array:
        """Return the free run, with its initial state by least squares of the available outputs."""
        kind, known = NONLINEARITIES[self.at_input], np.isfinite(y)
        begun = (
            u[0, 0] + self.values[0] * np.linspace(-1.0, 1.0, MOST_INITIAL_STATES) if kind.remembers else np.zeros(1)
        )
        if not known.any():
            begun = begun[len(begun) // 2 :][:1]
        runs = [self.linear.run(kind.apply(u[:, 0], self.values, float(one))[0][:, None], y) for one in begun]
        return min(runs, key=lambda run: float(np.sum((run[known] - y[known]) ** 2)))

    def nonlinearity(self, by: Scaling) -> dict[str, Any]:
        """Return kind and values in the input's unit, each with its standard deviation and 95 % interval."""
        kind, size = NONLINEARITIES[self.at_input], float(by.u_std[0])
        found: dict[str, Any] = {"kind": self.at_input}
        for name, value, std in zip(kind.names, self.values, self.std, strict=True):
            here = size * float(value) + (float(by.u_mean[0]) if kind.level else 0.0)
            known = bool(np.isfinite(std))
            interval = list(interval_95(here, size * float(std))) if known else None
            found[name] = {"value": here, "std": size * float(std) if known else None, "ci95": interval}
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        std = [float(one) if np.isfinite(one) else None for one in self.std]
        other = {} if self.fallback is None else {"fallback": self.fallback.to_dict()}
        linear = self.linear.to_dict()
        return {"bend": self.at_input, "values": self.values.tolist(), "std": std, "linear": linear, **other}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "HammersteinDynamics":
        """Return the dynamics that `to_dict` wrote."""
        std = [np.inf if one is None else one for one in values["std"]]
        if values["bend"] not in NONLINEARITIES:
            raise ValueError(f"a nonlinearity among {', '.join(NONLINEARITIES)} is needed, got {values['bend']!r}")
        linear = LinearDynamics.from_dict(values["linear"])
        other = values.get("fallback")
        fallback = None if other is None else Fallback.from_dict(other, cls.from_dict)
        return cls(str(values["bend"]), np.array(values["values"], dtype=np.float64), np.array(std), linear, fallback)

    @classmethod
    def of(cls, fit: HammersteinFit, std: Array) -> "HammersteinDynamics":
        """Return the dynamics of a fit.

        Parameters
        ----------
        std : ndarray, shape (k,)
            Standard deviations of the nonlinearity's values, scaled.
        """
        return cls(fit.kind, fit.values, std, LinearDynamics.of(fit.linear))
