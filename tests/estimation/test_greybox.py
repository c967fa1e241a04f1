from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.greybox import GreyBoxModel, compile_prediction
from estimation.greybox_fit import GreyBoxFit, fit_greybox
from estimation.greybox_problem import GreyBoxLog, OutputNoise
from plant.compiled.functions import Scalar
from plant.eha import EhaParameters
from plant.integrate import parameter_row

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
    linear=(("gain", 1e-4),),
)
TRUTH = LAG.theta({"gain": 3e-4, "lag": 0.02})


def drive(rng: np.random.Generator, n: int = 4000) -> np.ndarray:
    return np.repeat(rng.choice([-100.0, 100.0], size=n // 50), 50)[:, None]


def predicted(theta: np.ndarray, u: np.ndarray, steps: int = 1) -> tuple[np.ndarray, np.ndarray]:
    nothing, substeps = np.zeros((len(u), 1)), np.full(len(u), steps)
    return compile_prediction(LAG)(theta, u, nothing, ROW, T, substeps, 1)


def noisy_log(seed: int, deviation: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    u = drive(rng)
    y, _ = predicted(TRUTH, u)
    return u, y[:, 0] + deviation * rng.standard_normal(len(y))


def fit(u: np.ndarray, y: np.ndarray, noise: OutputNoise, **options: Any) -> GreyBoxFit:
    log = GreyBoxLog(u, y[:, None], ROW, T, np.ones(len(u), dtype=np.int64), (noise,), **options)
    return fit_greybox(LAG, log, starts=[{"gain": 1e-3, "lag": 0.1}])


def test_sensitivities_are_the_derivatives_of_the_prediction() -> None:
    u = drive(np.random.default_rng(1))
    _, slopes = predicted(TRUTH, u, 3)
    for j in range(2):
        step = np.eye(2)[j] * 1e-6
        numerical = (predicted(TRUTH + step, u, 3)[0] - predicted(TRUTH - step, u, 3)[0]) / 2e-6
        np.testing.assert_allclose(slopes[..., j], numerical, rtol=1e-5, atol=1e-6 * np.abs(numerical).max())


def test_a_block_holds_the_mean_over_the_samples_that_are_there() -> None:
    u, y = noisy_log(7, DEVIATION)
    y[[11, 12, 20, 21, 22, 23, 24]] = np.nan
    each, slopes = predicted(TRUTH, u)
    means, mean_slopes = compile_prediction(LAG)(TRUTH, u, y[:, None], ROW, T, np.ones(len(u), dtype=np.int64), 5)
    assert means[1:3, 0] == pytest.approx([np.mean((each[:, 0] - y)[5:10]), np.mean((each[:, 0] - y)[[10, 13, 14]])])
    assert mean_slopes[2, 0] == pytest.approx(np.mean(slopes[[10, 13, 14], 0], axis=0))
    assert (means[4, 0], *mean_slopes[4, 0]) == (0.0, 0.0, 0.0)


def test_unknowns_pass_through_their_coordinates_unchanged() -> None:
    assert LAG.values(LAG.theta({"gain": -3e-4, "lag": 0.02})) == pytest.approx({"gain": -3e-4, "lag": 0.02})


def test_parameters_come_back_from_a_noisy_log_within_their_intervals() -> None:
    found = fit(*noisy_log(3, DEVIATION), NOISE)
    for name, truth in (("gain", 3e-4), ("lag", 0.02)):
        assert abs(found.values[name] - truth) < 3.0 * found.std[name] < 0.15 * truth
    assert found.chi_square[0] == pytest.approx(1.0, abs=0.1)
    assert abs(found.autocorrelation[0]) < 0.05


@pytest.mark.slow
def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    inside = 0
    for seed in range(200):
        found = fit(*noisy_log(1000 + seed, DEVIATION), NOISE)
        inside += abs(found.values["lag"] - 0.02) < 1.96 * found.std["lag"]
    assert 0.90 <= inside / 200 <= 0.985


@pytest.mark.slow
def test_intervals_cover_where_the_drive_is_noisy_and_the_output_hardly() -> None:
    inside = 0
    for seed in range(100):
        u, y = noisy_log(2000 + seed, 0.1 * DEVIATION)
        blurred = u + 10.0 * np.random.default_rng(seed).standard_normal(u.shape)
        found = fit(blurred, y, OutputNoise((0.1 * DEVIATION) ** 2), drive_std=(10.0,))
        inside += abs(found.values["lag"] - 0.02) < 1.96 * found.std["lag"]
    assert inside >= 85


@pytest.mark.slow
def test_intervals_cover_where_a_random_walk_lies_over_the_output() -> None:
    inside = 0
    for seed in range(100):
        u, y = noisy_log(3000 + seed, DEVIATION)
        walk = np.cumsum(0.2 * DEVIATION * np.random.default_rng(seed).standard_normal(len(y)))
        found = fit(u, y + walk, OutputNoise(DEVIATION**2, (0.2 * DEVIATION) ** 2 / T))
        inside += abs(found.values["gain"] - 3e-4) < 1.96 * found.std["gain"]
    assert 88 <= inside <= 100


def test_missing_samples_are_left_out() -> None:
    u, y = noisy_log(4, DEVIATION)
    whole = fit(u, y, NOISE)
    holed = y.copy()
    holed[100:140] = np.nan
    found = fit(u, holed, NOISE)
    assert found.values["lag"] == pytest.approx(whole.values["lag"], rel=0.02)
    assert not found.normalised[100:140].any()


def test_gross_outliers_move_the_answer_little() -> None:
    u, y = noisy_log(5, DEVIATION)
    spoiled = y.copy()
    spoiled[::100] += 0.5
    found = fit(u, spoiled, NOISE)
    assert found.values["gain"] == pytest.approx(3e-4, rel=0.03)


def test_a_parameter_that_the_log_does_not_feel_is_called_undetermined() -> None:
    u, y = np.zeros((500, 1)), 1e-3 * np.random.default_rng(6).standard_normal(500)
    found = fit(u, y, NOISE)
    assert found.std["lag"] == np.inf
