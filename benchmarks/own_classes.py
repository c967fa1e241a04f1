"""One's own features and one's own classes: the hydraulic test rig of ZeMA, whose faults are not those of Table 1.

The shape of every diagnosis: features of a run, probabilities of classes learnt from labelled runs, and a score on runs
that the learning has not seen nor had neighbours of. Scikit-learn is at this edge alone (extra ``rig-examples``).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from plant.errors import HydrostateError, LogError

Array = NDArray[np.float64]

SEGMENTS = 12
"""Parts into which a cycle is cut: the test rig's load steps last some five seconds of its minute."""

BLOCKS = 10
"""Contiguous blocks of runs, each judged by what the others teach."""

COMPONENTS = ("pump_leak", "valve_pct")
"""Columns of labels: internal leakage of the pump (0 none, 1 weak, 2 severe), and how far the valve switches [%]."""


@dataclass(frozen=True, eq=False)
class Verdicts:
    """What was found of runs that had no part in the learning.

    Parameters
    ----------
    classes : tuple of str
        The classes.
    true : ndarray, shape (n,)
        Place of each run's class.
    probabilities : ndarray, shape (n, classes)
        Of each class, given the run [fraction].
    """

    classes: tuple[str, ...]
    true: NDArray[np.int64]
    probabilities: Array

    @property
    def confusion(self) -> pd.DataFrame:
        """Counts: a row for each true class, a column for each found one."""
        counts = np.zeros((len(self.classes), len(self.classes)), dtype=np.int64)
        np.add.at(counts, (self.true, self.probabilities.argmax(axis=1)), 1)
        names = list(self.classes)
        return pd.DataFrame(counts, index=pd.Index(names, name="true"), columns=pd.Index(names, name="found"))

    @property
    def balanced_accuracy(self) -> float:
        """Mean over the classes of the share that was found right [fraction]."""
        counts = self.confusion.to_numpy()
        return float(np.mean(np.diag(counts) / counts.sum(axis=1)))


def cycle_features(cycles: Array, segments: int = SEGMENTS) -> Array:
    """Return mean and deviation of every sensor over equal parts of a repeated cycle.

    Parameters
    ----------
    cycles : ndarray, shape (n, sensors, samples)
        One cycle a run, in whatever units the sensors have [SI or not].
    segments : int
        Parts of the cycle.

    Returns
    -------
    ndarray, shape (n, 2 * sensors * segments)
        Means, then deviations, of sensor after sensor [the sensor's unit].

    Raises
    ------
    HydrostateError
        If the cycles have another shape or the samples are not a multiple of the parts.

    Examples
    --------
    >>> cycle_features(np.array([[[1.0, 3.0, 5.0, 5.0]]]), segments=2).tolist()
    [[2.0, 5.0, 1.0, 0.0]]
    """
    if cycles.ndim != 3 or segments < 1 or cycles.shape[2] % segments:
        raise HydrostateError(
            f"cycles must be runs x sensors x samples, samples a multiple of {segments}, got shape {cycles.shape}"
        )
    parts = cycles.reshape(*cycles.shape[:2], segments, -1)
    return np.concatenate([parts.mean(axis=3).reshape(len(cycles), -1), parts.std(axis=3).reshape(len(cycles), -1)], 1)


def judged_in_blocks(features: Array, labels: NDArray[Any], blocks: int = BLOCKS) -> Verdicts:
    """Judge every run by a classifier that learnt from other blocks of runs: never from its neighbours in time.

    The classifier is linear discriminant analysis with a shrunk covariance (Ledoit and Wolf, Journal of Multivariate
    Analysis 88, 2004, page 365) on standardised features; nothing in it is tuned.

    Parameters
    ----------
    features : ndarray, shape (n, features)
        In the order in which the runs were made [any unit].
    labels : ndarray, shape (n,)
        Their classes.
    blocks : int
        Contiguous blocks.

    Returns
    -------
    Verdicts
        Of all runs.

    Raises
    ------
    HydrostateError
        If scikit-learn is not installed, lengths differ, or a class occurs in one block alone.
    """
    if len(features) != len(labels) or not 2 <= blocks <= len(labels):
        raise HydrostateError(
            f"features and labels must be as many, and blocks from 2 to that, got {len(features)} features, "
            f"{len(labels)} labels, {blocks} blocks"
        )
    classes, true = np.unique(labels, return_inverse=True)
    probabilities = np.zeros((len(labels), len(classes)))
    parts = np.array_split(np.arange(len(labels)), blocks)
    for place, name in enumerate(classes):
        if sum(bool(np.any(true[part] == place)) for part in parts) == 1:
            raise HydrostateError(f"class {name} occurs in one block alone, so it cannot be learnt")
    for judged in parts:
        learnt = np.delete(np.arange(len(labels)), judged)
        made = _classifier().fit(features[learnt], true[learnt])
        probabilities[judged] = made.predict_proba(features[judged])
    return Verdicts(tuple(str(name) for name in classes), true.astype(np.int64), probabilities)


def _classifier() -> Any:
    try:
        analysis = import_module("sklearn.discriminant_analysis").LinearDiscriminantAnalysis
        pipeline, preprocessing = import_module("sklearn.pipeline"), import_module("sklearn.preprocessing")
    except ImportError as error:
        raise HydrostateError(
            "scikit-learn is wanted for one's own classes: pip install 'hydrostate[rig-examples]'"
        ) from error
    return pipeline.make_pipeline(preprocessing.StandardScaler(), analysis(solver="lsqr", shrinkage="auto"))


def read_rig_cycles(folder: Path) -> tuple[Array, pd.DataFrame]:
    """Read the ZeMA test rig's cycles at one sample a second (UCI data set 447, CC BY 4.0).

    Parameters
    ----------
    folder : Path
        With ``uci_hydraulic_1hz.npz`` (entry ``X``) and ``profile.csv`` (one row of labels a cycle).

    Returns
    -------
    cycles : ndarray, shape (2205, 17, 60)
        Pressures [bar], power [W], flows [l/min], temperatures [degC], and derived quantities.
    labels : pandas.DataFrame
        With the columns `COMPONENTS`.

    Raises
    ------
    LogError
        If a file is missing, or they do not belong together.
    """
    try:
        with np.load(folder / "uci_hydraulic_1hz.npz") as held:
            cycles = held["X"].astype(np.float64)
        labels = pd.read_csv(folder / "profile.csv")
    except (OSError, KeyError, ValueError) as error:
        raise LogError(f"{folder}: uci_hydraulic_1hz.npz and profile.csv are wanted: {error}") from error
    lacking = [name for name in COMPONENTS if name not in labels]
    if lacking or len(labels) != len(cycles):
        raise LogError(
            f"{folder}: one row of {', '.join(COMPONENTS)} a cycle is wanted, got {len(labels)} rows of "
            f"{', '.join(map(str, labels.columns))} for {len(cycles)} cycles"
        )
    return cycles, labels


def rig_verdicts(folder: Path) -> Mapping[str, Verdicts]:
    """Judge pump leakage and valve of the ZeMA test rig in contiguous blocks.

    Parameters
    ----------
    folder : Path
        See `read_rig_cycles`.

    Returns
    -------
    Mapping[str, Verdicts]
        By column of labels.

    Raises
    ------
    HydrostateError
        If the data or scikit-learn are not there.
    """
    cycles, labels = read_rig_cycles(folder)
    features = cycle_features(cycles)
    return {name: judged_in_blocks(features, labels[name].to_numpy()) for name in COMPONENTS}
