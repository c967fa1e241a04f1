"""Converts scores to calibrated probabilities: a temperature and a floor, fitted to held-back runs.

A discriminant assumes independent runs and a known covariance, so its probabilities are too near to 0 and 1. Scores are
divided by a temperature (Guo and others, ICML 2017), and a share of all probability is spread evenly; both are chosen
to make the held-back runs most probable.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from estimation.arrays import Array, IntArray

COLDEST, HOTTEST = 0.3, 3000.0
"""Range in which the best temperature is sought [dimensionless]."""

SPREADS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.4)
"""Evenly spread shares of probability that are tried, besides that of one run [fraction]."""


@dataclass(frozen=True)
class Calibration:
    """Calibration of scores to probabilities.

    Parameters
    ----------
    temperature : float
        Divisor of the scores [dimensionless].
    spread : float
        Share of probability that is spread evenly over the classes [fraction].
    """

    temperature: float = 1.0
    spread: float = 0.0

    def probabilities(self, scores: Array, merged: IntArray) -> Array:
        """Return the probabilities of the reported classes.

        Parameters
        ----------
        scores : ndarray, shape (n, learnt)
            Log probabilities up to a constant; at least one is finite in every row [dimensionless].
        merged : ndarray of int, shape (learnt,)
            Reported class of each learnt class.

        Returns
        -------
        ndarray, shape (n, reported)
            Each row sums to one [fraction].
        """
        known = np.isfinite(scores)
        cooled = np.where(known, scores, 0.0) / self.temperature
        top = np.max(np.where(known, cooled, -np.inf), axis=1, keepdims=True)
        odds = np.where(known, np.exp(np.clip(cooled - top, -700.0, 0.0)), 0.0)
        count = int(merged.max()) + 1
        joined = np.zeros((len(scores), count))
        for place, reported in enumerate(merged):
            joined[:, reported] += odds[:, place]
        joined /= joined.sum(axis=1, keepdims=True)
        return (1.0 - self.spread) * joined + self.spread / count


def log_loss(probabilities: Array, true: IntArray) -> float:
    """Return the mean log loss of the true classes.

    Parameters
    ----------
    probabilities : ndarray, shape (n, classes)
        Probability of each class [fraction].
    true : ndarray of int, shape (n,)
        Index of the true class.

    Returns
    -------
    float
        Zero if every true class was certain [nats, a count].
    """
    given = probabilities[np.arange(len(true)), true]
    return -float(np.mean(np.log(np.maximum(given, 1e-300))))


def fit_calibration(scores: Array, merged: IntArray, true: IntArray) -> Calibration:
    """Return the calibration that makes held-back runs most probable.

    Parameters
    ----------
    scores : ndarray, shape (n, learnt)
        Scores of runs that were not used in learning [dimensionless].
    merged : ndarray of int, shape (learnt,)
        Reported class of each learnt class.
    true : ndarray of int, shape (n,)
        Reported class of each run.

    Returns
    -------
    Calibration
        At least one run's share of probability is spread evenly: that much remains unknown after so many runs.
    """
    least = 1.0 / (len(true) + 2.0)
    found: list[tuple[float, Calibration]] = []
    for spread in (least, *(one for one in SPREADS if one > least)):

        def loss(log_temperature: float, spread: float = spread) -> float:
            return log_loss(Calibration(float(np.exp(log_temperature)), spread).probabilities(scores, merged), true)

        ends = (float(np.log(COLDEST)), float(np.log(HOTTEST)))
        best = minimize_scalar(loss, bounds=ends, method="bounded", options={"xatol": 0.02})
        found.append((float(best.fun), Calibration(float(np.exp(best.x)), spread)))
    return min(found, key=lambda one: one[0])[1]
