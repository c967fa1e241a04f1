"""Sigma points as expressions: mean and covariance through a function, without its derivative.

The scaled transform of Julier (2002) with points ``z ± c L_i``, where ``P = L L'`` and ``c^2 = alpha^2 (n + kappa)``.
Its sums are rewritten to avoid cancellation of large terms. ``A_i`` and ``S_i`` are half the difference and half the
second difference of the function over the points of pair i, over c, and ``d`` is the shift of the mean from the
centre's image::

d = sum_i S_i / c P = sum_i A_i A_i' + sum_i (S_i - c d / n)(S_i - c d / n)' + (beta + alpha^2 kappa / n) d d'

This equals the published sum term by term, without a negative weight: it is a covariance for every alpha if ``beta +
alpha^2 kappa / n`` is not negative. Parts that are affine in the state need no points: their ``A_i`` is exact and their
``S_i`` is zero. So on a linear model the transform equals the Kalman filter, and there is no rounding of ``f(z + c L) -
f(z - c L)`` when a standard deviation is a millionth of the mean.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from estimation.engine.kalman import (
    Covariance,
    Outputs,
    belief_symbols,
    bounded_belief,
    bounded_mean,
    corrected_belief,
    entry,
    next_state,
    predicted_outputs,
    process_noise,
    total,
)
from estimation.engine.robust import inflation
from estimation.filters.ekf import ekf_update
from estimation.models.model import ProcessModel
from plant.compiled.expression import ONE, ZERO, Expression, jacobian, ordered, select, symbol, unary
from plant.compiled.functions import where

Vector: TypeAlias = list[Expression]
Matrix: TypeAlias = list[Vector]

SMALLEST_PIVOT = 1e-14
"""Share of a state's variance below which its variance given the previous states counts as rounding [fraction]."""


@dataclass(frozen=True)
class Spread:
    """Spread of the sigma points: their distance, and the weight of the shift of the mean.

    Parameters
    ----------
    reach : Expression
        Distance of the points in standard deviations, ``c`` [dimensionless].
    shift_weight : Expression
        Weight of ``d d'`` in the covariance, ``beta + alpha^2 kappa / n`` [dimensionless].
    """

    reach: Expression
    shift_weight: Expression


SpreadOf: TypeAlias = Callable[[int], Spread]
"""Maps the number of states to the spread of the points."""


@dataclass(frozen=True)
class Image:
    """The image of a belief under a function.

    Parameters
    ----------
    mean : list of Expression
        Mean of each component.
    slopes, bends : list of list of Expression
        ``A`` and ``S - c d / n``: one row for each component, one column for each pair of points.
    shift : list of Expression
        ``d``.
    """

    mean: Vector
    slopes: Matrix
    bends: Matrix
    shift: Vector


def cholesky_root(P: Covariance, n: int) -> Matrix:
    """Return the Cholesky root of a covariance; a state determined by the previous ones has a column of zeros.

    Parameters
    ----------
    P : dict
        Upper triangle.

    Returns
    -------
    list of list of Expression
        Lower triangle, ``ZERO`` above.
    """
    L: Matrix = [[ZERO] * n for _ in range(n)]
    for j in range(n):
        pivot = P[j, j] - total([L[j][k] * L[j][k] for k in range(j)])
        empty = pivot <= SMALLEST_PIVOT * P[j, j]  # false for NaN, so that NaN propagates
        L[j][j] = where(empty, 0.0, unary("sqrt", pivot))
        inverse = where(empty, 0.0, 1.0 / L[j][j])
        for i in range(j + 1, n):
            L[i][j] = (entry(P, i, j) - total([L[i][k] * L[j][k] for k in range(j)])) * inverse
    return L


def is_affine(item: Expression, mean: Sequence[Expression]) -> bool:
    """Return whether an expression is affine in the states.

    Returns
    -------
    bool
        Whether it is; an expression with a sign or a choice that depends on a state is not.
    """
    states = {id(z) for z in mean}
    degree: dict[int, int] = {}
    for part in ordered([item]):
        below = [degree[id(argument)] for argument in part.arguments]
        match part.operation:
            case "symbol":
                degree[id(part)] = int(id(part) in states)
            case "+" | "-":
                degree[id(part)] = max(below)
            case "*":
                degree[id(part)] = sum(below)
            case "/" if below[1] == 0:
                degree[id(part)] = below[0]
            case _:
                degree[id(part)] = 2 if any(below) else 0
    return degree[id(item)] <= 1


def all_affine(model: ProcessModel, channels: Sequence[str]) -> bool:
    """Return whether every channel that a model predicts is affine in its states.

    Returns
    -------
    bool
        Whether they are; one pass of the Kalman filter's update is then exact.
    """
    at, _ = belief_symbols(model)
    return all(is_affine(value, at) for value in predicted_outputs(model, at, channels))


def image(function: Callable[[Vector], Vector], at: Vector, mean: Vector, L: Matrix, spread: Spread) -> Image:
    """Carry a belief through a function.

    Parameters
    ----------
    function : callable
        Maps a state to components.
    at : list of Expression
        Symbols of the states, from which the function's structure is read.
    mean : list of Expression
        The belief's mean, in terms of any symbols.
    L : list of list of Expression
        Root of the belief's covariance.
    """
    n, c = len(mean), spread.reach
    traced = function(at)
    affine = [is_affine(component, at) for component in traced]
    F = jacobian(traced, at)
    centre = function(mean)
    pairs = [[function([z + side * c * L[k][i] for k, z in enumerate(mean)]) for side in (1.0, -1.0)] for i in range(n)]
    slopes: Matrix = []
    bends: Matrix = []
    shift: Vector = []
    for k in range(len(centre)):
        if affine[k]:
            slopes.append([total([F[k][j] * L[j][i] for j in range(n)]) for i in range(n)])
            bends.append([ZERO] * n)
            shift.append(ZERO)
            continue
        half = 0.5 / c
        slopes.append([(plus[k] - minus[k]) * half for plus, minus in pairs])
        second = [((plus[k] - centre[k]) + (minus[k] - centre[k])) * half for plus, minus in pairs]
        shift.append(total(second) / c)
        bends.append([S - shift[k] * c / n for S in second])
    return Image([f + d for f, d in zip(centre, shift, strict=True)], slopes, bends, shift)


def covariance_of(found: Image, i: int, j: int, spread: Spread) -> Expression:
    """Return the covariance of two components of an image."""
    first = total([a * b for a, b in zip(found.slopes[i], found.slopes[j], strict=True)])
    second = total([a * b for a, b in zip(found.bends[i], found.bends[j], strict=True)])
    return first + second + found.shift[i] * found.shift[j] * spread.shift_weight


def sigma_predict(model: ProcessModel, spread_of: SpreadOf) -> Outputs:
    """Return a sigma-point filter's predict step, with additive process noise.

    The model is evaluated only at states within their physical bounds: a point beyond them is projected onto them
    (Kandepu, Foss and Imsland 2008, section 3). A state that the step leaves unchanged keeps its own points.
    """
    n = model.width
    mean, P = belief_symbols(model)
    spread = spread_of(n)
    found = image(partial(_step_within_bounds, model), mean, mean, cholesky_root(P, n), spread)
    covariance = {(i, j): covariance_of(found, i, j, spread) for i in range(n) for j in range(i, n)}
    for i in range(n):
        covariance[i, i] = covariance[i, i] + process_noise(model, i)
    return bounded_belief(model, found.mean, covariance)


def _step_within_bounds(model: ProcessModel, point: Vector) -> Vector:
    held = bounded_mean(model, point) if any(z.operation != "symbol" for z in point) else point
    stepped = next_state(model, held)
    return [own if new is old else new for new, old, own in zip(stepped, held, point, strict=True)]


def sigma_update(model: ProcessModel, channels: Sequence[str], spread_of: SpreadOf, robust: str = "none") -> Outputs:
    """Return a sigma-point filter's update by each channel in turn, with new points for each channel.

    Channels that are all affine in the state, as in every model here, are updated by the extended Kalman filter's
    expressions, to which the transform is then equal.

    Parameters
    ----------
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How too large innovations count, see `estimation.engine.robust.inflation`.

    Returns
    -------
    dict[str, Expression]
        New value of each mean and covariance symbol, innovations ``e`` and their variances ``s``.
    """
    if all_affine(model, channels):
        return ekf_update(model, channels, robust)
    n = model.width
    at, covariance = belief_symbols(model)
    mean, spread, outputs = list(at), spread_of(n), Outputs()
    for c, channel in enumerate(channels):
        L = cholesky_root(covariance, n)
        seen = image(partial(predicted_outputs, model, channels=(channel,)), list(at), mean, L, spread)
        y, r = symbol(f"y{c}"), symbol(f"r{c}")
        present, residual = unary("present", y), y - seen.mean[0]
        PH = [total([L[i][k] * seen.slopes[0][k] for k in range(n)]) for i in range(n)]
        own = covariance_of(seen, 0, 0, spread)
        variance = own + r
        if robust != "none":
            variance = own + r * inflation(robust, residual * residual / variance)
        weight = select(present, ONE / variance, ZERO)
        step = weight * select(present, residual, ZERO)
        mean, covariance = corrected_belief(mean, covariance, PH, step, weight)
        outputs |= {f"e{c}": residual, f"s{c}": variance}
    return outputs | bounded_belief(model, mean, covariance)
