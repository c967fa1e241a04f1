from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.fit import GreyBoxFit, fit_greybox
from estimation.fits.greybox.log import BLOCK, GreyBoxLog, OutputNoise
from estimation.fits.greybox.problem import Problem
from estimation.models.greybox import GreyBoxModel
from plant.compiled.functions import Scalar
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_row

T = 1e-3
DEVIATION = 1e-3
NOISE = OutputNoise(DEVIATION**2)
ROW = parameter_row(EhaParameters())


def lag_rates(state: tuple[Scalar], drives: Any, p: SimpleNamespace, share: Scalar) -> tuple[Scalar]:
    (start, end), _ = drives
    return ((p.gain * (start + share * (end - start)) - state[0]) / p.lag,)


LAG = GreyBoxModel(
    name="lag_test",
    drives=("motor_speed_rad_s",),
    outputs=("velocity_m_s",),
    unknowns=("gain", "lag"),
    initial=lambda _: (0.0,),
    rates=lag_rates,
    observe=lambda state: (state[0],),
    parameters=EhaParameters,
    linear=(("gain", 1e-4),),
)
TRUTH = LAG.theta({"gain": 3e-4, "lag": 0.02})
START = [{"gain": 1e-3, "lag": 0.1}]


def drive(rng: np.random.Generator, n: int = 4000) -> np.ndarray:
    return np.repeat(rng.choice([-100.0, 100.0], size=n // 50), 50)[:, None]


def log_of(
    u: np.ndarray, y: np.ndarray, noise: OutputNoise = NOISE, sample_time: float = T, **options: Any
) -> GreyBoxLog:
    steps = np.full(len(u), options.pop("steps", 1))
    return GreyBoxLog(u, y[:, None], ROW, sample_time, steps, (noise,), **options)


def predicted(u: np.ndarray) -> np.ndarray:
    return DEVIATION * Problem(LAG, log_of(u, np.zeros(len(u)))).residuals(TRUTH)[0]


def noisy_log(seed: int, deviation: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    u = drive(rng)
    y = predicted(u)
    return u, y + deviation * rng.standard_normal(len(y))


def fit(u: np.ndarray, y: np.ndarray, noise: OutputNoise, **options: Any) -> GreyBoxFit:
    return fit_greybox(LAG, log_of(u, y, noise, **options), starts=START)


def test_slopes_are_the_derivatives_of_the_residuals() -> None:
    u, y = noisy_log(1, DEVIATION)
    problem = Problem(LAG, log_of(u, y, steps=3))
    slopes = problem.slopes(TRUTH)
    for j in range(2):
        step = np.eye(2)[j] * 1e-6
        numerical = (problem.residuals(TRUTH + step) - problem.residuals(TRUTH - step))[0] / 2e-6
        np.testing.assert_allclose(slopes[:, j], numerical, rtol=1e-5, atol=1e-6 * np.abs(numerical).max())


def test_normal_equations_weight_outliers_by_the_huber_loss() -> None:
    u, y = noisy_log(2, DEVIATION)
    y[::50] += 10.0 * DEVIATION
    problem = Problem(LAG, log_of(u, y))
    errors, slopes = problem.residuals(TRUTH)[0], problem.slopes(TRUTH)
    weight = np.minimum(1.0, 3.0 / np.abs(errors))
    point = problem.at(TRUTH)
    assert point.cost == pytest.approx(np.sum(np.where(weight < 1.0, 3.0 * np.abs(errors) - 4.5, 0.5 * errors**2)))
    np.testing.assert_allclose(point.gradient, slopes.T @ (weight * errors), rtol=1e-9)
    bend = np.where(weight < 1.0, 1e-3, 1.0)
    np.testing.assert_allclose(point.gram, slopes.T @ (bend[:, None] * slopes), rtol=1e-9)


def test_a_block_holds_the_mean_of_its_samples_that_are_not_missing() -> None:
    y = np.array([1.0, 2.0, 3.0, np.nan, 6.0, 8.0, np.nan, np.nan, np.nan, np.nan, 5.0])
    blocks = Problem(LAG, log_of(np.zeros((len(y), 1)), y, OutputNoise(4.0), sample_time=0.25 * BLOCK))
    # means over the root of the mean's variance, which is 4 over the number of samples
    assert blocks.residuals(TRUTH)[0] == pytest.approx([-2.0 * (3.0 / 4.0) ** 0.5, -7.0 * (2.0 / 4.0) ** 0.5, -2.5])


def test_residuals_of_a_random_walk_with_white_noise_are_white() -> None:
    u, rng = np.zeros((20_000, 1)), np.random.default_rng(8)
    y = np.cumsum(0.2 * DEVIATION * rng.standard_normal(len(u))) + DEVIATION * rng.standard_normal(len(u))
    out = Problem(LAG, log_of(u, y, OutputNoise(DEVIATION**2, (0.2 * DEVIATION) ** 2 / T))).residuals(TRUTH)[0]
    assert np.mean(out**2) == pytest.approx(1.0, abs=0.05)
    assert abs(out[1:] @ out[:-1]) / (out @ out) < 0.03


def test_the_variance_of_a_random_walk_grows_over_missing_samples() -> None:
    u, y = np.zeros((5, 1)), np.array([0.0, 0.0, np.nan, np.nan, -3.0])
    out = Problem(LAG, log_of(u, y, OutputNoise(1.0, 0.5 / T))).residuals(TRUTH)[0]
    assert out[:4].tolist() == [0.0, 0.0, 0.0, 0.0]
    # the level's variance: 0, then 1/3 after a sample at 1/2, then 1/2 more at each step until the last sample
    assert out[4] == pytest.approx(3.0 / (1.0 + 1.0 / 3.0 + 1.5) ** 0.5)


def test_the_unknown_jump_over_a_gap_in_the_drive_is_found_from_the_output() -> None:
    u, y = noisy_log(9, DEVIATION)
    bears = replace(LAG, name="lag_gap_test", jump=(1.0,))
    bridged = u.copy()
    bridged[1990:2010] = 0.0
    gaps = np.array([[1990.0, 2010.0, (100.0 * DEVIATION) ** 2]])
    spoilt, sound = (fit_greybox(bears, log_of(bridged, y, gaps=given), starts=START) for given in (gaps[:0], gaps))
    assert spoilt.chi_square[0] > 1.2
    assert sound.chi_square[0] == pytest.approx(1.0, abs=0.1)
    for name, truth in (("gain", 3e-4), ("lag", 0.02)):
        assert abs(sound.values[name] - truth) < 3.0 * sound.std[name] < 0.15 * truth


def test_unknowns_pass_through_their_coordinates_unchanged() -> None:
    assert LAG.values(LAG.theta({"gain": -3e-4, "lag": 0.02})) == pytest.approx({"gain": -3e-4, "lag": 0.02})


def test_parameters_come_back_from_a_noisy_log_within_their_intervals() -> None:
    found = fit(*noisy_log(3, DEVIATION), NOISE)
    for name, truth in (("gain", 3e-4), ("lag", 0.02)):
        assert abs(found.values[name] - truth) < 3.0 * found.std[name] < 0.15 * truth
    assert found.chi_square[0] == pytest.approx(1.0, abs=0.1)
    assert abs(found.autocorrelation[0]) < 0.05


@pytest.mark.slow
def test_intervals_cover_the_truth_at_their_nominal_rate() -> None:
    inside = 0
    for seed in range(200):
        found = fit(*noisy_log(1000 + seed, DEVIATION), NOISE)
        inside += abs(found.values["lag"] - 0.02) < 1.96 * found.std["lag"]
    assert 0.90 <= inside / 200 <= 0.985


@pytest.mark.slow
def test_intervals_cover_the_truth_with_a_noisy_drive_and_a_quiet_output() -> None:
    inside = 0
    for seed in range(100):
        u, y = noisy_log(2000 + seed, 0.1 * DEVIATION)
        blurred = u + 10.0 * np.random.default_rng(seed).standard_normal(u.shape)
        found = fit(blurred, y, OutputNoise((0.1 * DEVIATION) ** 2), drive_std=(10.0,))
        inside += abs(found.values["lag"] - 0.02) < 1.96 * found.std["lag"]
    assert inside >= 85


@pytest.mark.slow
def test_intervals_cover_the_truth_with_a_random_walk_on_the_output() -> None:
    inside = 0
    for seed in range(100):
        u, y = noisy_log(3000 + seed, DEVIATION)
        walk = np.cumsum(0.2 * DEVIATION * np.random.default_rng(seed).standard_normal(len(y)))
        found = fit(u, y + walk, OutputNoise(DEVIATION**2, (0.2 * DEVIATION) ** 2 / T))
        inside += abs(found.values["gain"] - 3e-4) < 1.96 * found.std["gain"]
    assert 88 <= inside <= 100


def test_missing_samples_hardly_change_the_fit() -> None:
    u, y = noisy_log(4, DEVIATION)
    whole = fit(u, y, NOISE)
    holed = y.copy()
    holed[100:140] = np.nan
    found = fit(u, holed, NOISE)
    assert found.values["lag"] == pytest.approx(whole.values["lag"], rel=0.02)
    assert found.chi_square[0] == pytest.approx(whole.chi_square[0], abs=0.05)


def test_gross_outliers_move_the_answer_little() -> None:
    u, y = noisy_log(5, DEVIATION)
    spoiled = y.copy()
    spoiled[::100] += 0.5
    found = fit(u, spoiled, NOISE)
    assert found.values["gain"] == pytest.approx(3e-4, rel=0.03)


def test_a_parameter_without_effect_on_the_log_has_an_infinite_deviation() -> None:
    u, y = np.zeros((500, 1)), 1e-3 * np.random.default_rng(6).standard_normal(500)
    found = fit(u, y, NOISE)
    assert found.std["lag"] == np.inf
