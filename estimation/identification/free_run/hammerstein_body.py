"""A linear model behind a bent input, as it runs free, in the data's scale, with its JSON form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.bends import KINDS
from estimation.identification.free_run.data import Scaling
from estimation.identification.free_run.hammerstein_fit import HammersteinFit
from estimation.identification.free_run.linear_body import LinearBody

PLACES = 5
"""Places of a play at the first sample that are tried."""


@dataclass(frozen=True, eq=False)
class HammersteinBody:
    """A nonlinearity at the input, and transfer function and offset behind it.

    Parameters
    ----------
    bend : str
        One of `KINDS`.
    values, std : ndarray, shape (k,)
        What it was fitted to be, and standard deviations, scaled.
    linear : LinearBody
        What follows.
    """

    bend: str
    values: Array
    std: Array
    linear: LinearBody
    kind: ClassVar[str] = "hammerstein"

    @property
    def n_values(self) -> int:
        """Fitted coefficients."""
        return self.values.size + self.linear.n_values

    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, its initial state by least squares of the outputs that are there.

        Parameters
        ----------
        u : ndarray, shape (n, 1)
            Input, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        ndarray, shape (n,)
            Output, scaled.
        """
        kind, known = KINDS[self.bend], np.isfinite(y)
        begun = u[0, 0] + self.values[0] * np.linspace(-1.0, 1.0, PLACES) if kind.remembers else np.zeros(1)
        if not known.any():
            begun = begun[len(begun) // 2 :][:1]
        runs = [self.linear.run(kind.bend(u[:, 0], self.values, float(one))[0][:, None], y) for one in begun]
        return min(runs, key=lambda run: float(np.sum((run[known] - y[known]) ** 2)))

    def one_step(self, u: Array, y: Array) -> Array:
        """Return the free run: noise is taken to be the sensor's, so what was measured before tells nothing.

        Parameters
        ----------
        u : ndarray, shape (n, 1)
            Input, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        ndarray, shape (n,)
            Output, scaled.
        """
        return self.run(u, y)

    def nonlinearity(self, by: Scaling) -> dict[str, Any]:
        """Return kind and values in the input's unit, each with its standard deviation and 95 % interval."""
        from estimation.finding import interval_95

        kind, size = KINDS[self.bend], float(by.u_std[0])
        found: dict[str, Any] = {"kind": self.bend}
        for name, value, std in zip(kind.names, self.values, self.std, strict=True):
            here = size * float(value) + (float(by.u_mean[0]) if kind.level else 0.0)
            known = bool(np.isfinite(std))
            interval = list(interval_95(here, size * float(std))) if known else None
            found[name] = {"value": here, "std": size * float(std) if known else None, "ci95": interval}
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        std = [float(one) if np.isfinite(one) else None for one in self.std]
        return {"bend": self.bend, "values": self.values.tolist(), "std": std, "linear": self.linear.to_dict()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "HammersteinBody":
        """Return the body that `to_dict` wrote."""
        std = [np.inf if one is None else one for one in values["std"]]
        if values["bend"] not in KINDS:
            raise ValueError(f"a nonlinearity among {', '.join(KINDS)} is needed, got {values['bend']!r}")
        linear = LinearBody.from_dict(values["linear"])
        return cls(str(values["bend"]), np.array(values["values"], dtype=np.float64), np.array(std), linear)

    @classmethod
    def of(cls, fit: HammersteinFit, std: Array) -> "HammersteinBody":
        """Return the body of a fit.

        Parameters
        ----------
        std : ndarray, shape (k,)
            Standard deviations of the nonlinearity's values, scaled.
        """
        return cls(fit.kind, fit.values, std, LinearBody.of(fit.linear))
