"""Scores made into calibrated probabilities: flattened and floored until they fit the runs held back.

A discriminant takes runs for independent and its covariance for known, so its probabilities are too near to 0 and 1.
Scores are divided by a temperature (Guo and others, ICML 2017), and a share of all probability is spread evenly; both
are those with which runs held back are most probable.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from estimation.arrays import Array, IntArray

COLDEST, HOTTEST = 0.3, 3000.0
"""Temperatures among which the best is sought [dimensionless]."""

SPREADS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.4)
"""Shares of probability spread evenly that are tried, beside that of one run [fraction]."""


@dataclass(frozen=True)
class Calibration:
    """Calibration of scores to probabilities.

    Parameters
    ----------
    temperature : float
        By which scores are divided [dimensionless].
    spread : float
        Share of probability that all classes have alike [fraction].
    """

    temperature: float = 1.0
    spread: float = 0.0

    def probabilities(self, scores: Array, merged: IntArray) -> Array:
        """Return probabilities of the classes that are reported.

        Parameters
        ----------
        scores : ndarray, shape (n, learnt)
            Log probabilities but for a constant; one is finite in every row [dimensionless].
        merged : ndarray of int, shape (learnt,)
            Reported class of each learnt one.

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
    """Return the mean surprise of the true classes.

    Parameters
    ----------
    probabilities : ndarray, shape (n, classes)
        Of each class [fraction].
    true : ndarray of int, shape (n,)
        Place of the true one.

    Returns
    -------
    float
        Zero where every true class was certain [nats, a count].
    """
    given = probabilities[np.arange(len(true)), true]
    return -float(np.mean(np.log(np.maximum(given, 1e-300))))


def calibrated(scores: Array, merged: IntArray, true: IntArray) -> Calibration:
    """Return the calibration with which runs held back are most probable.

    Parameters
    ----------
    scores : ndarray, shape (n, learnt)
        Of runs that had no part in the learning [dimensionless].
    merged : ndarray of int, shape (learnt,)
        Reported class of each learnt one.
    true : ndarray of int, shape (n,)
        Their reported class.

    Returns
    -------
    Calibration
        At least one run's share of probability is spread evenly: so much is unknown after as many runs.
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
