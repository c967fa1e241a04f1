"""Deviations of unknowns count the noise of each output by its own colour, and only samples that are there."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.arrays import Array
from estimation.equations.conclude import _spread
from estimation.equations.problem import Problem

N, LOGS = 900, 2


def slow(rng: np.random.Generator, n: int) -> Array:
    return np.asarray(lfilter([1.0], [1.0, -0.95], rng.standard_normal(n + 200))[200:], dtype=np.float64)


def stand_in(measured: list[Array]) -> Problem:
    return cast(Problem, SimpleNamespace(parts=[SimpleNamespace(measured=one) for one in measured]))


def levels(rng: np.random.Generator, n: int) -> Array:
    return np.repeat(rng.uniform(-1.0, 1.0, n // 30), 30)


def test_white_output_does_not_take_on_the_colour_of_a_slow_one() -> None:
    rng = np.random.default_rng(1)
    quiet, wanders = ([rng.standard_normal(N) for _ in range(LOGS)], [slow(rng, N) for _ in range(LOGS)])
    drives = [levels(rng, N) for _ in range(LOGS)]
    rows = [np.stack([a, b]) for a, b in zip(quiet, wanders, strict=True)]
    # the first unknown moves the first output alone, the second the second
    slopes = np.concatenate(
        [np.kron(np.array([[1.0, 0.0], [0.0, 1.0]]), drive[:, None]).reshape(2 * N, 2) for drive in drives]
    )
    errors = np.concatenate([row.ravel() for row in rows])
    both = _spread(stand_in(rows), slopes, errors)
    power = sum(float(drive @ drive) for drive in drives)
    assert both[0, 0] == pytest.approx(1.0 / power, rel=0.2)
    alone = _spread(
        stand_in([one[None, :] for one in wanders]), np.concatenate(drives)[:, None], np.concatenate(wanders)
    )
    assert both[1, 1] == pytest.approx(alone[0, 0], rel=1e-3)


@pytest.mark.parametrize("missing", [0.0, 0.5])
def test_intervals_cover_where_slow_noise_has_gaps(missing: float) -> None:
    inside, runs = 0, 200
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        drive, noise = levels(rng, N), slow(rng, N)
        there = rng.random(N) >= missing
        measured, slopes = np.where(there, noise, np.nan), np.where(there, drive, 0.0)
        error = float(slopes @ np.nan_to_num(measured)) / float(slopes @ slopes)
        left = np.where(there, noise - error * drive, 0.0)
        spread = _spread(stand_in([measured[None, :]]), slopes[:, None], left)
        inside += int(abs(error) < 1.96 * np.sqrt(spread[0, 0]))
    assert 0.90 <= inside / runs <= 0.99
