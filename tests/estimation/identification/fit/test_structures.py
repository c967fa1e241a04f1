"""ARX, ARMAX, Box-Jenkins, instrumental variables, subspace and continuous time on systems with known parameters."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.identification import (
    LinearModel,
    choose_model,
    estimate_delay,
    fit_armax,
    fit_arx,
    fit_box_jenkins,
    fit_continuous,
    fit_instrumental,
    fit_output_error,
    fit_subspace,
)
from estimation.identification.fit import continuous, output_error
from estimation.identification.notes import IdentificationCode
from estimation.identification.search.criterion import Structure
from estimation.identification.search.experiments import experiments_from
from plant.errors import HydrostateError, LogWarning

FORM = {"n_numerator": 2, "n_denominator": 2, "delay": 1}


def record(
    plant: LinearModel, c: list[float], d: list[float], share: float, seed: int, n: int = 6_000
) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], n // 10), 10)
    clean = plant.simulate(u)
    noise = np.asarray(lfilter(c, d, rng.standard_normal(n)))
    return u, clean + share * clean.std() * noise / noise.std()


def deviations(fitted: LinearModel, truth: LinearModel) -> np.ndarray:
    error = np.concatenate(
        [fitted.free_numerator - truth.free_numerator, fitted.denominator[1:] - truth.denominator[1:]]
    )
    return np.abs(error) / fitted.coefficient_std


def test_arx_finds_the_plant_if_noise_enters_through_the_denominator(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0], plant_30hz.denominator.tolist(), 0.1, 1)
    fitted = fit_arx(u, y, 1e-3, **FORM)
    assert (deviations(fitted, plant_30hz) < 3.0).all()
    np.testing.assert_array_equal(fitted.noise_denominator, fitted.denominator)


def test_arx_leaves_out_rows_with_a_missing_output(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0], plant_30hz.denominator.tolist(), 0.1, 2)
    y[100:140:4] = np.nan
    fitted = fit_arx(u, y, 1e-3, **FORM)
    assert fitted.n_samples < 6_000 - 2 * 10
    assert (deviations(fitted, plant_30hz) < 3.0).all()


@pytest.mark.parametrize(("n_b", "n_a", "delay"), [(4, 1, 0), (1, 3, 0), (2, 2, 3), (2, 2, 1)])
def test_arx_is_least_squares_on_the_rows_whose_past_was_logged(n_b: int, n_a: int, delay: int) -> None:
    rng = np.random.default_rng(6)
    u = rng.standard_normal(90)
    y = np.asarray(lfilter([0.0, 0.0, 0.2, 0.4, 0.3], [1.0, -0.7], u)) + 0.05 * rng.standard_normal(90)
    y[50] = np.nan
    rows, wanted = [], []
    for t in range(max(n_a, delay + n_b - 1), 90):
        row = [*(u[t - delay - k] for k in range(n_b)), *(-y[t - k] for k in range(1, n_a + 1))]
        if np.isfinite([*row, y[t]]).all():
            rows.append(row)
            wanted.append(y[t])
    exact = np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0]
    fitted = fit_arx(u, y, 1.0, n_numerator=n_b, n_denominator=n_a, delay=delay)
    assert np.concatenate([fitted.free_numerator, fitted.denominator[1:]]) == pytest.approx(exact, rel=1e-9)
    assert fitted.n_samples == len(rows)


def test_armax_finds_the_noise_numerator(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0, -0.6], plant_30hz.denominator.tolist(), 0.1, 3)
    fitted = fit_armax(u, y, 1e-3, **FORM, n_c=1)
    assert (deviations(fitted, plant_30hz) < 3.0).all()
    assert fitted.noise_numerator[1] == pytest.approx(-0.6, abs=0.05)


def test_box_jenkins_separates_plant_and_noise_despite_gaps(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0, 0.5], [1.0, -0.9], 0.1, 4)
    y[::50] = np.nan
    fitted = fit_box_jenkins(u, y, 1e-3, **FORM, n_c=1, n_d=1)
    assert (deviations(fitted, plant_30hz) < 3.0).all()
    assert fitted.noise_numerator[1] == pytest.approx(0.5, abs=0.06)
    assert fitted.noise_denominator[1] == pytest.approx(-0.9, abs=0.04)


def test_box_jenkins_is_more_accurate_with_a_noise_model(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0], [1.0, -0.97], 0.2, 5)
    coloured = fit_box_jenkins(u, y, 1e-3, **FORM, n_c=0, n_d=1)
    plain = fit_box_jenkins(u, y, 1e-3, **FORM, n_c=0, n_d=0, covariance="coloured")
    assert coloured.one_step_rmse < 0.5 * plain.rmse
    assert coloured.rmse == pytest.approx(plain.rmse, rel=0.02)  # both are errors of free runs
    assert coloured.pole_std[0].real < plain.pole_std[0].real


def test_refined_instrumental_variables_find_the_plant_in_white_noise(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0], [1.0], 0.2, 6)
    fitted = fit_instrumental(u, y, 1e-3, **FORM)
    assert fitted.structure == "SRIV"
    assert (deviations(fitted, plant_30hz) < 3.0).all()


def test_refined_instrumental_variables_find_the_plant_and_a_noise_model(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0], [1.0, -0.9], 0.2, 7)
    fitted = fit_instrumental(u, y, 1e-3, **FORM, n_d=1)
    assert fitted.structure == "RIV"
    assert (deviations(fitted, plant_30hz) < 3.0).all()
    assert fitted.noise_denominator[1] == pytest.approx(-0.9, abs=0.03)


@pytest.mark.parametrize("count", [1, 6])
def test_instrumental_variables_end_at_the_output_error_of_short_records(count: int) -> None:
    """The numerator is fitted to all records, and none begins at rest or has its mean at the mean input."""
    rng = np.random.default_rng(3)
    f, inputs, outputs = [1.0, -1.7, 0.76], list[np.ndarray](), list[np.ndarray]()
    for _ in range(count):
        u = np.repeat(rng.uniform(-1.0, 1.0, 10), [200, *[30] * 9])
        y = np.asarray(lfilter([0.0, 0.04, 0.02], f, u)) + 0.7 + 0.05 * rng.standard_normal(u.size)
        inputs.append(u[200:])
        outputs.append(y[200:])
    about = {"n_numerator": 2, "n_denominator": 2, "delay": 1}
    fitted = fit_instrumental(inputs, outputs, 0.01, **about, estimate_offset=True)
    level = [y - fitted.offset for y in outputs]
    wanted = fit_output_error(inputs, level, 0.01, **about)
    for one, other in ((fitted.denominator, wanted.denominator), (fitted.free_numerator, wanted.free_numerator)):
        assert one == pytest.approx(other, abs=2e-5)
    assert fitted.offset == pytest.approx(0.7, abs=0.02)


@pytest.mark.parametrize("fit", ["ARX", "continuous"])
def test_an_offset_is_fitted_along(fit: str) -> None:
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(0.0, 1.0, 5), [600, *[60] * 4])
    y = np.asarray(lfilter([0.0, 0.02], [1.0, -0.98], u))[600:]
    u, y, level = u[600:] - u[600:].mean(), y - y.mean(), y.mean() - u[600:].mean()
    assert abs(level) > 0.01
    if fit == "ARX":
        model = fit_arx(u, y, 0.1, n_numerator=1, n_denominator=1, delay=1, estimate_offset=True)
    else:
        model = fit_continuous(u, y, 0.1, n_zeros=0, n_poles=1, estimate_offset=True)
    assert model.dc_gain == pytest.approx(1.0, rel=1e-6)
    assert model.offset == pytest.approx(-level, abs=1e-6)


def test_a_subspace_fit_chooses_its_order_by_the_noise_floor(table6: dict[str, LinearModel]) -> None:
    truth = table6["major_leakage"]
    rng = np.random.default_rng(8)
    u = np.repeat(rng.choice([-1.0, 1.0], 400), 50)
    clean = truth.simulate(u)
    found = fit_subspace(u, clean + 0.05 * clean.std() * rng.standard_normal(u.size), 1e-3)
    assert found.model.denominator.size == 3
    assert found.singular_values[1] > found.noise_floor > found.singular_values[2]
    np.testing.assert_allclose(np.sort_complex(found.model.poles), np.sort_complex(truth.poles), atol=0.003)


@pytest.mark.parametrize("late", [0.0, 0.0023])
def test_a_continuous_model_and_its_dead_time_are_found(late: float) -> None:
    w = 2.0 * np.pi * 30.0
    truth = LinearModel(
        np.array([w * w]), np.array([1.0, 1.2 * w, w * w]), 1e-3, "u", "y", continuous=True, dead_time=late
    )
    u, y = record(truth, [1.0], [1.0], 0.1, 9)
    fitted = fit_continuous(u, y, 1e-3, n_zeros=0, n_poles=2, dead_time=None if late else 0.0)
    assert (deviations(fitted, truth) < 3.0).all()
    assert fitted.dc_gain == pytest.approx(1.0, abs=4.0 * fitted.dc_gain_std)
    if late:
        assert abs(fitted.dead_time - late) < 3.0 * fitted.dead_time_std < 2e-4


def test_a_long_dead_time_adds_no_initial_values_to_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    searched: list[int] = []

    def descended(form: Structure, *given: Any) -> tuple[float, np.ndarray]:
        searched.append(form.n_initial)
        return output_error.descend_from(form, *given)

    truth = LinearModel(np.array([2e4]), np.array([1.0, 120.0, 2e4]), 1e-3, "u", "y", continuous=True)
    u, y = record(truth, [1.0], [1.0], 0.1, 14, n=2_000)
    late = np.concatenate([np.full(70, y[0]), y[:-70]])
    late[900:920] = np.nan
    monkeypatch.setattr(continuous, "descend_from", descended)
    found = fit_continuous([u, u[:90]], [late, late[:90]], 1e-3, n_zeros=0, n_poles=2, dead_time=0.07)
    assert searched == [3]
    assert (deviations(found, truth) < 3.0).all()
    assert found.dead_time == 0.07
    both = experiments_from([u, u[:72]], [late, late[:72]], ("u", "y"), n_excited=2, n_wanted=1)
    short = continuous._Problem(both, 1e-3, 0, 2, 0.07)  # no sample of an experiment of 72 samples would be left
    assert short.without_whole_samples() is short


def test_a_continuous_model_with_a_held_input_is_discretised_exactly() -> None:
    late = LinearModel(np.array([2.0]), np.array([1.0, 2.0]), 0.1, "u", "y", continuous=True, dead_time=0.25)
    time = 0.1 * np.arange(30)
    wanted = np.where(time > 0.25, 1.0 - np.exp(-2.0 * np.maximum(time - 0.25, 0.0)), 0.0)
    np.testing.assert_allclose(late.step(2.9)[1], wanted, atol=1e-12)


def test_the_delay_is_estimated(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0], [1.0], 0.05, 10, n=3_000)
    late = np.concatenate([np.zeros(4), y[:-4]])
    assert estimate_delay(u, late, most=8) == 5


def test_order_and_structure_are_chosen(plant_30hz: LinearModel) -> None:
    u, y = record(plant_30hz, [1.0], [1.0], 0.1, 11)
    choice = choose_model(u, y, 1e-3, orders=(1, 2, 3), delay=1)
    assert choice.model.denominator.size == 3
    assert list(choice.structures.index) == ["ARX", "ARMAX", "output-error", "Box-Jenkins"]
    # ARX cannot describe noise at the output
    assert choice.structures["fit_percent"].idxmin() == "ARX"
    assert {"aic", "aicc", "bic", "fpe", "cancellations"} <= set(choice.orders.columns)


def test_an_unstable_model_warns() -> None:
    rng = np.random.default_rng(12)
    u = rng.standard_normal(300)
    y = np.asarray(lfilter([0.0, 1.0], [1.0, -1.01], u)) + 0.01 * rng.standard_normal(300)
    with pytest.warns(LogWarning) as caught:
        assert not fit_arx(u, y, 1.0, n_numerator=1, n_denominator=1, delay=1).is_stable
    (note,) = [one.message.note for one in caught]
    assert caught[0].filename == __file__  # it points at the caller of the fit
    assert (note.code, note.data["structure"]) == (IdentificationCode.UNSTABLE, "ARX")
    assert note.data["modulus"] == pytest.approx(1.01, abs=0.002)


@pytest.mark.parametrize(
    ("fit", "message"),
    [
        (lambda u, y: fit_instrumental(u, y, 1.0, n_numerator=1, n_denominator=1), "need every sample"),
        (lambda u, y: fit_subspace(u, y, 1.0), "needs every sample"),
        (lambda u, y: fit_continuous(u, y, 1.0, n_zeros=2, n_poles=1), "n_zeros <= n_poles"),
        (lambda u, y: fit_armax(u, y, 1.0, n_numerator=1, n_denominator=0, n_c=1), "at least 1"),
        (lambda u, y: choose_model(u, y, 1.0, structures=("OE",)), "structures must be among .*, got 'OE'$"),  # pyright: ignore
        (lambda u, y: choose_model(u, y, 1.0, orders=()), "orders must be one whole number or more, got none"),
        (
            lambda u, y: fit_output_error(u, y, 1.0, n_numerator=2, n_denominator=2, delay=-1),
            "^delay must be at least 0",
        ),
    ],
)
def test_unsuitable_data_or_sizes_are_refused(fit: Callable[[np.ndarray, np.ndarray], object], message: str) -> None:
    u = np.random.default_rng(13).standard_normal(400)
    y = u.copy()
    y[7] = np.nan
    with pytest.raises(HydrostateError, match=message):
        fit(u, y)
