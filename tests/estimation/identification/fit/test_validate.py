from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.identification import LinearModel, estimate_initial_state, fit_output_error
from estimation.identification.fit.validate import (
    ResidualTest,
    cross_correlation_test,
    fit_percent,
    ljung_box,
    rmse,
    validate,
)
from plant.errors import HydrostateError

Binary = Callable[..., np.ndarray]


def test_a_perfect_simulation_fits_100_percent_and_the_mean_0_percent() -> None:
    y = np.array([1.0, 2.0, np.nan, 6.0])
    assert fit_percent(y, np.array([1.0, 2.0, 0.0, 6.0])) == 100.0
    assert fit_percent(y, np.full(4, 3.0)) == 0.0
    assert rmse(y, np.array([1.0, 2.0, 0.0, 3.0])) == pytest.approx(np.sqrt(3.0))


def test_the_ljung_box_statistic_equals_the_textbook_formula() -> None:
    e = np.random.default_rng(1).standard_normal(300)
    e -= e.mean()
    r = [e[k:] @ e[:-k] / (e @ e) for k in range(1, 11)]
    expected = 300 * 302 * sum(value**2 / (300 - k) for k, value in enumerate(r, start=1))
    assert ljung_box(e, n_lags=10).statistic == pytest.approx(expected, rel=1e-12)


def test_white_residuals_pass_and_coloured_ones_fail() -> None:
    white = np.random.default_rng(2).standard_normal(2_000)
    white[100:130] = np.nan
    assert ljung_box(white).passed()
    assert not ljung_box(lfilter([1.0], [1.0, -0.3], np.random.default_rng(2).standard_normal(2_000))).passed()


def test_the_whiteness_test_keeps_its_nominal_rejection_rate() -> None:
    rng = np.random.default_rng(3)
    rejected = [not ljung_box(rng.standard_normal(500)).passed() for _ in range(400)]
    assert 0.02 < np.mean(rejected) < 0.08


def right_model_s_verdict(plant: LinearModel, binary: Binary, seed: int) -> ResidualTest:
    rng = np.random.default_rng([4, seed])
    u = binary(rng, 2_000, 20)
    y = plant.simulate(u)
    y = y + 0.1 * y.std() * rng.standard_normal(u.size)
    fitted = fit_output_error(u, y, 1e-3, n_numerator=2, n_denominator=2, delay=1)
    return validate(fitted, u, y, fitted=True).cross_correlation


def test_the_residual_of_the_right_model_is_uncorrelated_with_the_input(
    plant_30hz: LinearModel, binary: Binary
) -> None:
    assert right_model_s_verdict(plant_30hz, binary, 0).passed()


@pytest.mark.slow
def test_the_cross_correlation_test_keeps_its_nominal_rejection_rate(plant_30hz: LinearModel, binary: Binary) -> None:
    rejected = [not right_model_s_verdict(plant_30hz, binary, seed).passed() for seed in range(200)]
    assert 0.02 < np.mean(rejected) < 0.08


def test_the_cross_correlation_test_rejects_too_low_an_order(plant_30hz: LinearModel, binary: Binary) -> None:
    rng = np.random.default_rng(5)
    u = binary(rng, 3_000, 20)
    y = plant_30hz.simulate(u)
    y = y + 0.1 * y.std() * rng.standard_normal(u.size)
    first_order = fit_output_error(u, y, 1e-3, n_numerator=1, n_denominator=1, delay=1)
    verdict = validate(first_order, u, y, fitted=True)
    assert verdict.cross_correlation.p_value < 1e-6
    assert verdict.fit_percent == pytest.approx(first_order.fit_percent, rel=1e-9)
    assert verdict.rmse == pytest.approx(first_order.rmse, rel=1e-9)


def test_the_initial_state_of_a_log_in_motion_is_estimated(plant_30hz: LinearModel, binary: Binary) -> None:
    rng = np.random.default_rng(6)
    u = binary(rng, 600, 20)
    y = plant_30hz.simulate(u)[300:]
    y[50:60] = np.nan
    state = estimate_initial_state(plant_30hz, u[300:], y)
    np.testing.assert_allclose(
        plant_30hz.simulate(u[300:], initial=state)[:50], y[:50], atol=1e-9 * np.nanmax(np.abs(y))
    )


def test_the_degrees_of_freedom_of_the_cross_correlation_are_those_that_the_input_excites() -> None:
    rng = np.random.default_rng(7)
    u = np.sin(0.2 * np.arange(1_000))
    result = cross_correlation_test(rng.standard_normal(1_000), u)
    assert result.degrees_of_freedom == 2
    assert result.passed(0.001)


def test_residuals_that_do_not_match_are_refused() -> None:
    with pytest.raises(HydrostateError, match=r"\(5,\) and \(4,\)"):
        cross_correlation_test(np.zeros(5), np.zeros(4))
    with pytest.raises(HydrostateError, match="needs more samples"):
        cross_correlation_test(np.arange(30.0), np.arange(30.0) % 7)
    with pytest.raises(HydrostateError, match="n_parameters < n_lags < samples"):
        ljung_box(np.arange(20.0))
    with pytest.raises(HydrostateError, match="must match"):
        rmse(np.zeros(5), np.zeros(4))
    with pytest.raises(HydrostateError, match="at least one measured sample"):
        rmse(np.full(4, np.nan), np.zeros(4))
