"""The robust covariance covers where noise is slow, samples are missing, and logs are short."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.arrays import Array, BoolArray
from estimation.identification.fit.covariances import covariances
from estimation.identification.fit.residual_noise import noise_spectrum
from estimation.identification.search.experiments import Experiments

RUNS = 200
"""Of each case: chance moves a coverage of 95 % by 1.5 points."""


def slow_noise(rng: np.random.Generator, n: int, pole: float) -> Array:
    return np.asarray(lfilter([1.0], [1.0, -pole], rng.standard_normal(n + 400))[400:], dtype=np.float64)


def every(_: np.random.Generator, n: int) -> BoolArray:
    return np.ones(n, dtype=np.bool_)


def one_in_two(rng: np.random.Generator, n: int) -> BoolArray:
    return rng.random(n) < 0.5


def each_fifth(_: np.random.Generator, n: int) -> BoolArray:
    return np.arange(n) % 5 == 0


@pytest.mark.parametrize(
    ("pole", "n", "logs", "there"),
    [
        pytest.param(0.95, 1000, 1, every, id="slow"),
        pytest.param(0.98, 1000, 1, every, id="very slow"),
        pytest.param(0.95, 1000, 1, one_in_two, id="half of the samples missing"),
        pytest.param(0.98, 5000, 1, each_fifth, id="a sensor of one row in five"),
        pytest.param(0.9, 150, 4, every, id="four short logs"),
        pytest.param(-0.6, 500, 1, every, id="fast"),
    ],
)
def test_intervals_behind_coloured_noise_cover(
    pole: float, n: int, logs: int, there: Callable[[np.random.Generator, int], BoolArray]
) -> None:
    inside = 0
    for seed in range(RUNS):
        rng = np.random.default_rng(seed)
        levels = np.repeat(rng.uniform(-1.0, 1.0, logs * n // 50), 50)
        noise = np.concatenate([slow_noise(rng, n, pole) for _ in range(logs)])
        columns, used = np.column_stack([levels, np.ones(levels.size)]), there(rng, levels.size)
        columns[~used] = 0.0
        measured = np.where(used, noise, 0.0)
        error = np.linalg.lstsq(columns, measured, rcond=None)[0]
        data = Experiments(levels, measured, used, np.arange(0, logs * n + 1, n))
        robust = covariances(columns, measured - columns @ error, data)[1]
        inside += int(abs(error[0]) < 1.96 * np.sqrt(robust[0, 0]))
    assert 0.90 <= inside / RUNS <= 0.99


def test_white_noise_gets_back_what_the_fit_absorbs() -> None:
    rng = np.random.default_rng(0)
    columns = np.linalg.qr(rng.standard_normal((60, 6)))[0]
    residual = rng.standard_normal(60)
    residual -= columns @ (columns.T @ residual)
    found = noise_spectrum([(residual, columns, np.ones(60, dtype=np.bool_))])
    assert found.variance == pytest.approx(float(residual @ residual) / 54.0, rel=0.02)


def test_density_adds_up_to_the_variance_of_a_narrow_line() -> None:
    t = np.arange(3000)
    residual = np.sin(0.05 * t) + 0.05 * np.random.default_rng(1).standard_normal(t.size)
    found = noise_spectrum([(residual, np.zeros((t.size, 0)), np.ones(t.size, dtype=np.bool_))])
    for size in (8192, 16384):
        assert np.fft.irfft(found.on_grid(size), size)[0] == pytest.approx(float(residual @ residual) / t.size)


def test_lags_of_a_handful_of_pairs_do_not_count() -> None:
    rows, rng = np.arange(2000), np.random.default_rng(0)
    noise, none = rng.standard_normal(rows.size), np.zeros((rows.size, 0))
    beside = each_fifth(rng, rows.size) | np.isin(rows, (501, 902, 1203))  # six pairs at most lags that are no fifth
    found = noise_spectrum([(np.where(beside, noise, 0.0), none, beside)])
    np.testing.assert_array_equal(found.coefficients, [1.0])
    np.testing.assert_array_equal(found.whitened[1:5], 0.0)


def test_an_experiment_without_samples_changes_nothing() -> None:
    rng, used = np.random.default_rng(2), np.ones(40, dtype=np.bool_)
    used[20:30] = False
    columns = np.where(used[:, None], rng.standard_normal((40, 2)), 0.0)
    residual = np.where(used, rng.standard_normal(40), 0.0)
    with_empty = Experiments(residual, residual, used, np.array([0, 20, 30, 31, 40]))
    without = Experiments(residual[used], residual[used], used[used], np.array([0, 20, 21, 30]))
    found, wanted = covariances(columns, residual, with_empty), covariances(columns[used], residual[used], without)
    for one, other in zip(found[:2], wanted[:2], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    assert np.linalg.eigvalsh(found[1]).min() > 0.0
