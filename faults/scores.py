"""Quality of a classifier: confusion matrix and accuracy over labelled runs."""

from collections.abc import Collection, Sequence

import numpy as np
import pandas as pd

from faults.conditions import CONDITIONS


def confusion_matrix(true: Sequence[str], found: Sequence[str], names: Collection[str] = CONDITIONS) -> pd.DataFrame:
    """Count how often each true condition was classified as each condition.

    Parameters
    ----------
    names : collection of str
        All conditions; those of Table 1 if not given.

    Returns
    -------
    pandas.DataFrame
        Counts; one row for each true condition, one column for each found one, in the order of the names.

    Raises
    ------
    ValueError
        If the lengths differ, or a condition is none of the names.

    Examples
    --------
    >>> int(confusion_matrix(["normal", "normal"], ["normal", "minor_leakage"]).loc["normal", "minor_leakage"])
    1
    """
    names = list(names)
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
