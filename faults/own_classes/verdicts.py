"""Verdicts on held-back runs: right or wrong, probability, and distance from all classes."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from estimation.arrays import Array, IntArray
from faults.own_classes import calibration


@dataclass(frozen=True, eq=False)
class Verdicts:
    """Verdicts on held-back runs.

    Parameters
    ----------
    classes : tuple of str
        The classes.
    true : ndarray of int, shape (n,)
        Index of each run's class.
    probabilities : ndarray, shape (n, classes)
        Probability of each class, given the run [fraction].
    likeness : ndarray, shape (n,)
        Share of known runs that lie at least as far from the classes [fraction].
    """

    classes: tuple[str, ...]
    true: IntArray
    probabilities: Array
    likeness: Array

    @property
    def found(self) -> IntArray:
        """Index of the most probable class of each run."""
        return self.probabilities.argmax(axis=1)

    @property
    def confusion(self) -> pd.DataFrame:
        """Counts: one row for each true class, one column for each found class."""
        counts = np.zeros((len(self.classes), len(self.classes)), dtype=np.int64)
        np.add.at(counts, (self.true, self.found), 1)
        names = list(self.classes)
        return pd.DataFrame(counts, index=pd.Index(names, name="true"), columns=pd.Index(names, name="found"))

    @property
    def accuracy(self) -> float:
        """Share of runs that were classified correctly [fraction]."""
        return float(np.mean(self.found == self.true))

    @property
    def balanced_accuracy(self) -> float:
        """Mean over the classes of the share of runs that were classified correctly [fraction]."""
        counts = self.confusion.to_numpy()
        there = counts.sum(axis=1) > 0
        return float(np.mean(np.diag(counts)[there] / counts.sum(axis=1)[there]))

    @property
    def log_loss(self) -> float:
        """Mean log loss of the true classes [nats]."""
        return calibration.log_loss(self.probabilities, self.true)

    def reliability(self, bins: int = 10) -> pd.DataFrame:
        """Return the share of correct verdicts in each range of probability.

        Parameters
        ----------
        bins : int
            Number of ranges of probability, from 0 to 1.

        Returns
        -------
        pandas.DataFrame
            One row for each range that holds runs: ``claimed`` and ``right`` [fraction], ``runs`` [count].
        """
        claimed, right = self.probabilities.max(axis=1), self.found == self.true
        place = np.minimum((claimed * bins).astype(np.int64), bins - 1)
        rows = [
            (claimed[place == k].mean(), right[place == k].mean(), int((place == k).sum())) for k in np.unique(place)
        ]
        return pd.DataFrame(rows, columns=["claimed", "right", "runs"])

    @property
    def calibration_error(self) -> float:
        """Mean difference between claimed probability and share of correct verdicts, over ten ranges [fraction]."""
        table = self.reliability()
        weights = table["runs"].to_numpy() / len(self.true)
        return float(weights @ np.abs(table["claimed"].to_numpy() - table["right"].to_numpy()))

    def __str__(self) -> str:
        return (
            f"{len(self.true)} runs held back: balanced accuracy {100.0 * self.balanced_accuracy:.1f} %, log loss "
            f"{self.log_loss:.3g}, calibration error {100.0 * self.calibration_error:.1f} %\n"
            f"{self.confusion.to_string()}"
        )
