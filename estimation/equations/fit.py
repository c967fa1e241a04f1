"""`fit_equations(equations, records) -> EquationsFit`: a user's equations, fitted to one log or several."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from estimation.arrays import Array
from estimation.equations.conclude import Covariance, concluded_finding, fits_of
from estimation.equations.definition import Equations
from estimation.equations.problem import Part, Problem, known_noise, part_of, start_of
from estimation.equations.search import Solution, best_solution, with_enough_steps
from estimation.finding import Finding
from plant.errors import HydrostateError, LogError
from plant.log.record import Record

STEP_ERROR_SHARE = 1e-5
"""Error from a simulation's step length that counts, over the output's range [fraction]."""


@dataclass(frozen=True, eq=False)
class EquationsFit:
    """Result of a fit of a user's equations.

    Parameters
    ----------
    finding : Finding
        Parameters with their intervals, gate and notes.
    fit_percent : Mapping[str, float]
        Fit of each output: 100 is perfect, 0 is as good as its mean [percent].
    noise : Mapping[str, float]
        Standard deviation of each output's noise, as given or estimated from the residuals [its unit].
    residuals : tuple of Mapping[str, ndarray, shape (n,)]
        Predicted minus measured by output, one mapping for each log [its unit]; NaN if a sample is missing.
    """

    equations: Equations
    finding: Finding
    covariance: Covariance
    solution: Solution
    fit_percent: Mapping[str, float]
    noise: Mapping[str, float]
    residuals: tuple[Mapping[str, Array], ...]

    @property
    def values(self) -> Mapping[str, float]:
        """Every parameter [its unit], known ones too; one that the logs do not determine has its last value."""
        found = self.solution.problem.values(self.solution.point.theta)
        return {**dict(zip(self.equations.parameters, map(float, found), strict=False)), **self.equations.known}

    def predicted(self, record: Record, initial: Mapping[str, float] | None = None) -> Mapping[str, Array]:
        """Return the prediction of the fitted equations on another log.

        Parameters
        ----------
        record : Record
            Log with the inputs; if it also has the outputs, free initial states are fitted to them.
        initial : Mapping[str, float], optional
            The states at the first sample [their units]; those not named begin as in the fit.

        Returns
        -------
        Mapping[str, ndarray]
            By output [its unit], shape (n,).

        Raises
        ------
        LogError
            If an input is missing or has gaps.
        HydrostateError
            If ``initial`` names something that is not a state.
        """
        return predicted_outputs(self, record, initial or {})


def fit_equations(
    equations: Equations,
    records: Sequence[Record],
    *,
    noise: Mapping[str, float] | None = None,
    robust: bool = False,
    starts: int = 1,
    seed: int = 0,
) -> EquationsFit:
    """Fit a user's equations to logs by least squares on their free run, with exact sensitivities.

    Parameters
    ----------
    records : sequence of Record
        One log or several, with inputs and outputs; each has its own initial states.
    noise : Mapping[str, float], optional
        Standard deviation of an output's noise [its unit], if known; otherwise estimated from the residuals.
    robust : bool
        Whether residuals beyond three deviations count linearly (Huber 1964), so that outliers have little effect.
    starts : int
        Number of starts of the search; those after the first are drawn within the bounds.
    seed : int
        Seed of the random starts.

    Raises
    ------
    HydrostateError
        If the equations cannot be traced, or run away from the start.
    LogError
        If a log lacks a channel, has gaps in an input, or holds fewer samples than there are unknowns.
    """
    if not records:
        raise LogError("a log is needed to fit the equations to, got none")
    if not isinstance(starts, int) or starts < 1:  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
        raise HydrostateError(f"starts must be a whole number from 1 on, got {starts!r}")
    parts = [part_of(equations, record) for record in records]
    given = known_noise(equations, noise or {})
    unknowns = len(equations.parameters) + len(parts) * len(equations.free)
    samples = sum(int(np.count_nonzero(np.isfinite(part.measured))) for part in parts)
    if samples <= unknowns:
        raise LogError(f"more samples than unknowns are needed, got {samples} for {unknowns}")
    with threadpool_limits(limits=1, user_api="blas"):
        solution = best_solution(equations, parts, given, robust=robust, starts=starts, seed=seed)
        finding, covariance = concluded_finding(solution, given)
        problem, theta = solution.problem, solution.point.theta
        runs = problem.predicted(theta)
        return EquationsFit(
            equations=equations,
            finding=finding,
            covariance=covariance,
            solution=solution,
            fit_percent=dict(zip(equations.outputs, fits_of(problem, theta), strict=True)),
            noise=dict(zip(equations.outputs, map(float, problem.noise), strict=True)),
            residuals=tuple(
                dict(zip(equations.outputs, run - part.measured, strict=True))
                for run, part in zip(runs, parts, strict=True)
            ),
        )


def predicted_outputs(fit: EquationsFit, record: Record, initial: Mapping[str, float]) -> Mapping[str, Array]:
    """Return the prediction of fitted equations on a log; see `EquationsFit.predicted`.

    Parameters
    ----------
    initial : Mapping[str, float]
        The states at the first sample [their units].

    Returns
    -------
    Mapping[str, ndarray]
        By output [its unit], shape (n,).
    """
    model, ours = fit.equations, fit.solution.problem
    part = _log_with_missing_outputs(model, record)
    problem = Problem(model, (part,), ours.scheme, ours.substeps, np.ones(len(model.outputs)))
    theta = _theta(problem, fit.values, initial)
    free = [j for j, name in enumerate(model.free, start=len(model.parameters)) if name not in initial]
    if free and np.isfinite(part.measured).any():
        theta = _with_fitted_starts(problem, theta, free)
    return dict(zip(model.outputs, problem.predicted(theta)[0], strict=True))


def simulated_outputs(
    equations: Equations, record: Record, values: Mapping[str, float], initial: Mapping[str, float]
) -> Mapping[str, Array]:
    """Return the simulation of equations with given parameters.

    Parameters
    ----------
    record : Record
        Log with the inputs.
    values : Mapping[str, float]
        Parameters [their units]; those not named have their start values.
    initial : Mapping[str, float]
        The states at the first sample [their units].

    Returns
    -------
    Mapping[str, ndarray]
        By output [its unit], shape (n,); the steps are short enough for six digits relative to its spread.

    Raises
    ------
    HydrostateError
        If a name is neither a parameter nor a state, or the equations run away.
    """
    strangers = [name for name in values if name not in equations.parameters]
    if strangers:
        raise HydrostateError(f"values names {strangers[0]!r}, which is none of {', '.join(equations.parameters)}")
    part = _log_with_missing_outputs(equations, record)
    part = Part(part.inputs, np.full_like(part.measured, np.nan), part.sample_time)
    problem = Problem(equations, (part,), "rk4", 1, np.ones(len(equations.outputs)))
    starts = {name: one.start for name, one in equations.parameters.items()}
    theta = _theta(problem, {**starts, **values}, initial)
    bare = Part(part.inputs, np.zeros_like(part.measured), part.sample_time)
    rough = Problem(equations, (bare,), "rk4", 1, np.ones(len(equations.outputs)))
    for _ in range(2):  # the second pass chooses its steps by the size of the outputs, which the first one finds
        rough = with_enough_steps(rough, theta)
        size = np.maximum(np.ptp(rough.predicted(theta)[0], axis=1), np.finfo(float).tiny)
        rough = rough.with_noise(STEP_ERROR_SHARE * size)
    return dict(zip(equations.outputs, rough.predicted(theta)[0], strict=True))


def _theta(problem: Problem, values: Mapping[str, float], initial: Mapping[str, float]) -> Array:
    """Return the coordinates of parameters, and of the initial states, which if not named begin as in a fit."""
    model = problem.equations
    strangers = [name for name in initial if name not in model.free]
    if strangers:
        raise HydrostateError(
            f"initial names {strangers[0]!r}, which is none of the free states {', '.join(model.free)}"
        )
    (part,) = problem.parts
    first = [float(initial.get(name, start_of(model, name, part))) for name in model.free]
    return problem.coordinates(np.array([*(float(values[name]) for name in model.parameters), *first]))


def _log_with_missing_outputs(model: Equations, record: Record) -> Part:
    """Return a log whose outputs may be missing."""
    absent = [name for name in model.outputs if name not in record or not np.isfinite(record[name]).any()]
    part = part_of(model, record.replace(**{name: np.zeros(len(record)) for name in absent}))
    measured = part.measured.copy()
    measured[[list(model.outputs).index(name) for name in absent]] = np.nan
    return Part(part.inputs, measured, part.sample_time)


def _with_fitted_starts(problem: Problem, theta: Array, free: Sequence[int]) -> Array:
    """Return the coordinates with the free initial states fitted to the log, by Gauss-Newton steps."""
    for _ in range(10):
        point = problem.at(theta)
        step = np.linalg.lstsq(point.gram[np.ix_(free, free)], -point.gradient[free], rcond=None)[0]
        tried = theta.copy()
        tried[free] += step
        if not problem.at(tried).cost < point.cost:
            break
        theta = tried
    return theta
