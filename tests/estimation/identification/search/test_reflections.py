"""Steps in the reflection coefficients stay within the bound of stability, and proceed if plain steps are refused."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.search.criterion import is_stable, polynomial
from estimation.identification.search.levenberg import levenberg
from estimation.identification.search.reflections import denominator, reflections, stable_step

POLES = ([0.9], [0.9999, 0.5], [0.99 + 0.1j, 0.99 - 0.1j, -0.4], [0.9999, 0.999, 0.98, 0.7, -0.2, 0.3])


@pytest.mark.parametrize("poles", POLES)
def test_reflection_coefficients_give_back_the_denominator_and_its_derivatives(poles: list[complex]) -> None:
    f = polynomial(np.array(poles, dtype=np.complex128))[1:]
    reflected = reflections(f)
    assert (np.abs(reflected) < 1.0).all()
    back, slopes = denominator(reflected)
    np.testing.assert_allclose(back, f, rtol=1e-7)
    for k, moved in enumerate(np.eye(f.size)):
        ahead, behind = (denominator(reflected + sign * 1e-6 * moved)[0] for sign in (1.0, -1.0))
        np.testing.assert_allclose((ahead - behind) / 2e-6, slopes[:, k], atol=1e-6)


def test_a_step_towards_unstable_poles_stays_stable_and_predicts_a_lower_cost() -> None:
    f, wanted = np.array([-1.9, 0.905]), np.array([-2.3, 1.4])
    gram = np.diag([5.0, 1.0, 1.0])
    theta = np.concatenate([[3.0], f])
    gradient = gram @ (theta - np.concatenate([[2.0], wanted]))
    for stretched in (np.ones(2), np.array([1.01, 1.01**2])):
        found = stable_step(theta, gram, gradient, 1e-6, slice(1, 3), stretched)
        assert found is not None
        new, promised = found
        assert promised > 0.0
        assert is_stable(np.concatenate([[1.0], new[1:] * stretched]))
    outside = np.array([3.0, -2.3, 1.4])
    assert stable_step(outside, gram, gradient, 1e-6, slice(1, 3), np.ones(2)) is None


def test_a_descent_continues_along_a_bound_at_which_plain_steps_end() -> None:
    """The first value's optimum, of size 1.2, is beyond the bound 1; the second must still follow the curved valley."""

    def at(x: Array) -> tuple[float, Array, Array]:
        errors = np.array([x[0] + 1.2, 10.0 * (x[1] - 5.0 * (x[0] + 0.9) ** 2)])
        slopes = np.array([[1.0, 0.0], [-100.0 * (x[0] + 0.9), 10.0]])
        return float(errors @ errors), slopes.T @ slopes, slopes.T @ errors

    def acceptable(x: Array) -> bool:
        return bool(abs(x[0]) < 1.0)

    start = np.array([-0.9, 0.3])
    plain, _ = levenberg(at, start, acceptable, tolerance=1e-12, most_steps=60)
    cost, found = levenberg(
        at,
        start,
        acceptable,
        tolerance=1e-12,
        most_steps=60,
        within=lambda x, gram, gradient, damping: stable_step(x, gram, gradient, damping, slice(0, 1), np.ones(1)),
    )
    assert cost == pytest.approx(0.04, rel=1e-3)
    assert found == pytest.approx([-1.0, 0.05], abs=1e-3)
    assert plain > 50.0 * cost
