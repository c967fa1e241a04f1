from types import SimpleNamespace

import numpy as np
import pytest

from estimation.greybox import GreyBoxModel, compile_fit, fit_greybox
from plant.compiled.functions import Scalar
from plant.eha import EhaParameters
from plant.integrate import parameter_row

T = 1e-3
ROW = parameter_row(EhaParameters())


def lag_step(
    state: tuple[Scalar], drives: tuple[tuple[Scalar, Scalar]], p: SimpleNamespace, h: Scalar
) -> tuple[Scalar]:
    ((start, end),) = drives
    return ((state[0] + h / p.lag * p.gain * 0.5 * (start + end)) / (1.0 + h / p.lag),)


LAG = GreyBoxModel(
    name="lag_test",
    drives=("motor_speed_rad_s",),
    output="velocity_m_s",
    unknowns=("gain", "lag"),
    initial=lambda _: (0.0,),
    step=lag_step,
    observe=lambda state: state[0],
)
TRUTH = np.log([3e-4, 0.02])


def drive(rng: np.random.Generator, n: int = 4000) -> np.ndarray:
    return np.repeat(rng.choice([-100.0, 100.0], size=n // 50), 50)[:, None]


def noisy_log(seed: int, deviation: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    u = drive(rng)
    y, _ = compile_fit(LAG)(TRUTH, u, ROW, T, 1)
    return u, y + deviation * rng.standard_normal(len(y))


def fit(u: np.ndarray, y: np.ndarray, deviation: float, start: tuple[float, float] = (1e-3, 0.1)):
    starts = [{"gain": start[0], "lag": start[1]}]
    return fit_greybox(LAG, u, y, ROW, T, starts=starts, variance=deviation**2, substeps=1)


def test_sensitivities_are_the_derivatives_of_the_prediction() -> None:
    u = drive(np.random.default_rng(1))
    run = compile_fit(LAG)
    _, slopes = run(TRUTH, u, ROW, T, 3)
    for j in range(2):
        step = np.eye(2)[j] * 1e-6
        numerical = (run(TRUTH + step, u, ROW, T, 3)[0] - run(TRUTH - step, u, ROW, T, 3)[0]) / 2e-6
        np.testing.assert_allclose(slopes[:, j], numerical, rtol=1e-5, atol=1e-6 * np.abs(numerical).max())


def test_parameters_come_back_from_a_noisy_log_within_their_intervals() -> None:
    deviation = 1e-3
    found = fit(*noisy_log(3, deviation), deviation)
    for name, truth in (("gain", 3e-4), ("lag", 0.02)):
        assert abs(np.log(found.values[name] / truth)) < 3.0 * found.log_std[name] < 0.05
    assert found.chi_square == pytest.approx(1.0, abs=0.1)
    assert abs(found.autocorrelation) < 0.05


@pytest.mark.slow
def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    deviation = 1e-3
    inside = 0
    for seed in range(200):
        found = fit(*noisy_log(1000 + seed, deviation), deviation)
        inside += abs(np.log(found.values["lag"] / 0.02)) < 1.96 * found.log_std["lag"]
    assert 0.90 <= inside / 200 <= 0.985


def test_missing_samples_are_left_out() -> None:
    deviation = 1e-3
    u, y = noisy_log(4, deviation)
    whole = fit(u, y, deviation)
    holed = y.copy()
    holed[100:140] = np.nan
    found = fit(u, holed, deviation)
    assert found.values["lag"] == pytest.approx(whole.values["lag"], rel=0.02)
    assert np.isnan(found.residual[100:140]).all()


def test_gross_outliers_move_the_answer_little() -> None:
    deviation = 1e-3
    u, y = noisy_log(5, deviation)
    spoiled = y.copy()
    spoiled[::100] += 0.5
    found = fit(u, spoiled, deviation)
    assert found.values["gain"] == pytest.approx(3e-4, rel=0.03)


def test_a_parameter_that_the_log_does_not_feel_is_called_undetermined() -> None:
    u, y = np.zeros((500, 1)), 1e-3 * np.random.default_rng(6).standard_normal(500)
    found = fit(u, y, 1e-3)
    assert found.log_std["lag"] == np.inf
