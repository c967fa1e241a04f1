"""A classifier of user-defined classes, after the conventions of scikit-learn."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, column_or_1d, validate_data

from estimation.arrays import Array, IntArray
from faults.own_classes.calibration import Calibration, fit_calibration, log_loss
from faults.own_classes.discriminant import Discriminant, learn
from faults.own_classes.groups import folds
from faults.own_classes.verdicts import Verdicts
from plant.errors import HydrostateError

INNER_FOLDS = 5
"""Number of folds with which a fit calibrates its probabilities."""

SHRINKAGES = (1.0, 0.1, 0.01)
"""Shares of Ledoit and Wolf's shrinkage that are tried [fraction]."""

LEAST_IMPROVEMENT = 0.05
"""Relative improvement of the log loss on held-back runs that less shrinkage must bring [fraction]."""

MOST_HELD_BACK = 0.5
"""Largest share of a class that may be held back at once when a fit calibrates its probabilities [fraction]."""

UNKNOWN = "unknown"
"""Name of a run that is unlike all runs learnt from."""

Merge = str | Mapping[Any, Any] | Callable[[Any], Any] | None
"""See `Classifier`."""


class Classifier(ClassifierMixin, BaseEstimator):
    """Learn classes from features of labelled runs; give the class of other runs, its probability, and novelty.

    Linear discriminant analysis with a shrunk covariance. The shrinkage and the calibration of the probabilities are
    chosen on held-back runs, in groups or contiguous blocks.

    Parameters
    ----------
    merge : str, Mapping or callable, optional
        Map from learnt classes to reported ones, for a state that looks different under each load: labels such as
        ``"worn@full load"`` are learnt one by one, and with ``"@"`` reported as ``"worn"``; a mapping or a function
        does so for other labels.
    unknown : float, optional
        Share of runs of known classes that may be called ``"unknown"`` [fraction]; none by default.

    Attributes
    ----------
    classes_ : ndarray
        Reported classes.
    learnt_classes_ : ndarray
        Learnt classes.
    calibration_ : Calibration
        Calibration from scores to probabilities.
    shrinkage_ : float
        Share of Ledoit and Wolf's shrinkage that was applied [fraction].
    n_features_in_ : int
        Number of features.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> labels = np.repeat(["sound", "worn"], 40)
    >>> features = rng.standard_normal((80, 3)) + 4.0 * (labels == "worn")[:, None]
    >>> Classifier().fit(features, labels).predict([[4.0, 4.0, 4.0]]).tolist()
    ['worn']
    """

    def __init__(self, *, merge: Merge = None, unknown: float | None = None) -> None:
        self.merge = merge
        self.unknown = unknown

    def fit(self, X: Any, y: Any, groups: Sequence[Any] | NDArray[Any] | None = None) -> "Classifier":
        """Learn from labelled runs.

        Parameters
        ----------
        X : array_like, shape (n, p)
            Features of each run, in the order in which the runs were made [any unit].
        y : array_like, shape (n,)
            Class of each run.
        groups : array_like, shape (n,), optional
            Group of each run, such as runs of one specimen or one day; contiguous blocks of runs if not given.

        Raises
        ------
        ValueError
            If features are not finite numbers, or there are fewer than two classes.
        """
        share = self.unknown
        if share is not None and not 0.0 < share < 1.0:
            raise HydrostateError(f"unknown must be a share between 0 and 1, or None, got {share!r}")
        checked: Any = validate_data(self, X, y, dtype=np.float64)
        x, labels = checked
        check_classification_targets(labels)
        self.learnt_classes_, places = np.unique(labels, return_inverse=True)
        self.classes_, self._merged = _merged_classes(self.learnt_classes_, self.merge)
        if len(self.classes_) < 2:
            raise HydrostateError(f"two classes at least are needed, got one class: {self.classes_[0]}")
        self.shrinkage_, self.calibration_, self._far = _fit_on_held_back(x, places, self._merged, groups)
        self._learnt: Discriminant = learn(x, places, len(self.learnt_classes_), [self.shrinkage_])[0]
        return self

    def predict_proba(self, X: Any) -> Array:
        """Return probabilities of the classes, assuming that a run belongs to one of them.

        Parameters
        ----------
        X : array_like, shape (n, p)
            Features [any unit].

        Returns
        -------
        ndarray, shape (n, classes)
            In the order of ``classes_`` [fraction].
        """
        x = self._features(X)
        return self.calibration_.probabilities(self._learnt.scores(x), self._merged)

    def likeness(self, X: Any) -> Array:
        """Return the likeness of runs to the known classes: the share of known runs at least as far from them.

        The known runs were held back for this (conformal anomaly detection, Laxhammar and Falkman 2015). So at most a
        share ``s`` of runs of known classes has a likeness of ``s`` or less, if new runs are drawn as the old ones
        were.

        Parameters
        ----------
        X : array_like, shape (n, p)
            Features [any unit].

        Returns
        -------
        ndarray, shape (n,)
            One if there is no basis for a likeness [fraction].
        """
        x = self._features(X)
        return _likeness(self._far, self._learnt.distances(x))

    def predict(self, X: Any) -> NDArray[Any]:
        """Return the most probable class of each run, or ``"unknown"`` if that was requested.

        Parameters
        ----------
        X : array_like, shape (n, p)
            Features [any unit].

        Returns
        -------
        ndarray, shape (n,)
            Classes.
        """
        check_is_fitted(self)
        found: NDArray[Any] = self.classes_[self.predict_proba(X).argmax(axis=1)]
        if self.unknown is None:
            return found
        return np.where(self.likeness(X) <= self.unknown, UNKNOWN, found.astype(object))

    def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
        """Return the share of runs that are classified correctly.

        Parameters
        ----------
        X : array_like, shape (n, p)
            Features [any unit].
        y : array_like, shape (n,)
            Their classes, learnt or reported.
        sample_weight : array_like, shape (n,), optional
            Weight of each run [dimensionless].

        Returns
        -------
        float
            Between 0 and 1 [fraction].
        """
        right = self.predict(X) == np.array([self._reported(one) for one in column_or_1d(y)], dtype=object)
        return float(np.average(right, weights=sample_weight))

    def judge(
        self,
        X: Any,
        y: Any,
        groups: Sequence[Any] | NDArray[Any] | None = None,
        blocks: int = 10,
    ) -> Verdicts:
        """Judge every run by a classifier learnt from the other groups: cross-validation.

        Parameters
        ----------
        X : array_like, shape (n, p)
            Features of each run, in the order in which the runs were made [any unit].
        y : array_like, shape (n,)
            Class of each run.
        groups : array_like, shape (n,), optional
            Group of each run; contiguous blocks of runs if not given.
        blocks : int
            Number of parts that are held back in turn.

        Returns
        -------
        Verdicts
            Verdicts on all runs. This classifier itself learns nothing.

        Raises
        ------
        HydrostateError
            If a reported class lies in one part alone, so that it cannot be learnt.
        """
        x, labels = np.asarray(X, dtype=np.float64), np.asarray(y)
        if x.ndim != 2 or len(x) != len(labels) or not 2 <= blocks <= len(labels):
            raise HydrostateError(
                f"features of shape (runs, features), as many labels, and blocks from 2 to that are needed, got "
                f"features {x.shape}, {len(labels)} labels, {blocks} blocks"
            )
        learnt, places = np.unique(labels, return_inverse=True)
        classes, merged = _merged_classes(learnt, self.merge)
        true, group = merged[places], None if groups is None else np.asarray(groups)
        probabilities, likeness = np.zeros((len(x), len(classes))), np.zeros(len(x))
        for held in folds(true if groups is None else places, group, blocks):
            rest = np.setdiff1d(np.arange(len(x)), held)
            lacking = np.setdiff1d(np.arange(len(classes)), true[rest])
            if lacking.size:
                raise HydrostateError(f"class {classes[lacking[0]]} occurs in one block alone, so it cannot be learnt")
            part = type(self)(**self.get_params()).fit(x[rest], labels[rest], None if group is None else group[rest])
            probabilities[held], likeness[held] = part.predict_proba(x[held]), part.likeness(x[held])
        return Verdicts(tuple(str(one) for one in classes), true, probabilities, likeness)

    def _features(self, X: Any) -> Array:
        """Return features in the learnt order, after scikit-learn's checks."""
        check_is_fitted(self)
        checked: Any = validate_data(self, X, reset=False, dtype=np.float64)
        return np.asarray(checked, dtype=np.float64)

    def _reported(self, label: Any) -> Any:
        """Return the name under which a label is reported; a label that was not learnt keeps its own."""
        known = np.flatnonzero(self.learnt_classes_ == label)
        return self.classes_[self._merged[known[0]]] if known.size else label


def _merged_classes(learnt: NDArray[Any], merge: Merge) -> tuple[NDArray[Any], IntArray]:
    """Return the reported classes, and the index of each learnt class among them."""
    if merge is None:
        return learnt, np.arange(len(learnt))
    if isinstance(merge, str):
        names = [str(one).split(merge)[0] for one in learnt]
    elif isinstance(merge, Mapping):
        names = [merge.get(one, one) for one in learnt.tolist()]
    elif callable(merge):
        names = [merge(one) for one in learnt.tolist()]
    else:
        raise HydrostateError(f"merge must be a text, a mapping or a function of a label, got {merge!r}")
    classes, merged = np.unique(np.array(names), return_inverse=True)
    return classes, merged.astype(np.int64)


def _fit_on_held_back(
    x: Array, places: IntArray, merged: IntArray, groups: Sequence[Any] | NDArray[Any] | None
) -> tuple[float, Calibration, Array]:
    """Return the shrinkage and calibration that make held-back runs most probable, and the distances of these runs."""
    scores, far = [list[Array]() for _ in SHRINKAGES], [list[Array]() for _ in SHRINKAGES]
    true = list[IntArray]()
    try:
        parts = folds(places, groups, INNER_FOLDS, MOST_HELD_BACK)
    except HydrostateError:
        parts = list[IntArray]()
    for held in parts:
        rest = np.setdiff1d(np.arange(len(x)), held)
        judged = held[np.isin(merged[places[held]], merged[places[rest]])]
        if len(np.unique(merged[places[rest]])) < 2 or not judged.size:
            continue
        true.append(merged[places[judged]])
        for k, part in enumerate(learn(x[rest], places[rest], len(merged), SHRINKAGES)):
            scores[k].append(part.scores(x[judged]))
            far[k].append(part.distances(x[judged]))
    if not true:
        return SHRINKAGES[0], Calibration(), np.zeros((0, 2))
    labels, best, loss = np.concatenate(true), 0, np.inf
    found = [fit_calibration(np.concatenate(one), merged, labels) for one in scores]
    for k, one in enumerate(found):
        now = log_loss(one.probabilities(np.concatenate(scores[k]), merged), labels)
        if now < (1.0 - LEAST_IMPROVEMENT) * loss:
            best, loss = k, now
    return SHRINKAGES[best], found[best], np.sort(np.concatenate(far[best]), axis=0)


def _likeness(known: Array, distances: Array) -> Array:
    """Return the share of known distances, the run itself included, that are as large; twice the smaller one."""
    if not len(known):
        return np.ones(len(distances))
    beyond = [
        len(known) - np.searchsorted(one, other, side="left") for one, other in zip(known.T, distances.T, strict=True)
    ]
    return np.minimum(2.0 * (np.min(beyond, axis=0) + 1.0) / (len(known) + 1.0), 1.0)
