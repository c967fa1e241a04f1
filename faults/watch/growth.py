"""When slow growth began: a level that was steady, and then rises or jumps."""

import numpy as np

from faults.watch.events import LIKELY
from plant.arrays import Array

FEWEST = 4
"""Levels that it takes to say so."""


def growth_time(levels: Array, ends: Array) -> tuple[float, tuple[float, float]]:
    """Return since when levels have risen, by least squares over a steady level that turns into a slope or jumps.

    Parameters
    ----------
    levels : ndarray, shape (n,)
        Levels of spans, the oldest first, the last of them raised [any unit].
    ends : ndarray, shape (n,)
        When each span ended [s].

    Returns
    -------
    tuple
        When the rise began [s], and a 95 % interval of that [s], a span wider at both ends, and as if what the levels
        leave were white.

    Examples
    --------
    >>> growth_time(np.array([1.0, 1.1, 0.9, 1.0, 1.0, 2.0, 3.1, 3.9]), 10.0 * np.arange(1, 9))
    (50.0, (40.0, 60.0))
    """
    if len(levels) < FEWEST:
        return float(ends[0]), (float(ends[0]), float(ends[-1]))
    slopes = np.maximum(ends[None, :] - ends[:-2, None], 0.0)
    jumps = (slopes > 0.0).astype(np.float64)
    missed = np.minimum(_missed(slopes, levels), _missed(jumps, levels))
    variance = max(float(missed.min()) / (len(levels) - FEWEST + 1), 1e-30)
    likely = np.flatnonzero(missed <= missed.min() + 2.0 * LIKELY * variance)
    first, last = max(int(likely[0]) - 1, 0), int(likely[-1]) + 1
    return float(ends[missed.argmin()]), (float(ends[first]), float(ends[last]))


def _missed(shapes: Array, levels: Array) -> Array:
    """Return the squares that a constant and each shape leave, shape (shapes,)."""
    centred = shapes - shapes.mean(axis=1, keepdims=True)
    away = levels - levels.mean()
    explained = np.maximum(centred @ away, 0.0) ** 2 / np.maximum((centred**2).sum(axis=1), 1e-30)
    return float(away @ away) - explained
