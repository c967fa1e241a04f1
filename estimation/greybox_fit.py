"""Output-error fit of a grey-box model: several starts, exact sensitivities, and how far to believe what comes out.

The variance of an estimate has three parts, told apart: noise of the outputs, noise of the driving channels, and how
well the rig's own parameters are known. The last two are read off the fit's linear response to them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.covariance import automatic_lags, least_squares_covariance
from estimation.greybox import GreyBoxModel
from estimation.greybox_problem import GreyBoxLog, Problem, search_bounds
from plant.integrate import PARAMETER_NAMES

Array = NDArray[np.float64]

LEAST_EFFECT = 1.0
"""An unknown whose unit change moves the prediction by less, in standard deviations of one sample, is not felt."""

SCREENED_SAMPLES = 200_000
"""A longer log is screened on its beginning."""

LENGTHENED = 8
"""Factor between the beginnings of a long log on which a fit is brought near."""

DRIVE_DRAWS = 16
"""Realisations of the driving channels' noise; their spread is known to 18 %, of a part that is seldom the larger."""

RIG_NUDGE = 1e-3
"""Relative change of a rig parameter by which the fit's response to it is read off [fraction]."""


@dataclass(frozen=True, eq=False)
class GreyBoxFit:
    """What a fit found.

    Parameters
    ----------
    model : GreyBoxModel
        The model.
    theta : ndarray, shape (unknowns,)
        The fitted coordinates.
    values : Mapping[str, float]
        The unknowns in SI.
    std : Mapping[str, float]
        Standard deviation of each from noise alone, in SI; infinite where the log does not determine it.
    rig_std : Mapping[str, float]
        The same from what is not known of the rig, in SI.
    cost : float
        Half the sum of squared normalised residuals, outliers counted linearly [dimensionless].
    chi_square : tuple of float
        Mean squared normalised residual of each output; 1 where the model explains the log [dimensionless].
    autocorrelation : tuple of float
        Of neighbouring normalised residuals; 0 where the model explains the log [dimensionless].
    normalised : ndarray, shape (blocks, outputs)
        Measured less predicted, block by block, whitened and over its standard deviation; zero where missing.
    """

    model: GreyBoxModel
    theta: Array
    values: Mapping[str, float]
    std: Mapping[str, float]
    rig_std: Mapping[str, float]
    cost: float
    chi_square: tuple[float, ...]
    autocorrelation: tuple[float, ...]
    normalised: Array


@dataclass(frozen=True)
class Search:
    """How the best of several starts is found.

    Parameters
    ----------
    screened : int
        A longer log is screened on its beginning [samples].
    screening : int
        Evaluations of the model that every start is given.
    finalists : int
        Starts that are carried on.
    evaluations : int
        Evaluations of the model that a finalist may take.
    """

    screened: int = SCREENED_SAMPLES
    screening: int = 12
    finalists: int = 2
    evaluations: int = 40


DEFAULT_SEARCH = Search()
"""Enough where few unknowns act alone."""


def fit_greybox(
    model: GreyBoxModel,
    log: GreyBoxLog,
    *,
    starts: Sequence[Mapping[str, float]],
    search: Search = DEFAULT_SEARCH,
    ceilings: Mapping[str, float] | None = None,
) -> GreyBoxFit:
    """Fit the unknowns to a log, from several starts, and return the best.

    Parameters
    ----------
    model : GreyBoxModel
        The model.
    log : GreyBoxLog
        The log.
    starts : sequence of Mapping[str, float]
        First guesses of the unknowns in SI.
    search : Search
        How they are brought to the optimum.
    ceilings : Mapping[str, float], optional
        Largest value of an unknown, where physics gives one [SI].

    Returns
    -------
    GreyBoxFit
        The best fit.
    """
    guesses = [model.theta(start) for start in starts]
    bounds = search_bounds(model, guesses, ceilings or {})
    if len(guesses) > 1:
        beginning = Problem(model, log.beginning(search.screened))
        screened = [beginning.solve(guess, search.screening, bounds) for guess in guesses]
        guesses = [best.x for best in sorted(screened, key=_cost)[: search.finalists]]
    length = LENGTHENED * search.screened
    while length < len(log.measured):  # the way is made on ever longer beginnings, so that the whole takes few steps
        part = Problem(model, log.beginning(length))
        guesses = [min((part.solve(guess, search.evaluations, bounds) for guess in guesses), key=_cost).x]
        length *= LENGTHENED
    whole = Problem(model, log)
    best = min((whole.solve(guess, search.evaluations, bounds) for guess in guesses), key=_cost)
    return concluded(whole, np.asarray(best.x, dtype=np.float64), _cost(best))


def _cost(solution: Any) -> float:
    return float(solution.cost)


def concluded(problem: Problem, theta: Array, cost: float) -> GreyBoxFit:
    """Return what a solution says, with its deviations.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution in fitted coordinates.
    cost : float
        Its cost [dimensionless].

    Returns
    -------
    GreyBoxFit
        The fit.
    """
    model = problem.model
    errors, slope = problem.predict(tuple(theta))
    felt = np.sqrt(np.einsum("ij,ij->j", slope, slope)) > LEAST_EFFECT
    noise, rig = np.full(len(theta), np.inf), np.zeros(len(theta))
    used = int(np.count_nonzero(errors))
    if np.any(felt) and used > len(theta):
        covariance = least_squares_covariance(slope[:, felt], errors, used, coloured=True, lags=automatic_lags(errors))
        spread = np.diag(covariance)
        spread = np.where(
            spread > 0.0, spread, np.inf
        )  # the window's estimate need not be positive: then nothing is known
        gain = np.asarray(np.linalg.pinv(slope[:, felt]), dtype=np.float64)
        noise[felt] = np.sqrt(spread + _drive_variance(problem, theta, gain))
        rig[felt] = np.sqrt(_rig_variance(problem, theta, gain))
    sizes = dict(model.linear)
    values = model.values(theta)
    unit = np.array([sizes.get(name, values[name]) for name in model.unknowns])
    normalised = -errors.reshape(problem.counts.T.shape).T
    squares = np.einsum("ij,ij->j", normalised, normalised)
    neighbours = np.einsum("ij,ij->j", normalised[1:], normalised[:-1])
    seen = np.maximum(np.count_nonzero(problem.counts, axis=0), 1)
    return GreyBoxFit(
        model=model,
        theta=theta,
        values=values,
        std=dict(zip(model.unknowns, map(float, unit * noise), strict=True)),
        rig_std=dict(zip(model.unknowns, map(float, unit * rig), strict=True)),
        cost=cost,
        chi_square=tuple(map(float, squares / seen)),
        autocorrelation=tuple(map(float, neighbours / np.maximum(squares, np.finfo(float).tiny))),
        normalised=normalised,
    )


def _response(problem: Problem, change: Array, gain: Array) -> Array:
    """Return by how much the estimate moves, to first order, if the prediction changes."""
    return -gain @ problem.normalised(change)


def _drive_variance(problem: Problem, theta: Array, gain: Array) -> Array:
    """Return the variance that noise of the driving channels adds: measured once, it acts on all later outputs."""
    spread = np.array(problem.log.drive_std)
    if not np.any(spread > 0.0):
        return np.zeros(len(gain))
    rng = np.random.default_rng(0)  # the same draws for every log, so that a result can be repeated
    predicted, _ = problem.run(theta)
    shaken, squares = np.empty_like(problem.log.drives), np.zeros(len(gain))
    for _ in range(DRIVE_DRAWS):
        rng.standard_normal(out=shaken)
        shaken *= spread
        shaken += problem.log.drives
        squares += _response(problem, problem.run(theta, drives=shaken)[0] - predicted, gain) ** 2
    return squares / DRIVE_DRAWS


def _rig_variance(problem: Problem, theta: Array, gain: Array) -> Array:
    """Return the variance that comes from the uncertain parameters of the rig, taken as independent."""
    total = np.zeros(len(gain))
    predicted, _ = problem.run(theta)
    for name, relative in problem.log.uncertainties.items():
        if relative > 0.0 and name in PARAMETER_NAMES and name not in problem.model.unknowns:
            nudged = problem.log.parameters.copy()
            nudged[PARAMETER_NAMES.index(name)] *= 1.0 + RIG_NUDGE
            change = problem.run(theta, parameters=nudged)[0] - predicted
            total += (relative / RIG_NUDGE * _response(problem, change, gain)) ** 2
    return total
