"""Stamps of a clock with jitter."""

import numpy as np

from plant.arrays import Array

T = 2e-3
NOISE = np.random.default_rng(41).uniform(-1.0, 1.0, 60)
TICKS = np.arange(60.0)


def jittering(share: float, begin: float = 0.5, count: int = 60) -> Array:
    """Return stamps that jitter by at most a share of the sample time."""
    return begin + T * (TICKS + share * NOISE)[:count]
