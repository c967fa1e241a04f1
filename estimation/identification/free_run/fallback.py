"""The linear model that replaces a nonlinear one on inputs for which the latter is not determined.

Products are fitted within the range of the training inputs, and a run on others may lead anywhere. How well a run is
determined is found without an output: fits that left out one block of the training data each are run on the same
inputs. The mean square of their deviations from the model, times the number of blocks, is its variance (the jackknife
of groups: Quenouille 1956, Tukey 1958). If that exceeds the linear model's squared error, the linear one is run.

A nonlinearity at the input has few values, on which fits without a block agree more. So its error on held-back blocks
is added, as for the linear model. For polynomials it is not: see decision 353.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.dynamics import Dynamics
from estimation.identification.free_run.linear_dynamics import LinearDynamics


@dataclass(frozen=True, eq=False)
class Fallback:
    """Choice between a nonlinear model and the linear one that is run instead.

    Parameters
    ----------
    linear : LinearDynamics
        Linear model of the same data.
    linear_parts, parts : tuple of LinearDynamics and of Dynamics
        Fits of the linear model and of the nonlinear one that left out one block each.
    error : float
        Error of the linear model on held-back blocks, over the output's deviation [dimensionless].
    share : float
        Samples of the fits without a block over those of both models: for a long log, structures are compared on a
        section, and the chosen one is fitted to all. A variance falls with their number [dimensionless].
    own_error : float
        Error of the nonlinear model on held-back blocks, likewise; zero if it is not counted [dimensionless].
    """

    linear: LinearDynamics
    linear_parts: tuple[LinearDynamics, ...]
    parts: tuple[Dynamics, ...]
    error: float
    share: float = 1.0
    own_error: float = 0.0

    def errors(self, u: Array, y: Array, own: Array) -> tuple[float, float]:
        """Return the expected errors of the nonlinear run and of the linear one.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing. Only initial states are estimated from it.
        own : ndarray, shape (n,)
            Free run of the nonlinear model, scaled.

        Returns
        -------
        tuple of float
            Uncertainty of the nonlinear run, infinite if a run diverges; and the linear model's error on held-back
            blocks together with the uncertainty of its run, over the output's deviation in the fitted data
            [dimensionless].
        """
        return self.judged(u, y, own)[1]

    def judged(self, u: Array, y: Array, own: Array, ends: Array | None = None) -> tuple[Array, tuple[float, float]]:
        """Return the nonlinear run, or the linear one if its error is smaller, and the errors of both.

        An output that integrates has no range. If the linear run goes beyond the ends at which a nonlinear run is
        clipped, the difference is an error that all nonlinear fits share.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y, own : ndarray, shape (n,)
            As in `errors`.
        ends : ndarray, shape (2,), optional
            Least and greatest output that a nonlinear run can have, scaled.

        Returns
        -------
        tuple of ndarray, shape (n,), and tuple of float
            Output, scaled, and the result of `errors`.
        """
        linear = self.linear.run(u, y)
        known = float(np.sqrt(self.share))
        straight = known * jackknife(linear, [one.run(u, y) for one in self.linear_parts])
        beyond = 0.0
        if ends is not None and _is_integrating(self.linear.f, y.size):
            beyond = float(np.sqrt(np.mean((linear - np.clip(linear, *ends)) ** 2)))
        apart = known * jackknife(own, [one.run(u, y) for one in self.parts])
        undetermined = float(np.linalg.norm([self.own_error, apart, beyond]))
        errors = undetermined, float(np.hypot(self.error, straight))
        return linear if linear_stands_in(errors) else own, errors

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            "linear": self.linear.to_dict(),
            "linear_parts": [one.to_dict() for one in self.linear_parts],
            "parts": [one.to_dict() for one in self.parts],
            "error": self.error,
            "share": self.share,
            "own_error": self.own_error,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], part: Callable[[Mapping[str, Any]], Dynamics]) -> "Fallback":
        """Return the fallback that `to_dict` wrote.

        Parameters
        ----------
        part : callable
            Reads a nonlinear model.
        """
        straight = tuple(LinearDynamics.from_dict(one) for one in values["linear_parts"])
        sizes = float(values["error"]), float(values.get("share", 1.0)), float(values.get("own_error", 0.0))
        return cls(LinearDynamics.from_dict(values["linear"]), straight, tuple(map(part, values["parts"])), *sizes)


def linear_stands_in(errors: tuple[float, float] | None) -> bool:
    """Return whether the linear model is run in place of the nonlinear one.

    Parameters
    ----------
    errors : tuple of float or None
        Result of `Fallback.errors`; None without a fallback [dimensionless].
    """
    return errors is not None and not errors[0] < errors[1]


def jackknife(whole: Array, parts: Sequence[Array]) -> float:
    """Return the standard deviation of a run, from fits that left out a group of data each.

    The first group of a record is never left out, so there is one group more than runs.

    Parameters
    ----------
    whole : ndarray, shape (n,)
        Run of the fit to all data.
    parts : sequence of ndarray, shape (n,)
        Runs of the others.

    Returns
    -------
    float
        Root mean square over the run; infinite if one of them is not finite.

    Examples
    --------
    >>> jackknife(np.zeros(2), [np.array([0.1, 0.1]), np.array([-0.1, 0.1])])
    0.14142135623730953
    """
    squares = [float(np.mean((one - whole) ** 2)) for one in parts]
    found = float(np.sqrt(len(squares) * np.mean(squares))) if squares else float("inf")
    return found if np.isfinite(found) else float("inf")


def _is_integrating(f: Array, rows: int) -> bool:
    """Return whether a denominator has a pole that neither settles nor oscillates within a number of rows."""
    roots = np.roots(f)
    return bool(np.any((np.abs(roots) > np.exp(-1.0 / rows)) & (np.abs(np.angle(roots)) < 1.0 / rows)))
