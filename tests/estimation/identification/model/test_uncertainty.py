import errno
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from estimation.arrays import Array
from estimation.identification import LinearModel, dc_gain_interval, fit_output_error
from estimation.identification.fit.profile_interval import _variance_ratio
from estimation.identification.model.uncertainty import _deviations, response_band
from estimation.identification.notes import IdentificationCode
from plant.errors import CovarianceWarning, HydrostateError

FORM = {"n_numerator": 3, "n_denominator": 2}


@pytest.fixture(scope="module")
def fitted(table6: dict[str, LinearModel]) -> LinearModel:
    rng = np.random.default_rng(1)
    u = 125.66 * np.repeat(rng.choice([-1.0, 1.0], 400), 50)
    clean = table6["major_leakage"].simulate(u)
    return fit_output_error(u, clean + 0.1 * clean.std() * rng.standard_normal(u.size), 1e-3, **FORM)


def spread_over_draws(model: LinearModel, quantity: str) -> np.ndarray:
    rng = np.random.default_rng(2)
    centre = np.concatenate([model.numerator, model.denominator[1:]])
    draws = rng.multivariate_normal(centre, model.covariance, size=1_000)
    found = [getattr(LinearModel(t[:3], np.array([1.0, *t[3:]]), 1e-3, "u", "y"), quantity) for t in draws]
    return np.array([np.sort_complex(np.atleast_1d(value)) for value in found])


@pytest.mark.parametrize(("quantity", "std"), [("dc_gain", "dc_gain_std"), ("bandwidth_hz", "bandwidth_std_hz")])
def test_deviations_equal_the_spread_over_coefficients_drawn_from_the_covariance(
    quantity: str, std: str, fitted: LinearModel
) -> None:
    assert getattr(fitted, std) == pytest.approx(spread_over_draws(fitted, quantity).real.std(), rel=0.08)


def test_poles_and_zeros_have_deviations_of_their_real_and_imaginary_parts(fitted: LinearModel) -> None:
    for quantity, std in (("poles", fitted.pole_std), ("zeros", fitted.zero_std)):
        drawn = spread_over_draws(fitted, quantity)
        assert std[0].real == pytest.approx(drawn.real.std(axis=0)[0], rel=0.08)
        assert std[0].imag == pytest.approx(drawn.imag.std(axis=0)[0], rel=0.08)


def test_a_band_of_the_response_contains_the_response(fitted: LinearModel) -> None:
    band = fitted.frequency_response([0.0, 1.0, 25.0], ci=0.95)
    gain = np.abs(fitted.frequency_response([0.0, 1.0, 25.0]))
    assert ((band.gain_low < gain) & (gain < band.gain_high)).all()
    assert band.gain_std[0] == fitted.dc_gain_std
    np.testing.assert_allclose(band.gain_high - gain, 1.959964 * band.gain_std, rtol=1e-6)


@pytest.mark.slow
def test_a_near_cancellation_is_noted_and_the_profile_interval_contains_the_true_gain(
    table6: dict[str, LinearModel],
) -> None:
    truth = table6["minor_leakage"]
    rng = np.random.default_rng(3)
    u = 125.66 * np.repeat(rng.choice([-1.0, 1.0], 400), 50)
    clean = truth.simulate(u)
    y = clean + 0.5 * clean.std() * rng.standard_normal(u.size)
    with pytest.warns(CovarianceWarning) as caught:
        model = fit_output_error(u, y, 1e-3, **FORM)
    (note,) = [one.message.note for one in caught]
    assert note.code == IdentificationCode.NEARLY_CANCEL
    assert note.data["deviations"] == model.cancellations[0].deviations
    assert model.cancellations
    low, high = dc_gain_interval(model, u, y)
    assert low < truth.dc_gain < high
    assert low < model.dc_gain < high


def test_without_cancellations_the_profile_interval_equals_that_of_the_covariance(
    table6: dict[str, LinearModel],
) -> None:
    rng = np.random.default_rng(4)
    u = 125.66 * np.repeat(rng.choice([-1.0, 1.0], 100), 50)
    clean = table6["major_leakage"].simulate(u)
    y = clean + 0.05 * clean.std() * rng.standard_normal(u.size)
    model = fit_output_error(u, y, 1e-3, **FORM)
    assert not model.cancellations
    low, high = dc_gain_interval(model, u, y)
    assert high - low == pytest.approx(2.0 * 1.96 * model.dc_gain_std, rel=0.03)


@pytest.mark.parametrize(
    ("gain", "white", "stretched"),
    [(4.0, 1.0, 4.0), (1.0, 1.0, 1.0), (1.0, 0.0, 1.0), (np.nan, 1.0, 1.0), (1.0, np.nan, 1.0), (0.0, 0.0, 1.0)],
)
def test_a_profile_interval_is_widened_by_the_ratio_of_coloured_to_white_gain_variance(
    gain: float, white: float, stretched: float
) -> None:
    def spread(variance: float) -> Array:
        return np.array([[variance, 0.0], [0.0, 0.0]])

    model = LinearModel([0.4], [1.0, -0.6], 0.02, "u", "y", covariance=spread(gain), covariance_white=spread(white))
    assert _variance_ratio(model) == pytest.approx(stretched)


def test_a_profile_interval_requires_an_output_error_fit(table6: dict[str, LinearModel]) -> None:
    with pytest.raises(HydrostateError, match="needs an output-error fit"):
        dc_gain_interval(table6["normal"], np.ones(3), np.ones(3))


def test_json_and_mat_keep_every_bit(fitted: LinearModel, tmp_path: Path) -> None:
    again = LinearModel.from_dict(json.loads(json.dumps(fitted.to_dict())))
    assert again.to_dict() == fitted.to_dict()
    np.testing.assert_array_equal(again.covariance_robust, fitted.covariance_robust)
    fitted.to_mat(tmp_path / "model.mat")
    stored = loadmat(tmp_path / "model.mat", squeeze_me=True)
    np.testing.assert_array_equal(stored["denominator"], fitted.denominator)
    np.testing.assert_array_equal(stored["covariance_robust"], fitted.covariance_robust)
    assert str(stored["structure"]) == "output-error"


def test_a_mat_file_is_written_whole_or_not_at_all(
    fitted: LinearModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitted.to_mat(tmp_path / "model")
    before = (tmp_path / "model.mat").read_bytes()

    def full(file: Any, values: Any) -> None:
        del values
        file.write(b"half of it")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("scipy.io.savemat", full)
    with pytest.raises(OSError, match="No space left"):
        fitted.to_mat(tmp_path / "model.mat")
    assert [(one.name, one.read_bytes()) for one in tmp_path.iterdir()] == [("model.mat", before)]


def test_an_older_file_without_the_newer_entries_is_read(fitted: LinearModel) -> None:
    newer = {"structure", "noise_numerator", "noise_denominator", "continuous", "dead_time_s", "dead_time_std_s"}
    old = {key: value for key, value in fitted.to_dict().items() if key not in newer | {"covariance_robust"}}
    assert LinearModel.from_dict(old).dc_gain == fitted.dc_gain


def test_the_state_space_has_the_same_response_and_state(fitted: LinearModel) -> None:
    space = fitted.to_ss()
    assert space.dt == 1e-3
    u = np.random.default_rng(5).standard_normal(50)
    x, output = fitted.initial_state.copy(), []
    for value in u:
        output.append((space.C @ x)[0] + space.D[0, 0] * value)
        x = space.A @ x + space.B[:, 0] * value
    np.testing.assert_allclose(output, fitted.simulate(u, initial=fitted.initial_state), rtol=1e-9, atol=1e-15)


def test_a_step_response_settles_at_the_gain(fitted: LinearModel) -> None:
    time, response = fitted.step(1.0)
    assert time[-1] == pytest.approx(1.0)
    assert response[-1] == pytest.approx(fitted.dc_gain, rel=1e-6)


def test_without_a_covariance_there_are_no_cancellations_and_no_bandwidth_deviation() -> None:
    alike = LinearModel([0.1, -0.09], [1.0, -1.8001, 0.81009], 1e-3, "u", "y")
    assert alike.cancellations == ()
    assert alike.bandwidth_hz is not None
    assert alike.bandwidth_std_hz is None


def test_the_distance_of_a_zero_from_a_pole_is_measured_in_deviations_along_it() -> None:
    assert _deviations(np.zeros(2), np.eye(2)) == 0.0
    assert _deviations(np.array([3.0, 4.0]), np.diag([4.0, 9.0])) == pytest.approx(
        5.0 / np.sqrt(0.6**2 * 4.0 + 0.8**2 * 9.0)
    )
    assert _deviations(np.array([1.0, 0.0]), np.full((2, 2), np.inf)) == 0.0
    assert _deviations(np.array([1.0, 0.0]), np.zeros((2, 2))) == np.inf


@pytest.mark.parametrize("share", [1e-4, 1e-6, 1e-10])
def test_the_bandwidth_of_a_very_slow_pole_is_accurate(share: float) -> None:
    slow = LinearModel([share], [1.0, -(1.0 - share)], 1e-3, "u", "y")
    assert slow.bandwidth_hz == pytest.approx(share / (2.0 * np.pi * 1e-3), rel=1e-4)


def test_an_integrator_has_no_bandwidth() -> None:
    with np.errstate(divide="ignore", invalid="ignore"):
        assert LinearModel([1.0], [1.0, -1.0], 1e-3, "u", "y").bandwidth_hz is None


def test_gain_and_phase_deviations_are_the_spread_along_and_across_the_response() -> None:
    gradient = np.array([[1.0 + 2.0j, -1.0j], [3.0 + 0.0j, 4.0j]])
    covariance = np.array([[0.04, 0.01], [0.01, 0.09]])
    response = np.array([2.0j, 0.0])  # along the imaginary axis, and zero
    band = response_band(np.array([1.0, 2.0]), response, gradient, covariance, 0.95)
    along, across = (part @ covariance @ part for part in (gradient[0].imag, gradient[0].real))
    assert band.gain_std == pytest.approx([np.sqrt(along), np.sqrt(gradient[1].real @ covariance @ gradient[1].real)])
    assert band.phase_std[0] == pytest.approx(np.sqrt(across) / 2.0)
    assert band.phase_std[1] == np.inf
    assert band.gain_high - np.abs(response) == pytest.approx(1.959964 * band.gain_std, rel=1e-6)
    assert band.gain_low == pytest.approx(np.maximum(np.abs(response) - 1.959964 * band.gain_std, 0.0), rel=1e-6)
