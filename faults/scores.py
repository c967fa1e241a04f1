"""How good is a classifier? Confusion matrix and accuracy over labelled runs."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from faults.conditions import CONDITIONS


def confusion_matrix(true: Sequence[str], found: Sequence[str]) -> pd.DataFrame:
    """Count how often each true condition was found to be which.

    Parameters
    ----------
    true : sequence of str
        True condition of each run.
    found : sequence of str
        Condition that was found.

    Returns
    -------
    pandas.DataFrame
        Counts; a row for each true condition, a column for each found one, in the order of Table 1.

    Raises
    ------
    ValueError
        If the lengths differ, or a condition is not one of Table 1.

    Examples
    --------
    >>> int(confusion_matrix(["normal", "normal"], ["normal", "minor_leakage"]).loc["normal", "minor_leakage"])
    1
    """
    names = list(CONDITIONS)
    counts = np.zeros((len(names), len(names)), dtype=np.int64)
    for actual, answer in zip(true, found, strict=True):
        counts[names.index(actual), names.index(answer)] += 1
    return pd.DataFrame(counts, index=pd.Index(names, name="true"), columns=pd.Index(names, name="found"))


def accuracy(confusion: pd.DataFrame) -> float:
    """Return the share of runs whose condition was found.

    Parameters
    ----------
    confusion : pandas.DataFrame
        From `confusion_matrix`.

    Returns
    -------
    float
        Between 0 and 1 [fraction].
    """
    total = int(confusion.to_numpy().sum())
    return float(confusion.to_numpy().trace() / total) if total else float("nan")


def calibration_error(confidence: NDArray[np.float64], right: NDArray[np.bool_], bins: int = 15) -> float:
    """Return the expected calibration error over bins of equal count.

    Source: Naeini, Cooper and Hauskrecht, AAAI 2015, equation 3, with equal counts in place of equal widths.

    Parameters
    ----------
    confidence : ndarray, shape (n,)
        Probability given to each answer [probability].
    right : ndarray, shape (n,)
        Whether it was right.
    bins : int
        Count of bins.

    Returns
    -------
    float
        Mean gap between confidence and share right [probability].

    Examples
    --------
    >>> round(calibration_error(np.array([0.9, 0.9]), np.array([True, False]), 1), 3)
    0.4
    """
    order = np.argsort(confidence, kind="stable")
    parts = [part for part in np.array_split(order, bins) if len(part)]
    gaps = [len(part) * abs(float(np.mean(confidence[part])) - float(np.mean(right[part]))) for part in parts]
    return float(sum(gaps) / len(order))


def share_interval(hits: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Return the exact interval of a share (Clopper and Pearson, Biometrika 26, 1934).

    Parameters
    ----------
    hits, count : int
        How many of how many.
    level : float
        Confidence [probability].

    Returns
    -------
    tuple of float
        Its ends [fraction].

    Examples
    --------
    >>> [round(end, 3) for end in share_interval(18, 18)]
    [0.815, 1.0]
    """
    from scipy.stats import beta

    tail = 0.5 * (1.0 - level)
    low = float(beta.ppf(tail, hits, count - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1.0 - tail, hits + 1, count - hits)) if hits < count else 1.0
    return low, high
