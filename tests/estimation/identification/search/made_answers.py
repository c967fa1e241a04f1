"""Outputs of a second-order plant."""

import numpy as np

from plant.arrays import Array

RNG = np.random.default_rng(17)
U: Array = np.repeat(RNG.choice([-1.0, 1.0], 50), 4)
NOISE: Array = RNG.standard_normal(200)
WEIGHT: Array = (RNG.random(200) > 0.1).astype(float)
BOUNDS = np.array([0, 70, 200])
F: Array = np.array([1.0, -1.5, 0.7])


def answer(noise: float = 0.05, u: Array = U) -> Array:
    y = np.zeros(u.size)
    for t in range(2, u.size):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.3 * u[t - 1] - 0.1 * u[t - 2]
    return y + noise * np.resize(NOISE, u.size)
