"""The interval of a ratio of errors covers the truth for errors correlated in time, and shrinks with longer tests."""

import numpy as np
from scipy.signal import lfilter

from benchmarks.identification.paired_blocks import error_ratio, records_ratio
from estimation.arrays import Array


def errors(n: int, seed: int) -> Array:
    """Return two errors of equal power, correlated over about ten samples and with a common part, shape (2, n)."""
    drawn = np.random.default_rng(seed).normal(size=(3, n + 100))
    slow = np.asarray(lfilter([1.0], [1.0, -0.9], drawn, axis=1))[:, 100:]
    return slow[:2] + slow[2]


def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    held = 0
    for seed in range(200):
        one, other = errors(3000, seed)
        _, low, high = error_ratio(one, 1.3 * other)
        held += low < 1.0 / 1.3 < high
    assert 0.87 * 200 <= held <= 0.99 * 200


def test_a_longer_test_tells_more() -> None:
    widths: list[float] = []
    for n in (1000, 16_000):
        ends = [error_ratio(*errors(n, seed))[1:] for seed in range(20)]
        widths.append(float(np.mean([high - low for low, high in ends])))
    assert widths[1] < 0.4 * widths[0]


def test_what_one_stretch_alone_tells_is_not_sure() -> None:
    one, other = errors(3000, 1)
    one[1200:1230] += 30.0
    ratio, low, _ = error_ratio(one, other)
    assert ratio > 1.3
    assert low < 1.1


def test_the_same_errors_are_equal_for_sure() -> None:
    one = errors(1000, 2)[0]
    assert error_ratio(2.0 * one, one) == (2.0, 2.0, 2.0)


def test_records_of_unlike_levels_are_drawn_as_wholes() -> None:
    held = 0
    for seed in range(200):
        levels = np.exp(0.3 * np.random.default_rng(seed).normal(size=(2, 16)))
        parts = [errors(400, 1000 * seed + number) for number in range(16)]
        one, other = ([level * part[k] for level, part in zip(levels[k], parts, strict=True)] for k in (0, 1))
        _, low, high = records_ratio(one, other)
        held += low < 1.0 < high
    assert 0.85 * 200 <= held <= 0.99 * 200
