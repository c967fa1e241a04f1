"""Logs of a second-order plant with one or two inputs."""

from functools import cache

import numpy as np

from estimation.identification.free_run.data import Channels, channels_from
from plant.arrays import Array

RNG = np.random.default_rng(59)
N = 300
U: Array = np.repeat(RNG.choice([-1.0, 1.0], (N // 5, 2)), 5, axis=0) + 0.2 * RNG.standard_normal((N, 2)) + 0.5
NOISE: Array = RNG.standard_normal(N)
LOGS = (slice(0, 120), slice(120, N))


def answer(noise: float = 0.1, delay: int = 1, two: bool = True) -> Array:
    y = np.zeros(N)
    for t in range(2, N):
        y[t] = 1.4 * y[t - 1] - 0.6 * y[t - 2] + 0.3 * U[max(t - delay, 0), 0] + (0.1 * U[t - 1, 1] if two else 0.0)
    return y + noise * NOISE + 4.0


@cache
def channels(inputs: int = 1, lost: bool = False, delay: int = 1) -> Channels:
    y = answer(delay=delay, two=inputs == 2)
    y = np.where(np.arange(N) % 13 == 5, np.nan, y) if lost else y
    names = ("a", "b")[:inputs]
    return channels_from([U[one, :inputs] for one in LOGS], [y[one] for one in LOGS], 0.1, names, "y")
