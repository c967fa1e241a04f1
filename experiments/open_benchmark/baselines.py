"""Baseline classifiers of the condition: trained on the training split, judged on the test split."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.open_benchmark.features import kernel_features, random_kernels, simple_features
from plant.arrays import Array
from plant.errors import HydrostateError

Names = NDArray[np.str_]
Verdicts = Callable[[Array], Names]
"""Function from series, shape (logs, 4, samples), to the condition of each."""

KERNELS = 600
"""Number of random kernels of the ROCKET-type transform."""

RIDGES = np.logspace(-2, 4, 13)
"""Penalties among which leave-one-out cross-validation chooses."""


def ridge_classifier(X: Array, y: Names) -> Verdicts:
    """Return a one-against-rest ridge classifier of features, its penalty chosen by leave-one-out.

    Parameters
    ----------
    X : ndarray, shape (logs, features)
        Features of the training logs, any unit.
    y : ndarray, shape (logs,)
        Classes of the training logs.
    """
    names = np.unique(y)
    middle, size = X.mean(axis=0), X.std(axis=0) + 1e-12
    Z = (X - middle) / size
    targets = np.where(y[:, None] == names, 1.0, -1.0)
    offset = targets.mean(axis=0)
    U, s, Vt = np.linalg.svd(Z, full_matrices=False)
    loss, weights = np.inf, np.zeros((Z.shape[1], len(names)))
    for ridge in RIDGES:
        shrink = s**2 / (s**2 + ridge)
        fitted = U @ (shrink[:, None] * (U.T @ (targets - offset)))
        lever = np.sum(U**2 * shrink, axis=1, keepdims=True) + 1.0 / len(y)
        left_out = float(np.mean(((targets - offset - fitted) / np.maximum(1.0 - lever, 1e-6)) ** 2))
        if left_out < loss:
            loss = left_out
            weights = Vt.T @ ((s / (s**2 + ridge))[:, None] * (U.T @ (targets - offset)))
    return lambda other: names[np.argmax((other - middle) / size @ weights + offset, axis=1)]


def rocket(series: Array, y: Names) -> Verdicts:
    """Return a classifier by random convolution kernels and ridge regression (ROCKET's scheme, smaller).

    Parameters
    ----------
    series : ndarray, shape (logs, 4, samples)
        Training logs, SI.
    y : ndarray, shape (logs,)
        Conditions of the training logs.
    """
    sizes = np.std(series, axis=(0, 2))[:, None]
    kernels = random_kernels(KERNELS, series.shape[2], np.random.default_rng(0))
    classify = ridge_classifier(kernel_features(series / sizes, kernels), y)
    return lambda other: classify(kernel_features(other / sizes, kernels))


def _ridge_on_features(series: Array, y: Names) -> Verdicts:
    """Return a ridge classifier of simple features."""
    classify = ridge_classifier(simple_features(series), y)
    return lambda other: classify(simple_features(other))


def forest_on_features(series: Array, y: Names) -> Verdicts:
    """Return scikit-learn's random forest of simple features.

    Parameters
    ----------
    series : ndarray, shape (logs, 4, samples)
        Training logs, SI.
    y : ndarray, shape (logs,)
        Conditions of the training logs.

    Raises
    ------
    HydrostateError
        If scikit-learn is not installed.
    """
    try:
        ensemble: Any = import_module("sklearn.ensemble")
    except ImportError as error:
        raise HydrostateError("the forest needs scikit-learn: pip install 'hydrostate[learn]'") from error
    forest = ensemble.RandomForestClassifier(n_estimators=400, random_state=0).fit(simple_features(series), y)
    return lambda other: np.asarray(forest.predict(simple_features(other)))


LEARNERS: Mapping[str, Callable[[Array, Names], Verdicts]] = {
    "random forest on simple features": forest_on_features,
    "ridge on simple features": _ridge_on_features,
    "random kernels and ridge (ROCKET's scheme)": rocket,
}
"""Functions that train a classifier on labelled logs, by name."""
