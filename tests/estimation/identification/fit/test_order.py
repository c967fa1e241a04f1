from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.identification import LinearModel, markov_parameters, order_table, order_test
from plant.errors import HydrostateError

Binary = Callable[..., np.ndarray]


@pytest.mark.parametrize("condition", ["normal", "minor_leakage", "major_leakage", "major_leakage_major_friction"])
def test_a_second_order_system_has_suggested_order_two(
    condition: str, table6: dict[str, LinearModel], binary: Binary
) -> None:
    rng = np.random.default_rng(7)
    u = binary(rng, 20_000)
    y = table6[condition].simulate(u)
    found = order_test(u, y + 0.05 * y.std() * rng.standard_normal(u.size))
    assert found.suggested_order == 2
    assert found.projected_singular_values[1] > 1.5 * found.projected_noise_floor
    assert found.projected_singular_values[2] < found.projected_noise_floor


def test_hankel_singular_values_show_the_order_with_a_white_input(plant_30hz: LinearModel) -> None:
    rng = np.random.default_rng(8)
    u = rng.standard_normal(10_000)
    y = plant_30hz.simulate(u)
    found = order_test(u, y + 0.02 * y.std() * rng.standard_normal(u.size))
    assert (found.hankel_singular_values > found.hankel_noise_floor).sum() == 2
    assert found.suggested_order == 2


def test_the_noise_floor_is_valid_for_coloured_noise(plant_30hz: LinearModel, binary: Binary) -> None:
    rng = np.random.default_rng(9)
    u = binary(rng, 10_000, 20)
    y = plant_30hz.simulate(u)
    noise = lfilter([1.0], [1.0, -0.9], rng.standard_normal(u.size))
    found = order_test(u, y + 0.05 * y.std() * noise / noise.std())
    assert found.suggested_order == 2


def test_noise_alone_has_no_order() -> None:
    rng = np.random.default_rng(10)
    found = order_test(rng.standard_normal(5_000), rng.standard_normal(5_000))
    assert found.suggested_order == 0
    assert (found.hankel_singular_values > found.hankel_noise_floor).sum() == 0


def test_markov_parameters_equal_the_impulse_response_without_noise(plant_30hz: LinearModel) -> None:
    u = np.random.default_rng(11).standard_normal(3_000)
    pulse = np.zeros(200)
    pulse[0] = 1.0
    estimated = markov_parameters(u, plant_30hz.simulate(u), 200)
    np.testing.assert_allclose(estimated, plant_30hz.simulate(pulse), atol=1e-8)


def test_least_squares_over_lags_equals_the_plain_solution() -> None:
    rng = np.random.default_rng(12)
    u, y = rng.standard_normal(90), rng.standard_normal(90)
    rows = np.array([u[t - 19 : t + 1][::-1] for t in range(19, 90)])
    expected = np.linalg.lstsq(rows, y[19:], rcond=None)[0]
    np.testing.assert_allclose(markov_parameters(u, y, 20), expected, rtol=1e-8)


def test_the_bayesian_criterion_chooses_the_true_order(plant_30hz: LinearModel, binary: Binary) -> None:
    rng = np.random.default_rng(13)
    u = binary(rng, 5_000, 20)
    y = plant_30hz.simulate(u)
    table = order_table(u, y + 0.1 * y.std() * rng.standard_normal(u.size), 1e-3, delay=1)
    assert list(table.index) == [1, 2, 3, 4]
    assert table["bic"].idxmin() == 2
    assert table["rmse"].is_monotonic_decreasing
    assert table.loc[2, "n_parameters"] == 6


@pytest.mark.parametrize(
    ("u", "y", "message"),
    [
        (np.arange(100.0), np.arange(100.0), "180 samples or more"),
        (np.ones(300), np.arange(300.0), "must vary"),
        (np.arange(300.0), np.where(np.arange(300) == 3, np.nan, 1.0), "without gaps"),
    ],
)
def test_unusable_data_are_refused(u: np.ndarray, y: np.ndarray, message: str) -> None:
    with pytest.raises(HydrostateError, match=message):
        order_test(u, y)
