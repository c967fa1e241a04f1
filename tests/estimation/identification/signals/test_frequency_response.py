"""Responses have confidence circles that cover, and a multisine separates noise, odd and even distortion."""

import numpy as np
import pytest

from benchmarks.identification.frequency_response import (
    DAMPED,
    NUMERATOR,
    PERIOD,
    PERIODS,
    multisine,
    odd_lines,
    plant_output,
)
from estimation.identification.model.recursion import filtered
from estimation.identification.signals.distortion import best_linear_approximation
from estimation.identification.signals.local_polynomial import local_polynomial_response
from estimation.identification.signals.measured_response import measured_response
from estimation.identification.signals.period import find_period
from plant.errors import HydrostateError

DENOMINATOR = [1.0, -1.6, 0.75]


def _truth(frequency: np.ndarray, denominator: list[float]) -> np.ndarray:  # type: ignore[type-arg]
    z = np.exp(-2j * np.pi * frequency)
    return np.polyval(NUMERATOR[::-1], z) / np.polyval(denominator[::-1], z)


def test_confidence_circles_of_the_local_polynomial_method_contain_the_true_response() -> None:
    covered: list[float] = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        u = rng.normal(size=2048)
        y = filtered(NUMERATOR, DENOMINATOR, u) + 0.1 * rng.normal(size=2048)
        found = local_polynomial_response(u, y, 1.0)
        covered.append(float(np.mean(np.abs(found.response - _truth(found.frequency, DENOMINATOR)) <= found.radius())))
    assert 0.925 < np.mean(covered) < 0.975


def test_leakage_is_modelled() -> None:
    rng = np.random.default_rng(7)
    u = rng.normal(size=3048)
    y = filtered(NUMERATOR, DENOMINATOR, u)
    found = local_polynomial_response(u[1000:], y[1000:], 1.0)
    truth = _truth(found.frequency, DENOMINATOR)
    error = np.abs(found.response - truth)
    plain = np.fft.rfft(y[1000:])[1:1024] / np.fft.rfft(u[1000:])[1:1024]
    assert np.median(error) < 0.05 * np.median(np.abs(plain - truth))


@pytest.fixture(scope="module")
def log() -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    rng = np.random.default_rng(3)
    u = np.tile(multisine(odd_lines(rng), rng), PERIODS)
    return u, plant_output(u, DAMPED) + 0.02 * rng.normal(size=len(u))


def test_noise_and_odd_and_even_distortion_are_separated(log: tuple[np.ndarray, np.ndarray]) -> None:  # type: ignore[type-arg]
    u, y = log
    told = best_linear_approximation(u, y, 1.0)
    assert (told.period, told.periods) == (PERIOD, PERIODS - 1)
    # the lines of a period share the noise variance, which the mean over the periods reduces
    assert np.mean(told.noise) == pytest.approx(0.02**2 / PERIOD / (PERIODS - 1), rel=0.05)
    assert abs(told.level(odd=False)) < 0.1 * np.mean(told.noise)
    assert told.level(odd=True) > 20.0 * np.mean(told.noise)
    squared = best_linear_approximation(u, y + 0.3 * filtered(NUMERATOR, DAMPED, u) ** 2, 1.0)
    assert squared.level(odd=False) > 10.0 * np.mean(told.noise)
    assert squared.level(odd=True) == pytest.approx(told.level(odd=True), rel=0.2)


def test_confidence_circles_of_the_best_linear_approximation_include_its_distortion(
    log: tuple[np.ndarray, np.ndarray],  # type: ignore[type-arg]
) -> None:
    found = best_linear_approximation(*log, 1.0).response
    linear = _truth(found.frequency, DAMPED)
    gain = np.vdot(linear, found.response) / np.vdot(linear, linear)
    assert 0.9 < np.mean(np.abs(found.response - gain * linear) <= found.radius()) < 0.99


def test_a_multisine_without_silent_lines_gives_no_distortion_level() -> None:
    rng = np.random.default_rng(5)
    u = np.tile(multisine(np.arange(1, PERIOD // 2), rng), 3)
    told = best_linear_approximation(u, u + 0.01 * rng.normal(size=len(u)), 1.0)
    assert np.isnan(told.level(odd=True))
    assert told.response.freedom == 1
    assert np.median(np.abs(told.response.response - 1.0)) < 0.02


def test_a_period_is_found_and_a_random_walk_or_a_constant_has_none() -> None:
    rng = np.random.default_rng(6)
    one = rng.normal(size=250)
    assert find_period(np.concatenate([np.tile(one, 4), one[:70]])) == 250
    assert find_period(np.cumsum(rng.normal(size=1000))) is None
    assert find_period(np.ones(100)) is None


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: local_polynomial_response(np.zeros(100), np.zeros(90), 1.0), "of one length without gaps"),
        (
            lambda: local_polynomial_response(np.arange(20.0), np.arange(20.0), 1.0),
            "28 samples or more are needed, got 20",
        ),
        (lambda: local_polynomial_response(np.zeros(100), np.ones(100), 1.0), "must hold all frequencies"),
        (lambda: best_linear_approximation(np.arange(99.0), np.arange(99.0), 1.0), "does not repeat itself"),
        (lambda: best_linear_approximation(np.tile(np.arange(50.0), 2), np.ones(100), 1.0), "got 1 of 50"),
        (lambda: best_linear_approximation(np.full(99, np.nan), np.ones(99), 1.0), "without gaps"),
    ],
)
def test_unusable_signals_are_refused(call: object, said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        call()  # type: ignore[operator]


def test_the_method_depends_on_whether_the_input_is_periodic(log: tuple[np.ndarray, np.ndarray]) -> None:  # type: ignore[type-arg]
    u, y = log
    assert measured_response(u, y, 1.0).method == "multisine"
    rng = np.random.default_rng(8)
    told = measured_response(v := rng.normal(size=500), v, 0.1)
    assert (told.method, told.to_dict()["periods"]) == ("local-polynomial", None)
    with pytest.raises(HydrostateError, match="needs every sample of the output, got 1 that are missing"):
        measured_response(v, np.where(np.arange(500) == 3, np.nan, v), 0.1)


def test_the_interval_of_a_distortion_level_matches_its_scatter_between_multisines(
    log: tuple[np.ndarray, np.ndarray],  # type: ignore[type-arg]
) -> None:
    every: list[tuple[float, float, float]] = []
    for seed in range(30):
        rng = np.random.default_rng([11, seed])
        u = np.tile(multisine(odd_lines(rng), rng), 3)
        told = best_linear_approximation(u, plant_output(u, DAMPED) + 0.02 * rng.normal(size=len(u)), 1.0)
        every.append((told.level(odd=True), *told.level_interval(odd=True)))
    level, low, high = np.array(every).T
    mean = level.mean()
    assert np.all((low < level) & (level < high))
    assert 0.8 <= np.mean((low <= mean) & (mean <= high)) <= 1.0
    # neither so wide that it is useless, nor as narrow as for independent lines
    scatter = np.std(np.log(level))
    assert 1.2 * scatter < np.median(np.log(high / low)) / 2.0 < 4.0 * scatter
    told = best_linear_approximation(*log, 1.0)
    wanted = told.period_wanted(odd=True)
    assert wanted is not None
    assert wanted > PERIOD


def test_a_distortion_level_has_no_interval_if_the_lines_do_not_determine_its_scatter() -> None:
    rng = np.random.default_rng(2)
    every = multisine(np.arange(1, 3200), rng)
    u = np.tile(every, 3)
    told = best_linear_approximation(u, plant_output(u, DAMPED), 1.0)
    assert np.isnan(told.level_interval(odd=True)).all()
    assert told.period_wanted(odd=True) is None
    found = measured_response(u, plant_output(u, DAMPED), 1.0).to_dict()
    assert found["odd_power_interval"] is None
    # lines far apart on a sharp resonance: the residual of a smooth response is not distortion there
    lines = 64 * np.arange(1, 50, 2) - 1
    u = np.tile(multisine(lines, rng), 3)
    coarse = best_linear_approximation(u, filtered([0.0, 0.1], [1.0, -1.9, 0.99], u), 1.0)
    assert np.isnan(coarse.level_interval(odd=True)).all()
