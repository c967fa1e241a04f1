"""The interval of a ratio of errors covers the truth for errors correlated in time, and shrinks with longer tests."""

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.identification.paired_blocks import chance_of_lead, error_ratio, records_ratio
from estimation.arrays import Array


def errors(n: int, seed: int) -> Array:
    """Return two errors of equal power, correlated over about ten samples and with a common part, shape (2, n)."""
    drawn = np.random.default_rng(seed).normal(size=(3, n + 100))
    slow = np.asarray(lfilter([1.0], [1.0, -0.9], drawn, axis=1))[:, 100:]
    return slow[:2] + slow[2]


def test_the_error_ratios_interval_has_its_nominal_coverage() -> None:
    held = 0
    for seed in range(200):
        one, other = errors(3000, seed)
        _, low, high = error_ratio(one, 1.3 * other)
        held += low < 1.0 / 1.3 < high
    assert 0.87 * 200 <= held <= 0.99 * 200


def test_a_longer_test_gives_a_narrower_interval() -> None:
    widths: list[float] = []
    for n in (1000, 16_000):
        ends = [error_ratio(*errors(n, seed))[1:] for seed in range(20)]
        widths.append(float(np.mean([high - low for low, high in ends])))
    assert widths[1] < 0.4 * widths[0]


def test_a_larger_error_in_a_single_stretch_is_not_significant() -> None:
    one, other = errors(3000, 1)
    one[1200:1230] += 30.0
    ratio, low, _ = error_ratio(one, other)
    assert ratio > 1.3
    assert low < 1.1


def test_proportional_errors_have_an_interval_of_zero_width() -> None:
    one = errors(1000, 2)[0]
    assert error_ratio(2.0 * one, one) == (2.0, 2.0, 2.0)


def test_resampled_records_with_different_error_levels_give_nominal_coverage() -> None:
    held = 0
    for seed in range(200):
        levels = np.exp(0.3 * np.random.default_rng(seed).normal(size=(2, 16)))
        parts = [errors(400, 1000 * seed + number) for number in range(16)]
        one, other = ([level * part[k] for level, part in zip(levels[k], parts, strict=True)] for k in (0, 1))
        _, low, high = records_ratio(one, other)
        held += low < 1.0 < high
    assert 0.85 * 200 <= held <= 0.99 * 200


def test_equally_good_models_lead_as_often_as_their_scatter_says() -> None:
    leads, chances = 0, list[float]()
    for seed in range(300):
        one, other = errors(1500, seed)
        ratio, _, _ = error_ratio(one, other)
        leads += ratio > 1.02
        chances.append(chance_of_lead(one, 1.5 * other, 1.02))  # a true lead does not count
    assert leads / 300 == pytest.approx(float(np.mean(chances)), abs=0.08)


def test_a_ratio_that_does_not_scatter_is_no_matter_of_chance() -> None:
    one = errors(1000, 2)[0]
    assert chance_of_lead(2.0 * one, one, 1.02) == 0.0
