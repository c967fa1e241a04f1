import numpy as np

from estimation.identification import LinearModel
from estimation.identification.model.lags import lagged
from estimation.identification.search.criterion import Structure, is_stable
from estimation.identification.search.experiments import Experiments
from estimation.identification.search.starts import least_squares_arx, reduced_high_order_arx, starting_values


def noisy_record(model: LinearModel, share: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    u = np.repeat(rng.choice([-1.0, 1.0], 1_000), 5)
    y = model.simulate(u)
    scaled = y / y.std()
    return u, scaled + share * rng.standard_normal(u.size)


def test_lagged_columns_are_shifts_with_zeros_before_the_record() -> None:
    np.testing.assert_array_equal(lagged(np.array([1.0, 2.0, 3.0]), 1, 2), [[0.0, 0.0], [1.0, 0.0], [2.0, 1.0]])


def test_arx_is_exact_without_noise(plant_30hz: LinearModel) -> None:
    u = np.random.default_rng(1).standard_normal(500)
    b, f = least_squares_arx(2, 2, 1, u, plant_30hz.simulate(u))
    np.testing.assert_allclose(b, plant_30hz.numerator, atol=1e-9)
    np.testing.assert_allclose(f, plant_30hz.denominator, rtol=1e-9)


def test_a_reduced_long_model_has_the_plant_s_poles(plant_30hz: LinearModel) -> None:
    u, y = noisy_record(plant_30hz, 0.01)
    poles = np.sort_complex(np.roots(reduced_high_order_arx(2, u, y)))
    np.testing.assert_allclose(poles, np.sort_complex(plant_30hz.poles), atol=0.03)


def test_every_start_is_stable_and_of_the_order_wanted(plant_30hz: LinearModel) -> None:
    u, y = noisy_record(plant_30hz, 1.0)
    data = Experiments(u, y, np.ones(u.size, dtype=bool), np.array([0, u.size]))
    for order in (1, 2, 3, 4):
        starts = starting_values(Structure(order, order, 1), data, 12)
        assert 0 < len(starts) <= 12
        for start in starts:
            assert start.shape == (2 * order,)
            assert is_stable(np.concatenate([[1.0], start[order:]]))
