import numpy as np
import pytest

from estimation.identification import LinearModel
from estimation.identification.search import descent
from estimation.identification.search.criterion import Structure, is_stable, predict, sensitivities
from estimation.identification.search.descent import descend, normal_equations, solve_damped, stable


def test_normal_equations_are_those_of_the_sensitivities() -> None:
    rng = np.random.default_rng(1)
    n, form = 5_000, Structure(3, 2)
    u, weight = rng.standard_normal(n), (rng.random(n) > 0.1).astype(float)
    theta = np.array([0.2, -0.36, 0.17, -1.75, 0.7577, 0.1, 0.2])
    y = predict(form, theta, u) + rng.standard_normal(n)
    gram, gradient = np.zeros((7, 7)), np.zeros(7)
    moved = theta + 1e-3
    cost = normal_equations(moved, np.array([3, 2, 0, 2]), u, y, weight, np.array([0, n]), gram, gradient)
    jacobian = weight[:, None] * sensitivities(form, moved, u)
    residual = weight * (y - predict(form, moved, u))
    assert cost == pytest.approx(residual @ residual, rel=1e-9)
    np.testing.assert_allclose(gram, np.tril(jacobian.T @ jacobian), rtol=1e-7, atol=1e-9 * gram.max())
    np.testing.assert_allclose(gradient, -(jacobian.T @ residual), rtol=1e-6)


def test_stability_is_that_of_the_roots() -> None:
    rng = np.random.default_rng(2)
    for _ in range(500):
        radius, angle = rng.uniform(0.9, 1.05, 2), rng.uniform(0.0, np.pi, 2)
        roots = np.concatenate([radius * np.exp(1j * angle), radius * np.exp(-1j * angle)])
        f = np.real(np.poly(roots))
        assert stable(f[1:]) == is_stable(f)


def test_a_singular_system_is_solved_only_with_damping() -> None:
    gram, step, factor = np.ones((2, 2)), np.zeros(2), np.zeros((2, 2))
    assert not solve_damped(gram, np.ones(2), 0.0, step, factor)
    assert solve_damped(gram, np.ones(2), 1e-6, step, factor)
    np.testing.assert_allclose(step, [-0.5, -0.5], rtol=1e-5)


def test_descent_ends_where_no_step_helps(plant_30hz: LinearModel) -> None:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], 300), 10)
    y = plant_30hz.simulate(u) + 0.1 * rng.standard_normal(u.size)
    start = np.concatenate([plant_30hz.numerator[1:], plant_30hz.denominator[1:], np.zeros(2)])
    sizes, bounds = np.array([2, 2, 1, 2]), np.array([0, u.size])
    cost, theta, gram, converged = descend(start, sizes, u, y, np.ones(u.size), bounds, 100, 1e-12)
    assert converged
    jacobian = sensitivities(Structure(2, 2, 1), theta, u)
    residual = y - predict(Structure(2, 2, 1), theta, u)
    assert np.abs(jacobian.T @ residual / np.sqrt(np.diag(gram))).max() < 1e-4 * np.sqrt(cost)


def test_machine_code_computes_what_python_does(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    u, f = rng.normal(size=80), np.array([-1.2, 0.5])
    sizes, bounds = np.array([2, 2, 1, 2]), np.array([0, 50, 80])
    theta = np.concatenate([[0.4, -0.1], f, 0.1 * rng.normal(size=4)])
    y, weight = rng.normal(size=80), (rng.random(80) > 0.1).astype(float)
    sums = [(np.empty((8, 8)), np.empty(8)) for _ in range(2)]
    normal_equations(theta, sizes, u, y, weight, bounds, *sums[0])
    plain = normal_equations.__wrapped__  # type: ignore[attr-defined]  # as it is written
    for name in ("impulse_response", "respond", "_add_products"):
        monkeypatch.setattr(descent, name, getattr(descent, name).__wrapped__)
    found, wanted = (
        run(theta, sizes, u, y, weight, bounds, *sums[k]) for k, run in enumerate((normal_equations, plain))
    )
    assert found == pytest.approx(wanted, rel=1e-12)
    np.testing.assert_allclose(np.tril(sums[0][0]), np.tril(sums[1][0]), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(sums[0][1], sums[1][1], rtol=1e-9, atol=1e-12)
