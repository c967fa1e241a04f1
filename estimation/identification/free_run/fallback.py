"""The linear model that stands in for a nonlinear one on inputs that do not determine the latter.

Products are fitted where the training inputs were, and a run on others may lead anywhere. How far a run is determined
is told without an output: fits that left out one block of the training data each are run on the same inputs. Their
squared deviations from the model, times as many as there are blocks, are its variance (the jackknife of groups:
Quenouille 1956, Tukey 1958). Where that is more than the linear model's squared error, the linear one is run.

A nonlinearity at the input has few values, which fits without a block agree on more. What it leaves of held-back blocks
is counted beside, as for the linear model. Of polynomials it is not: see decision 353.
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
        Of the same data.
    linear_parts, parts : tuple of LinearDynamics and of Dynamics
        Fits of the linear model and of the nonlinear one that left out one block each.
    error : float
        Of the linear model on blocks held back, over the output's deviation [dimensionless].
    share : float
        Samples that fits without a block come from, over those that both models were fitted to: of a long log,
        structures are compared on a section, and what is taken is fitted to all. A variance falls with their number
        [dimensionless].
    own_error : float
        Of the nonlinear model on blocks held back, likewise; zero where it is not counted [dimensionless].
    """

    linear: LinearDynamics
    linear_parts: tuple[LinearDynamics, ...]
    parts: tuple[Dynamics, ...]
    error: float
    share: float = 1.0
    own_error: float = 0.0

    def errors(self, u: Array, y: Array, own: Array) -> tuple[float, float]:
        """Return the errors to be expected of the nonlinear run and of the linear one.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing. Only initial states are taken from it.
        own : ndarray, shape (n,)
            Free run of the nonlinear model, scaled.

        Returns
        -------
        tuple of float
            What the nonlinear run is not determined to, infinite where a run has no end; and the linear model's error
            on held-back blocks together with what its run is not determined to, over the output's deviation in the
            fitted data [dimensionless].
        """
        return self.judged(u, y, own)[1]

    def judged(self, u: Array, y: Array, own: Array, ends: Array | None = None) -> tuple[Array, tuple[float, float]]:
        """Return the nonlinear run, or the linear one where that errs less, and the errors of both.

        An output that integrates over the run has no range. What the linear run goes beyond the ends at which a
        nonlinear run is held is an error of the latter that its fits agree on.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y, own : ndarray, shape (n,)
            As `errors` takes them.
        ends : ndarray, shape (2,), optional
            Least and greatest output that a nonlinear run can have, scaled.

        Returns
        -------
        tuple of ndarray, shape (n,), and tuple of float
            Output, scaled, and what `errors` returns.
        """
        linear = self.linear.run(u, y)
        known = float(np.sqrt(self.share))
        straight = known * jackknife(linear, [one.run(u, y) for one in self.linear_parts])
        beyond = 0.0
        if ends is not None and _integrates(self.linear.f, y.size):
            beyond = float(np.sqrt(np.mean((linear - np.clip(linear, *ends)) ** 2)))
        apart = known * jackknife(own, [one.run(u, y) for one in self.parts])
        undetermined = float(np.linalg.norm([self.own_error, apart, beyond]))
        left = float(np.hypot(self.error, straight))
        return own if undetermined < left else linear, (undetermined, left)

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


def jackknife(whole: Array, parts: Sequence[Array]) -> float:
    """Return the standard deviation of a run by those of fits that left out a group of data each.

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
        Root mean square over the run; infinite where one of them is not finite.

    Examples
    --------
    >>> jackknife(np.zeros(2), [np.array([0.1, 0.1]), np.array([-0.1, 0.1])])
    0.14142135623730953
    """
    squares = [float(np.mean((one - whole) ** 2)) for one in parts]
    found = float(np.sqrt(len(squares) * np.mean(squares))) if squares else float("inf")
    return found if np.isfinite(found) else float("inf")


def _integrates(f: Array, rows: int) -> bool:
    """Return whether a denominator has a pole that neither settles nor swings within so many rows."""
    roots = np.roots(f)
    return bool(np.any((np.abs(roots) > np.exp(-1.0 / rows)) & (np.abs(np.angle(roots)) < 1.0 / rows)))
