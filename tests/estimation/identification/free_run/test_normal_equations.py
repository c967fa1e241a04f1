"""Runs of factored terms equal those of the terms themselves, and their sums equal those of the derivatives."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run import normal_equations
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.dense_polynomial import every_term
from estimation.identification.free_run.normal_equations import NormalEquations, factored
from estimation.identification.free_run.polynomial_fit import Runs
from estimation.identification.free_run.polynomial_variables import Variables

RUBS = pytest.mark.parametrize(
    ("friction", "rub"), [("", ()), ("position", (0.02, 0.03)), ("velocity", (0.02, 0.03, 0.1))]
)
TERMS = every_term(5, 3)


def logs() -> Channels:
    """Return two logs in which one output in ten is missing, and also a block of the first log."""
    rng = np.random.default_rng(2)
    outputs = [np.where(rng.random(n) < 0.1, np.nan, rng.normal(size=n)) for n in (150, 90)]
    outputs[0][40:80] = np.nan
    return Channels(("u",), "y", 1.0, tuple(rng.normal(size=(y.size, 1)) for y in outputs), tuple(outputs))


def made(friction: str, rub: tuple[float, ...]) -> tuple[Runs, Array]:
    """Return runs whose products and outputs are clipped at their limits now and then, and values of all terms."""
    limits = np.array([[-0.4, 0.5]] * 2 + [[-2.0, 1.5]] * 3)
    variables = Variables(np.array([0, 0, 1, 1, 1]), np.array([1, 2, 0, 3, 4]), limits, friction)
    runs = Runs(variables, TERMS, logs())
    theta = np.concatenate([0.02 * np.random.default_rng(3).normal(size=len(TERMS)), runs.start_values(), rub])
    theta[1:4] = 1.1, -0.4, 0.3
    return runs, theta


@pytest.fixture(params=["compiled", "Python"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "Python":
        for name in ("run_factored", "slopes_of", "write_own", "pass_on"):
            monkeypatch.setattr(normal_equations, name, getattr(normal_equations, name).__wrapped__)


def followed(runs: Runs, theta: Array, index: int, t: int, out: Array) -> tuple[float, float, Array]:
    """Return the next output, the direction in which friction lets it move, and the product of each term."""
    one, u = runs.variables, runs.data.u[index]
    lagged = zip(one.source, one.lag, strict=True)
    z = np.array([out[t - lag] if source == 0 else u[max(t - lag, 0), source - 1] for source, lag in lagged])
    held = np.append(np.clip(z, one.limits[:, 0], one.limits[:, 1]), 1.0)
    alone = (runs.terms[:, 0] >= 0) & (runs.terms[:, 1] < 0)
    terms = np.where(alone, np.append(z, 1.0)[runs.terms[:, 0]], np.prod(held[runs.terms], axis=1))
    total, moves = float(theta[: len(terms)] @ terms), 1.0
    if one.friction:
        below, above, *rest = theta[-one.n_friction :]
        stay = rest[0] if rest else out[t - 1]
        moves = float(total - stay > above) - float(stay - total > below)
        total = total - above if moves > 0.0 else total + below if moves < 0.0 else stay
    return float(np.clip(total, *runs.ends)), moves, terms


def followed_freely(runs: Runs, theta: Array) -> tuple[Array, Array]:
    """Return outputs and their derivatives by all values; at the limits, the direct effect of the terms remains."""
    k, n, n_rub, outs, rows = len(runs.terms), runs.variables.n_start, runs.variables.n_friction, [], []
    for index, begin in enumerate(runs.begins):
        out = runs.outputs_before_run(theta, index)
        moved = np.zeros((out.size, theta.size))
        moved[begin - n + np.arange(n), k + index * n + np.arange(n)] = 1.0
        for t in range(begin, out.size):
            out[t], moves, terms = followed(runs, theta, index, t, out)
            moved[t, :k] = terms * abs(moves)
            if n_rub:
                moved[t, -n_rub:] = [moves < 0.0, -float(moves > 0.0), moves == 0.0][:n_rub]
            for lag in range(1, n + 1):
                # a position that friction holds follows the previous one, if that is within the limits
                slope = float(lag == 1 and n_rub == 2 and runs.ends[0] <= out[t - 1] <= runs.ends[1])
                if moves:
                    step = 1e-6 * (np.arange(out.size) == t - lag)
                    up, down = (followed(runs, theta, index, t, out + sign * step)[0] for sign in (1.0, -1.0))
                    slope = (up - down) / 2e-6
                moved[t] += slope * moved[t - lag]
        outs.append(out)
        rows.append(moved)
    return np.concatenate(outs), np.concatenate(rows)


@pytest.mark.usefixtures("way")
@RUBS
def test_runs_and_normal_equations_of_factored_terms_equal_those_of_the_full_terms(
    friction: str, rub: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    runs, theta = made(friction, rub)
    monkeypatch.setattr(normal_equations, "STRETCH", 40 * theta.size)  # stretches begin within logs and within gaps
    ran, jacobian = followed_freely(runs, theta)
    assert np.isin(ran, runs.ends).any()
    jacobian, left = jacobian[runs.used], ran - runs.target
    equations = NormalEquations(runs, runs.ends)
    assert equations.outputs(theta) == pytest.approx(ran, rel=1e-12, abs=1e-12)
    gram, right = equations.sums(left)
    assert gram == pytest.approx(jacobian.T @ jacobian, rel=1e-6, abs=1e-6)
    assert right == pytest.approx(jacobian.T @ left[runs.used], rel=1e-6, abs=1e-6)
    others = slice(6, len(TERMS))
    beside, square, again = equations.sums_beside(left, others)
    kept = np.delete(np.arange(theta.size), np.arange(theta.size)[others])
    assert beside == pytest.approx(gram[kept], rel=1e-9, abs=1e-9)
    assert square == pytest.approx(np.diag(gram), rel=1e-9, abs=1e-9)
    assert again == pytest.approx(right, rel=1e-9, abs=1e-9)


@pytest.mark.usefixtures("way")
@RUBS
def test_slopes_with_respect_to_first_outputs_equal_those_of_the_full_jacobian(
    friction: str, rub: tuple[float, ...]
) -> None:
    both, theta = made(friction, rub)
    k, data = len(TERMS), replace(both.data, u=both.data.u[:1], y=both.data.y[:1])
    for early in (False, True):
        runs = Runs(both.variables, TERMS, data, early=early)
        values = np.concatenate([theta[:k], runs.start_values(), rub])
        equations = NormalEquations(runs, runs.ends)
        assert equations.outputs(values) is not None
        wanted = followed_freely(runs, values)[1][:, k : k + 2]
        assert np.abs(wanted[runs.begins[0] :]).max() > 0.1
        assert equations.start_slopes() == pytest.approx(wanted, abs=1e-8)


@pytest.mark.usefixtures("way")
def test_a_diverging_run_has_no_outputs() -> None:
    runs, theta = made("", ())
    theta[1] = 1e4
    away: Any = SimpleNamespace(**{**vars(runs), "outputs_before_run": runs.outputs_before_run})
    assert NormalEquations(away, np.array([-np.inf, np.inf])).outputs(theta) is None


def test_terms_share_their_factors_of_past_outputs_and_of_inputs() -> None:
    found = factored([0, 0, 1, 1], every_term(4, 3))
    # 1, two outputs as they are, two clipped ones, three products of two and four of three
    assert found.parent.size == 1 + 2 + 2 + 3 + 4
    assert len(found.inputs) == 1 + 2 + 2 + 3 + 4
    assert (found.parent[1:] < np.arange(1, found.parent.size)).all()
    assert len({*zip(found.place.tolist(), found.column.tolist(), strict=True)}) == len(every_term(4, 3))
