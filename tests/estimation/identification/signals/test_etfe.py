from collections.abc import Callable

import numpy as np
import pytest

from estimation.identification import FrequencyResponse, LinearModel, etfe_welch
from estimation.identification.signals.etfe import etfe
from plant.errors import HydrostateError

Estimator = Callable[..., FrequencyResponse]
BOTH = pytest.mark.parametrize("estimator", [etfe, etfe_welch])


@BOTH
def test_the_estimate_agrees_with_the_model_within_its_deviation(estimator: Estimator, plant_30hz: LinearModel) -> None:
    rng = np.random.default_rng(1)
    u = rng.standard_normal(20_000)
    y = plant_30hz.simulate(u)
    estimate = estimator(u, y + 0.1 * y.std() * rng.standard_normal(u.size), 1e-3)
    inside = (estimate.frequency_hz > 2.0) & (estimate.frequency_hz < 80.0)
    truth = plant_30hz.frequency_response(estimate.frequency_hz)
    error = np.abs(np.abs(estimate.response) - np.abs(truth))[inside] / estimate.gain_std[inside]
    assert 0.85 <= np.mean(error < 1.96) <= 1.0
    np.testing.assert_allclose(np.angle(estimate.response / truth)[inside], 0.0, atol=0.15)


@BOTH
def test_coherence_is_one_without_noise_and_falls_with_it(estimator: Estimator) -> None:
    rng = np.random.default_rng(2)
    u = rng.standard_normal(8_000)
    assert estimator(u, 3.0 * u, 1e-3).coherence.min() > 1.0 - 1e-9
    noisy = estimator(u, 3.0 * u + 3.0 * rng.standard_normal(u.size), 1e-3).coherence
    assert np.mean(noisy) == pytest.approx(0.5, abs=0.07)
    assert np.mean(estimator(u, rng.standard_normal(u.size), 1e-3).coherence) < 0.2


@BOTH
def test_frequencies_without_input_power_are_left_out(estimator: Estimator) -> None:
    u = np.tile([1.0, -1.0], 500)
    u[::7] *= 1.1
    estimate = estimator(u, 2.0 * u, 1e-3)
    assert np.isfinite(estimate.response).all()
    assert np.isfinite(estimate.gain_std).all()


def test_a_longer_window_resolves_more() -> None:
    u = np.random.default_rng(3).standard_normal(4_000)
    assert etfe(u, u, 1e-3, lag_window=400).resolution_hz == pytest.approx(2.5)
    assert etfe(u, u, 1e-3, lag_window=100).frequency_hz.size == 101


@BOTH
@pytest.mark.parametrize(
    ("u", "y", "message"),
    [
        (np.arange(100.0), np.arange(99.0), "of one length"),
        (np.arange(10.0), np.arange(10.0), "64 samples or longer"),
        (np.ones(100), np.arange(100.0), "must vary, got the constant 1"),
        (np.arange(100.0), np.where(np.arange(100) == 3, np.nan, 1.0), "without gaps"),
    ],
)
def test_unusable_data_are_refused(estimator: Estimator, u: np.ndarray, y: np.ndarray, message: str) -> None:
    with pytest.raises(HydrostateError, match=message):
        estimator(u, y, 1e-3)


def test_windows_that_do_not_fit_are_refused() -> None:
    u = np.random.default_rng(4).standard_normal(100)
    with pytest.raises(HydrostateError, match="lag_window"):
        etfe(u, u, 1e-3, lag_window=60)
    with pytest.raises(HydrostateError, match="segment_length"):
        etfe_welch(u, u, 1e-3, segment_length=90)
    with pytest.raises(HydrostateError, match="sample_time"):
        etfe(u, u, 0.0)
