import numpy as np
import pytest

from estimation.identification.search.criterion import (
    Structure,
    is_stable,
    predict,
    profile,
    sensitivities,
    stabilised_denominator,
)

THETA = np.array([0.3, -0.2, 0.1, -1.5, 0.6, 0.05, -0.4])


@pytest.mark.parametrize("structure", [Structure(3, 2), Structure(2, 2, 1), Structure(2, 3, 2), Structure(4, 1, 0)])
def test_sensitivities_equal_numerical_derivatives(structure: Structure) -> None:
    rng = np.random.default_rng(1)
    u = rng.standard_normal(200)
    theta = 0.1 * rng.standard_normal(structure.n_parameters)
    exact = sensitivities(structure, theta, u)
    for k in range(structure.n_parameters):
        step = np.zeros(structure.n_parameters)
        step[k] = 1e-6
        central = (predict(structure, theta + step, u) - predict(structure, theta - step, u)) / 2e-6
        np.testing.assert_allclose(exact[:, k], central, atol=1e-8 * np.abs(exact).max())


def test_a_model_at_rest_has_no_initial_state_columns() -> None:
    structure = Structure(3, 2, estimate_initial_state=False)
    u = np.random.default_rng(2).standard_normal(100)
    jacobian = sensitivities(structure, THETA[:5], u)
    assert jacobian.shape == (100, 5)
    np.testing.assert_array_equal(jacobian, sensitivities(Structure(3, 2), np.append(THETA[:5], [0.0, 0.0]), u)[:, :5])


def test_with_a_delay_longer_than_the_log_the_numerator_has_no_effect() -> None:
    structure = Structure(2, 1, 8)
    theta = np.concatenate([[0.5, 0.2, -0.7, 0.3], np.zeros(structure.n_initial - 1)])
    jacobian = sensitivities(structure, theta, np.arange(6.0))
    assert not jacobian[:, :2].any()
    assert jacobian[:, 3] == pytest.approx(0.7 ** np.arange(6.0))
    assert not jacobian[:, 9:].any()


def test_linear_parameters_are_solved_exactly() -> None:
    structure = Structure(3, 2)
    u = np.random.default_rng(3).standard_normal(300)
    y = predict(structure, THETA, u)
    used = np.ones(300, dtype=bool)
    used[50:60] = False
    cost, theta = profile(structure, np.array([1.0, -1.5, 0.6]), u, np.where(used, y, 1e9), used)
    np.testing.assert_allclose(theta, THETA, rtol=1e-8)
    assert cost < 1e-20 * float(y @ y)


def test_unstable_roots_are_reflected_and_stable_ones_kept() -> None:
    reflected = stabilised_denominator(np.poly([2.0, 0.5]), 100)
    np.testing.assert_allclose(np.sort(np.roots(reflected)), [0.5, 0.5], atol=1e-6)
    stable = np.poly([0.9, 0.5])
    assert stabilised_denominator(stable, 100) is stable


@pytest.mark.parametrize("roots", [[1.0, 0.5], [-1.0, 0.5], [1.0 + 1e-12, 0.5], [1j, -1j]])
def test_roots_on_the_circle_move_inside(roots: list[complex]) -> None:
    assert not is_stable(np.real(np.poly([1.0, 0.5])))
    assert np.abs(np.roots(stabilised_denominator(np.real(np.poly(roots)), 1000))).max() < 1.0
