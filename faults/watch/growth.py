"""When slow growth began: a steady level that then rises or jumps."""

import numpy as np

from faults.watch.events import INTERVAL_DROP
from plant.arrays import Array

FEWEST = 4
"""Least number of levels for an answer."""

MOST_ALIKE = 0.95
"""Upper limit of the correlation of neighbouring levels [fraction]: so few levels do not determine it better."""

LARGEST_OIL_SHIFT = 0.1
"""Largest shift of a rise's beginning by simultaneous drift of the oil, relative to the rise's duration [fraction]
(judged)."""

WIDENED_SPANS = 2
"""Number of spans by which the interval is widened at both ends: the first spans of a rise contain little of it."""


def growth_time(levels: Array, ends: Array) -> tuple[float, tuple[float, float]]:
    """Return the time since which levels have risen, by least squares: a steady level that turns into a slope or jumps.

    Parameters
    ----------
    levels : ndarray, shape (n,)
        Level of each span, the oldest first; the last one is raised [any unit].
    ends : ndarray, shape (n,)
        End of each span [s].

    Returns
    -------
    tuple
        When the rise began [s], and its 95 % interval [s], which is wider if the residuals are correlated, as with
        drifting oil.

    Examples
    --------
    >>> growth_time(np.array([1.0, 1.1, 0.9, 1.0, 1.0, 2.0, 3.1, 3.9]), 10.0 * np.arange(1, 9))
    (50.0, (27.0, 73.0))
    """
    if len(levels) < FEWEST:
        return float(ends[0]), (float(ends[0]), float(ends[-1]))
    slopes = np.maximum(ends[None, :] - ends[:-2, None], 0.0)
    shapes = np.concatenate([slopes, (slopes > 0.0).astype(np.float64)])
    missed = _squared_residuals(shapes, levels).reshape(2, -1)
    best = shapes[missed.argmin()] - shapes[missed.argmin()].mean()
    left = levels - levels.mean() - best * float(best @ levels) / float(best @ best)
    missed = missed.min(axis=0)
    variance = max(float(missed.min()) / (len(levels) - FEWEST + 1), 1e-30)
    alike = min(max(float(left[1:] @ left[:-1]) / max(float(left @ left), 1e-30), 0.0), MOST_ALIKE)
    apart = 2.0 * INTERVAL_DROP * variance * (1.0 + alike) / (1.0 - alike)
    likely = np.flatnonzero(missed <= missed.min() + apart)
    first, last = max(int(likely[0]) - WIDENED_SPANS, 0), min(int(likely[-1]) + WIDENED_SPANS, len(ends) - 1)
    since = float(ends[missed.argmin()])
    moved = LARGEST_OIL_SHIFT * (float(ends[-1]) - since)
    return since, (float(ends[first]) - moved, min(float(ends[last]) + moved, float(ends[-1])))


def _squared_residuals(shapes: Array, levels: Array) -> Array:
    """Return the sums of squared residuals of a constant and of each shape, shape (shapes,)."""
    centred = shapes - shapes.mean(axis=1, keepdims=True)
    away = levels - levels.mean()
    explained = np.maximum(centred @ away, 0.0) ** 2 / np.maximum((centred**2).sum(axis=1), 1e-30)
    return float(away @ away) - explained
