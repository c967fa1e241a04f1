"""Normal equations of factored terms are those of the sensitivities that the general run has."""

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
    """Return two logs in which one output of ten is missing, and a block of the first."""
    rng = np.random.default_rng(2)
    outputs = [np.where(rng.random(n) < 0.1, np.nan, rng.normal(size=n)) for n in (150, 90)]
    outputs[0][40:80] = np.nan
    return Channels(("u",), "y", 1.0, tuple(rng.normal(size=(y.size, 1)) for y in outputs), tuple(outputs))


def made(friction: str, rub: tuple[float, ...]) -> tuple[Runs, Array]:
    """Return runs whose products and outputs are held at their ends now and then, and values of all terms."""
    limits = np.array([[-0.4, 0.5]] * 2 + [[-2.0, 1.5]] * 3)
    variables = Variables(np.array([0, 0, 1, 1, 1]), np.array([1, 2, 0, 3, 4]), limits, friction)
    runs = Runs(variables, TERMS, logs())
    theta = np.concatenate([0.02 * np.random.default_rng(3).normal(size=len(TERMS)), runs.start_values(), rub])
    theta[1:4] = 1.1, -0.4, 0.3
    return runs, theta


@pytest.fixture(params=["compiled", "Python"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "Python":
        for name in ("run_factored", "slopes_of", "write_rows"):
            monkeypatch.setattr(normal_equations, name, getattr(normal_equations, name).__wrapped__)


@pytest.mark.usefixtures("way")
@RUBS
def test_runs_and_sums_of_factored_terms_are_those_of_the_terms_themselves(
    friction: str, rub: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    runs, theta = made(friction, rub)
    monkeypatch.setattr(normal_equations, "STRETCH", 40 * theta.size)  # stretches begin within logs and within gaps
    ran = runs.run(theta)
    assert ran is not None
    assert np.isin(ran[0], runs.ends).any()
    jacobian, left = runs.sensitivities(*ran, TERMS, starts=True)[runs.used], ran[0] - runs.target
    equations = NormalEquations(runs, runs.ends)
    assert equations.outputs(theta) == pytest.approx(ran[0], rel=1e-12, abs=1e-12)
    gram, right = equations.sums(left)
    assert gram == pytest.approx(jacobian.T @ jacobian, rel=1e-9, abs=1e-9)
    assert right == pytest.approx(jacobian.T @ left[runs.used], rel=1e-9, abs=1e-9)
    others = slice(6, len(TERMS))
    beside, square, again = equations.sums_beside(left, others)
    kept = np.delete(np.arange(theta.size), np.arange(theta.size)[others])
    assert beside == pytest.approx(gram[kept], rel=1e-9, abs=1e-9)
    assert square == pytest.approx(np.diag(gram), rel=1e-9, abs=1e-9)
    assert again == pytest.approx(right, rel=1e-9, abs=1e-9)


@pytest.mark.usefixtures("way")
def test_a_run_that_grows_beyond_bounds_has_no_outputs() -> None:
    runs, theta = made("", ())
    theta[1] = 1e4
    away: Any = SimpleNamespace(**{**vars(runs), "begun": runs.begun})
    assert NormalEquations(away, np.array([-np.inf, np.inf])).outputs(theta) is None


def test_terms_share_what_they_have_of_past_outputs_and_of_inputs() -> None:
    found = factored([0, 0, 1, 1], every_term(4, 3))
    # 1, two outputs as they are, two that are held, three products of two and four of three
    assert found.parent.size == 1 + 2 + 2 + 3 + 4
    assert len(found.inputs) == 1 + 2 + 2 + 3 + 4
    assert (found.parent[1:] < np.arange(1, found.parent.size)).all()
    assert len({*zip(found.place.tolist(), found.column.tolist(), strict=True)}) == len(every_term(4, 3))
