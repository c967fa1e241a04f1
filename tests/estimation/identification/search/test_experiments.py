import numpy as np
import pytest

from estimation.identification import LinearModel, fit_output_error
from estimation.identification.search.experiments import _excitation_order, experiments_from
from plant.errors import HydrostateError

WANTED = {"names": ("u", "y"), "n_excited": 2, "n_wanted": 10}


def test_several_experiments_share_coefficients_and_have_separate_initial_states(plant_30hz: LinearModel) -> None:
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], 200), 10)
    y = plant_30hz.simulate(u)
    y = y + 0.02 * y.std() * rng.standard_normal(u.size)
    form = {"n_numerator": 2, "n_denominator": 2, "delay": 1}
    parts = [slice(0, 700), slice(900, 2_000)]  # the part between is not logged
    both = fit_output_error([u[p] for p in parts], [y[p] for p in parts], 1e-3, **form)
    one = fit_output_error(u[parts[0]], y[parts[0]], 1e-3, **form)
    assert both.n_samples == 1_800
    assert (both.coefficient_std < one.coefficient_std).all()
    error = both.denominator[1:] - plant_30hz.denominator[1:]
    assert (np.abs(error) < 3.0 * both.coefficient_std[2:]).all()


def test_gaps_are_bridged_for_starts_only() -> None:
    y = np.sin(np.arange(40.0))
    y[5:8] = np.nan
    data = experiments_from(np.arange(40.0) % 7, y, **WANTED)
    assert data.n_used == 37
    assert np.isnan(data.measured()[5:8]).all()
    assert np.isfinite(data.bridged()[0][1]).all()


def test_outputs_are_advanced_by_the_dead_time_within_each_experiment() -> None:
    u, y = np.arange(1.0, 41.0) % 7, np.sin(np.arange(40.0))
    data = experiments_from([u, u[:20]], [y, y[:20]], **WANTED)
    late = data.advanced(3)
    for moved, part in zip(late.slices, data.slices, strict=True):
        np.testing.assert_array_equal(late.u[moved], data.u[part][:-3])
        np.testing.assert_array_equal(late.y[moved], data.y[part][3:])
    assert data.has_outputs_after(19)
    assert not data.has_outputs_after(20)


def test_different_numbers_of_inputs_and_outputs_are_refused() -> None:
    u = np.arange(40.0) % 7
    with pytest.raises(HydrostateError, match="as many inputs as outputs are needed, got 2 and 1"):
        experiments_from([u, u], [u], **WANTED)


def test_an_experiment_without_any_output_is_refused() -> None:
    u = np.arange(40.0) % 7
    with pytest.raises(HydrostateError, match="every experiment needs samples"):
        experiments_from([u, u], [u, np.full(40, np.nan)], **WANTED)


@pytest.mark.parametrize("seed", range(4))
def test_an_input_without_effect_above_the_noise_is_refused(seed: int) -> None:
    rng = np.random.default_rng(seed)
    u, y = rng.standard_normal((2, 2_000))
    with pytest.raises(HydrostateError, match="does not move 'output' above its noise"):
        fit_output_error(u, y, 1e-3, n_numerator=2, n_denominator=2)


def test_an_input_with_a_weak_effect_is_not_refused() -> None:
    u, noise = np.random.default_rng(5).standard_normal((2, 2_000))
    fitted = fit_output_error(u, 0.25 * u + noise, 1e-3, n_numerator=1, n_denominator=1)
    assert fitted.dc_gain == pytest.approx(0.25, abs=4.0 * fitted.dc_gain_std)


def test_a_log_too_short_for_the_wanted_parameters_excites_none() -> None:
    u = np.random.default_rng(1).normal(size=9)
    assert [_excitation_order(u, wanted) for wanted in (4, 5)] == [4, 0]
    assert _excitation_order(np.sin(np.arange(50.0)), 4) == 2
