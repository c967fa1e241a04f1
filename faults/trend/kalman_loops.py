"""One filter step, and a whole series of logs, for all settings of the grid of `faults.trend.kalman`: compiled."""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.compiled.native.loops import natively_compiled

Index: TypeAlias = NDArray[np.int64]
"""Indices."""


class GridRows(NamedTuple):
    """The settings of a grid, one number each.

    Parameters
    ----------
    pace_places : ndarray of int, shape (g,)
        Index of each setting's pace.
    bend, jerk : ndarray, shape (g,)
        Standard deviation that slope and curvature gain in a unit of time [1/log, 1/log^2].
    scatter : ndarray, shape (g,)
        Standard deviation from log to log beyond each log's own [dimensionless].
    """

    pace_places: Index
    bend: Array
    jerk: Array
    scatter: Array


class Steps(NamedTuple):
    """Transitions of the belief over the time before each log.

    Parameters
    ----------
    transitions, slope_noise : ndarray, shape (n, paces, 3, 3)
        Transition of level, slope and curvature for each pace, and the covariance from unit white noise on the slope.
    curvature_noise : ndarray, shape (n, 3, 3)
        Covariance from unit white noise on the curvature.
    level_noise : ndarray, shape (n, g)
        Variance that the level gains [dimensionless].
    """

    transitions: Array
    slope_noise: Array
    curvature_noise: Array
    level_noise: Array


@natively_compiled()
def fill_predicted(
    mean: Array,
    covariance: Array,
    grid: GridRows,
    steps: Steps,
    place: int,
    next_mean: Array,
    next_covariance: Array,
) -> None:
    """Fill in the belief predicted one step later.

    Parameters
    ----------
    mean : ndarray, shape (g, 3)
        Level, slope and curvature [dimensionless, 1/log, 1/log^2].
    covariance : ndarray, shape (g, 3, 3)
        Their covariance [products of their units].
    place : int
        Index of the step.
    next_mean : ndarray, shape (g, 3)
        Output for the means.
    next_covariance : ndarray, shape (g, 3, 3)
        Output for the covariances.
    """
    moves, bent, jerked, wandered = (
        steps.transitions[place],
        steps.slope_noise[place],
        steps.curvature_noise[place],
        steps.level_noise[place],
    )
    for k in range(mean.shape[0]):
        move, noise = moves[grid.pace_places[k]], bent[grid.pace_places[k]]
        slopes, jolts = grid.bend[k] * grid.bend[k], grid.jerk[k] * grid.jerk[k]
        rise, bow, growth, turn = move[0, 1], move[0, 2], move[1, 1], move[1, 2]
        level, slope, curvature = mean[k, 0], mean[k, 1], mean[k, 2]
        next_mean[k, 0] = level + rise * slope + bow * curvature
        next_mean[k, 1] = growth * slope + turn * curvature
        next_mean[k, 2] = curvature
        # the covariance is symmetric; each name states the two states of its entry
        slope_slope, slope_bend, bend_bend = covariance[k, 1, 1], covariance[k, 1, 2], covariance[k, 2, 2]
        level_slope = covariance[k, 0, 1] + rise * slope_slope + bow * slope_bend
        level_bend = covariance[k, 0, 2] + rise * slope_bend + bow * bend_bend
        level_level = covariance[k, 0, 0] + rise * covariance[k, 0, 1] + bow * covariance[k, 0, 2]
        moved_bend = growth * slope_bend + turn * bend_bend
        next_covariance[k, 0, 0] = level_level + rise * level_slope + bow * level_bend + wandered[k]
        next_covariance[k, 0, 1] = growth * level_slope + turn * level_bend
        next_covariance[k, 0, 2] = level_bend
        next_covariance[k, 1, 1] = growth * (growth * slope_slope + turn * slope_bend) + turn * moved_bend
        next_covariance[k, 1, 2] = moved_bend
        next_covariance[k, 2, 2] = bend_bend
        for i in range(3):
            for j in range(i, 3):
                next_covariance[k, i, j] += slopes * noise[i, j] + jolts * jerked[i, j]
                next_covariance[k, j, i] = next_covariance[k, i, j]


@natively_compiled()
def update_belief(
    mean: Array, covariance: Array, evidence: Array, value: float, std: float, gross: float, scatter: Array
) -> None:
    """Update the belief with a log.

    Parameters
    ----------
    mean : ndarray, shape (g, 3)
        Level, slope and curvature [dimensionless, 1/log, 1/log^2].
    covariance : ndarray, shape (g, 3, 3)
        Their covariance [products of their units].
    evidence : ndarray, shape (g,)
        Logarithm of the probability of all logs so far [dimensionless].
    value : float
        Value of the log [dimensionless].
    std : float
        Standard deviation of that value [dimensionless].
    gross : float
        Limit at which an innovation is clipped, in standard deviations [dimensionless].
    scatter : ndarray, shape (g,)
        Standard deviation from log to log beyond each log's own [dimensionless].
    """
    for k in range(mean.shape[0]):
        innovation = value - mean[k, 0]
        level, slope, curvature = covariance[k, 0, 0], covariance[k, 0, 1], covariance[k, 0, 2]
        usual = level + std * std + scatter[k] * scatter[k]
        expected = max(usual, (innovation / gross) * (innovation / gross))
        evidence[k] -= 0.5 * (math.log(2.0 * math.pi * expected) + innovation * innovation / expected)
        for i in range(3):
            gain = covariance[k, i, 0] / expected
            mean[k, i] += gain * innovation
            covariance[k, i, 0] -= gain * level
            covariance[k, i, 1] -= gain * slope
            covariance[k, i, 2] -= gain * curvature


@natively_compiled()
def fill_beliefs(
    values: Array,
    stds: Array,
    gross: float,
    grid: GridRows,
    steps: Steps,
    mean: Array,
    covariance: Array,
    evidence: Array,
) -> None:
    """Fill in the belief after each log; the first row holds the belief before the first log.

    Parameters
    ----------
    values, stds : ndarray, shape (n,)
        Value of each log, and its own standard deviation [dimensionless].
    gross : float
        See `update_belief` [dimensionless].
    mean : ndarray, shape (rows, g, 3)
        Means; one more row than there are logs.
    covariance : ndarray, shape (rows, g, 3, 3)
        Covariances, in the same rows.
    evidence : ndarray, shape (rows, g)
        Log evidence, in the same rows.
    """
    for k in range(values.shape[0]):
        fill_predicted(mean[k], covariance[k], grid, steps, k, mean[k + 1], covariance[k + 1])
        for i in range(evidence.shape[1]):
            evidence[k + 1, i] = evidence[k, i]
        update_belief(mean[k + 1], covariance[k + 1], evidence[k + 1], values[k], stds[k], gross, grid.scatter)
