import numpy as np
import pytest

from estimation.identification import LinearModel
from estimation.identification.search import descent
from estimation.identification.search.criterion import Structure, is_stable, predict, sensitivities
from estimation.identification.search.descent import descend, normal_equations, solve_damped, stable
from plant.compiled.native.loops import Loop


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


def test_the_stability_test_agrees_with_the_roots() -> None:
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


def test_a_descent_ends_at_a_point_without_gradient(plant_30hz: LinearModel) -> None:
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


def test_compiled_normal_equations_equal_those_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    u, f = rng.normal(size=80), np.array([-1.2, 0.5])
    sizes, bounds = np.array([2, 2, 1, 2]), np.array([0, 50, 80])
    theta = np.concatenate([[0.4, -0.1], f, 0.1 * rng.normal(size=4)])
    y, weight = rng.normal(size=80), (rng.random(80) > 0.1).astype(float)
    sums = [(np.empty((8, 8)), np.empty(8)) for _ in range(2)]
    normal_equations(theta, sizes, u, y, weight, bounds, *sums[0])
    plain = normal_equations.__wrapped__  # type: ignore[attr-defined]  # the loop as plain Python
    for name in ("impulse_response", "respond", "_add_products"):
        monkeypatch.setattr(descent, name, getattr(descent, name).__wrapped__)
    found, wanted = (
        run(theta, sizes, u, y, weight, bounds, *sums[k]) for k, run in enumerate((normal_equations, plain))
    )
    assert found == pytest.approx(wanted, rel=1e-12)
    np.testing.assert_allclose(np.tril(sums[0][0]), np.tril(sums[1][0]), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(sums[0][1], sums[1][1], rtol=1e-9, atol=1e-12)


@pytest.fixture(params=["compiled", "Python"])
def _either_way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a test with machine code and with the loops as plain Python."""
    if request.param == "Python":
        monkeypatch.setattr(Loop, "__call__", lambda loop, *args: loop.__wrapped__(*args))


WAYS = pytest.mark.usefixtures("_either_way")


@WAYS
@pytest.mark.parametrize("damping", [0.0, 1e-3, 2.0])
def test_a_damped_step_solves_marquardts_equations(damping: float) -> None:
    root = np.random.default_rng(3).standard_normal((6, 4)) * [1e3, 1.0, 1e-4, 1.0]
    gram, gradient = root.T @ root, np.array([1.0, -2.0, 1e-5, 0.5])
    step, factor = np.empty(4), np.empty((4, 4))
    assert solve_damped(np.tril(gram), gradient, damping, step, factor)
    wanted = np.linalg.solve(gram + damping * np.diag(np.diag(gram)), -gradient)
    assert step == pytest.approx(wanted, rel=1e-8)


@WAYS
def test_a_parameter_without_effect_is_not_moved_and_an_indefinite_matrix_is_refused() -> None:
    step, factor = np.empty(2), np.empty((2, 2))
    assert solve_damped(np.diag([4.0, 0.0]), np.array([2.0, 0.0]), 0.0, step, factor)
    assert step.tolist() == [-0.5, 0.0]
    assert not solve_damped(np.array([[1.0, 0.0], [2.0, 1.0]]), np.ones(2), 1e-3, step, factor)


SIZES = np.array([1, 1, 1, 1])


def first_order(noise: float) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 30), 4)
    y = predict(Structure(1, 1, 1), np.array([0.3, -0.8, 0.2]), u)
    return u, y + noise * rng.standard_normal(u.size)


@WAYS
def test_a_descent_ends_at_the_optimum_and_reports_convergence() -> None:
    u, y = first_order(0.05)
    ones, bounds = np.ones(u.size), np.array([0, u.size])
    cost, theta, gram, converged = descend(np.array([0.1, 0.0, 0.0]), SIZES, u, y, ones, bounds, 60, 1e-10)
    assert converged
    assert theta == pytest.approx([0.3, -0.8, 0.2], abs=0.1)
    left = y - predict(Structure(1, 1, 1), theta, u)
    assert cost == pytest.approx(left @ left)
    slopes = sensitivities(Structure(1, 1, 1), theta, u)
    assert np.abs(slopes.T @ left).max() < 1e-4 * np.sqrt(cost * np.diag(slopes.T @ slopes).max())
    assert gram == pytest.approx(np.tril(slopes.T @ slopes))


@WAYS
def test_a_descent_stays_at_its_start_at_the_truth_or_without_steps_or_with_nan_data() -> None:
    u, y = first_order(0.0)
    ones, bounds, truth = np.ones(u.size), np.array([0, u.size]), np.array([0.3, -0.8, 0.2])
    cost, theta, _, converged = descend(truth, SIZES, u, y, ones, bounds, 60, 1e-10)
    assert converged
    assert cost <= 1e-25
    np.testing.assert_array_equal(theta, truth)
    start = np.array([0.1, 0.0, 0.0])
    for values, steps in ((y, 0), (np.full(u.size, np.nan), 30)):
        _, theta, _, converged = descend(start, SIZES, u, values, ones, bounds, steps, 1e-10)
        assert not converged
        np.testing.assert_array_equal(theta, start)


@WAYS
@pytest.mark.parametrize("n_s", [0, 1])
def test_a_descent_finds_the_truth_with_and_without_an_initial_state(n_s: int) -> None:
    u = first_order(0.0)[0]
    truth = np.array([0.3, -0.8, 0.0])[: 2 + n_s]
    y = predict(Structure(1, 1, 1), np.array([0.3, -0.8, 0.0]), u)
    start, sizes = np.array([0.1, -0.5, 0.0])[: 2 + n_s], np.array([1, 1, 1, n_s])
    _, theta, _, converged = descend(start, sizes, u, y, np.ones(u.size), np.array([0, u.size]), 60, 1e-12)
    assert converged
    assert theta == pytest.approx(truth, abs=1e-6)


@WAYS
def test_a_descent_stays_within_the_unit_circle() -> None:
    u = first_order(0.0)[0]
    y = np.zeros(u.size)
    for t in range(1, u.size):
        y[t] = 1.03 * y[t - 1] + 0.3 * u[t - 1]  # no stable model follows this
    start = np.array([0.3, -0.5, 0.0])
    cost, theta, _, _ = descend(start, SIZES, u, y, np.ones(u.size), np.array([0, u.size]), 60, 1e-10)
    assert abs(theta[1]) < 1.0
    assert cost < np.sum((y - predict(Structure(1, 1, 1), start, u)) ** 2)
