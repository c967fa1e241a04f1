"""Maximises the innovations' likelihood over a filter's assumptions, parameters and noise levels, by Fisher scoring."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem
from estimation.engine.runner import constant_row
from estimation.tuning.sensitivity import Sensitivity, innovation_sensitivity

LEAST_GAIN = 1e-3
"""The optimiser stops if a further step would gain less than this in log-likelihood [dimensionless]."""

LARGEST_MOVE = 5.0
"""Largest move of a coordinate from its guess in one run of the optimiser [dimensionless]."""


@dataclass(frozen=True)
class Coordinate:
    """One assumption of a filter, as a coordinate of the search.

    Parameters
    ----------
    name : str
        Name in the kernel's row of constants: a parameter, ``q0`` or ``r0`` and so on.
    guess : float
        Its value at coordinate 0 [unit of the row's entry].
    scale : float, optional
        Change per unit of the coordinate [unit of the row's entry]; by default the coordinate is a logarithm.
    floor : float
        Lower limit of a logarithmic entry [unit of the row's entry].
    spread : float
        Prior standard deviation of the coordinate [dimensionless]; infinite if there is no prior.
    """

    name: str
    place: int
    guess: float
    scale: float | None = None
    floor: float = 0.0
    spread: float = float("inf")

    def value(self, u: float) -> tuple[float, float]:
        """Return the entry and its derivative at a value of the coordinate.

        Parameters
        ----------
        u : float
            The coordinate [dimensionless].

        Returns
        -------
        tuple of float
            Entry and slope [unit of the row's entry].

        Examples
        --------
        >>> Coordinate("r0", 0, 3.0, floor=1.0).value(0.0)
        (3.0, 2.0)
        """
        if self.scale is not None:
            return self.guess + self.scale * u, self.scale
        above = (self.guess - self.floor) * float(np.exp(np.clip(u, -50.0, 50.0)))
        return self.floor + above, above


@dataclass(frozen=True, eq=False)
class Maximum:
    """Maximum of the likelihood.

    Parameters
    ----------
    coordinates : tuple of Coordinate
        The coordinates, with their guesses moved to the maximum.
    objective : float
        Log-likelihood plus log prior, relative to the given guesses [dimensionless].
    information : ndarray, shape (coordinates, coordinates)
        Fisher information of the log plus that of the prior [dimensionless].
    """

    coordinates: tuple[Coordinate, ...]
    objective: float
    information: Array
    sensitivity: Sensitivity
    converged: bool


def maximise(problem: FilterProblem, coordinates: Sequence[Coordinate], iterations: int = 60) -> Maximum:
    """Search for the maximum of the innovations' likelihood.

    The Fisher information replaces the Hessian (scoring), within a trust region (Conn, Gould and Toint 2000, algorithm
    7.3.4, as in scipy).
    """
    from scipy.optimize import OptimizeResult, minimize

    search = _Search(problem, tuple(coordinates))
    begin = np.zeros(len(coordinates))

    def rested(intermediate_result: OptimizeResult) -> None:
        if search.gain(np.asarray(intermediate_result.x)) < LEAST_GAIN:
            raise StopIteration

    found = minimize(
        lambda u: search.point(u).loss,
        begin,
        jac=lambda u: search.point(u).slope,
        hess=lambda u: search.point(u).curvature,
        method="trust-exact",
        callback=rested,
        options={"maxiter": iterations, "gtol": 0.0, "initial_trust_radius": 1.0, "max_trust_radius": LARGEST_MOVE},
    )
    at = np.asarray(found.x, dtype=np.float64)
    point = search.point(at)
    moved = tuple(replace(c, guess=c.value(float(u))[0]) for c, u in zip(coordinates, at, strict=True))
    return Maximum(moved, -point.loss, point.curvature, point.sensitivity, search.gain(at) < 10.0 * LEAST_GAIN)


@dataclass(frozen=True, eq=False)
class _Point:
    loss: float
    slope: Array
    curvature: Array
    sensitivity: Sensitivity


class _Search:
    """Evaluates value, slope and curvature at once, and caches the last two points."""

    def __init__(self, problem: FilterProblem, coordinates: tuple[Coordinate, ...]) -> None:
        self._problem, self._coordinates = problem, coordinates
        self._row = constant_row(problem, {})
        self._points: dict[bytes, _Point] = {}

    def gain(self, u: Array) -> float:
        """Return the predicted gain of a full scoring step from here."""
        point = self.point(u)
        return 0.5 * float(point.slope @ np.linalg.solve(point.curvature, point.slope))

    def point(self, u: Array) -> _Point:
        key = u.tobytes()
        if key not in self._points:
            while len(self._points) > 1:
                self._points.pop(next(iter(self._points)))
            self._points[key] = self._evaluated(u)
        return self._points[key]

    def _evaluated(self, u: Array) -> _Point:
        row = self._row.copy()
        directions = np.zeros((len(row), len(u)))
        for k, coordinate in enumerate(self._coordinates):
            row[coordinate.place], directions[coordinate.place, k] = coordinate.value(float(u[k]))
        found = innovation_sensitivity(problem_with(self._problem, row), directions)
        held = np.array([coordinate.spread**-2 for coordinate in self._coordinates])
        with np.errstate(all="ignore"):  # too large a step may overflow; it is then rejected
            loss = -found.log_likelihood + 0.5 * float(held @ u**2)
            slope = held * u - found.scores.sum(axis=0)
            curvature = found.information + np.diag(held)
        if not (np.isfinite(loss) and np.all(np.isfinite(slope)) and np.all(np.isfinite(curvature))):
            count = len(u)
            return _Point(float(np.finfo(float).max), np.zeros(count), np.eye(count), found)
        return _Point(loss, slope, curvature, found)


def problem_with(problem: FilterProblem, row: Array) -> FilterProblem:
    """Return a filtering task with another row of constants.

    Parameters
    ----------
    row : ndarray, shape (rows,)
        Constants in the order of `estimation.engine.runner.constant_row` [each in its own unit].

    Returns
    -------
    FilterProblem
        The task with its parameters, process noise and sensor variances.
    """
    known = len(problem.model.parameters.__dataclass_fields__)
    n, m = problem.model.width, len(problem.channels)
    return replace(
        problem,
        parameters=row[:known].copy(),
        noise=row[known : known + n].copy(),
        variances=row[known + n : known + n + m].copy(),
    )
