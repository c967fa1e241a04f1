"""Polynomial models with given coefficients: their runs and predictions, friction in units, and how they start."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from estimation.arrays import Array
from estimation.identification.free_run.data import Scaling
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.polynomial_dynamics import SMOOTHING_SAMPLES, START_STEPS, PolynomialDynamics
from estimation.identification.free_run.polynomial_variables import Variables

U = np.random.default_rng(4).uniform(-1.0, 1.0, (60, 1))


def body(*friction: float, kind: str = "", lags: int = 1, square: float = 0.0) -> PolynomialDynamics:
    """Return ``y = 0.6 y[-1] + 0.5 u[-1] + square y[-1]^2``, with friction if it is given."""
    source, lag = np.array([0] * lags + [1]), np.array([*range(1, lags + 1), 1])
    variables = Variables(source, lag, np.array([[-9.0, 9.0]] * (lags + 1)), kind)
    terms = np.array([[0, -1, -1], [lags, -1, -1], [0, 0, -1]])
    return PolynomialDynamics(variables, terms, np.array([0.6, 0.5, square]), np.array(friction))


def run_by_hand(first: float, square: float = 0.0) -> Array:
    out = np.full(len(U), first)
    for t in range(1, len(U)):
        out[t] = 0.6 * out[t - 1] + 0.5 * U[t - 1, 0] + square * out[t - 1] ** 2
    return out


@pytest.mark.parametrize("square", [0.0, 0.2])
def test_a_run_begins_with_the_first_output_that_fits_the_measured_ones_best(square: float) -> None:
    truth = run_by_hand(0.7, square)
    seen = truth + np.where(np.arange(len(U)) == 0, 0.5, 0.0)  # the first sample is wrong, but the others determine it
    seen[10:20] = np.nan
    off = body(square=square).run(U, seen) - truth

    def cost(first: float) -> float:
        return float(np.nansum((run_by_hand(first, square) - seen) ** 2))

    best = minimize_scalar(cost, bracket=(0.5, 1.2), tol=1e-10).x
    assert off[0] == pytest.approx(best - 0.7, abs=1e-3)
    assert abs(off[-1]) < 1e-4


def test_the_search_of_a_start_ends_if_a_step_gains_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    real = NormalEquations.outputs

    def counted(self: NormalEquations, theta: Array) -> Any:
        asked.append(1)
        return real(self, theta)

    monkeypatch.setattr(NormalEquations, "outputs", counted)
    one = body()
    found = one.run(U, run_by_hand(0.7) + 0.1 * np.sin(np.arange(60.0)))
    # a linear start is found in one step, and the next step gains nothing; smoothed ones are run once each
    assert 2 + 2 * len(SMOOTHING_SAMPLES) <= len(asked) <= 4 + 2 * len(SMOOTHING_SAMPLES) < START_STEPS
    assert found[1:] == pytest.approx(0.6 * found[:-1] + 0.5 * U[:-1, 0])


@pytest.mark.parametrize(("kind", "power"), [("velocity", 1), ("position", 2)])
def test_friction_levels_are_reported_in_units_of_the_output(kind: str, power: int) -> None:
    by = Scaling(np.zeros(1), np.ones(1), 3.0, 2.0)
    values = (0.1, 0.3, 0.5)[: 3 if kind == "velocity" else 2]
    told = body(*values, kind=kind).nonlinearity(by, 0.01)
    assert told is not None
    assert told["kind"] == f"{kind}-friction"
    assert told["below"]["value"] == pytest.approx(0.1 * 2.0 / 0.01**power)
    assert told["above"]["value"] == pytest.approx(0.3 * 2.0 / 0.01**power)
    if kind == "velocity":
        assert told["rest"]["value"] == pytest.approx(3.0 + 2.0 * 0.5)
    else:
        assert "rest" not in told
    assert body().nonlinearity(by, 0.01) is None


@pytest.mark.parametrize(("kind", "friction"), [("velocity", (0.1, 0.2, 0.05)), ("position", (0.1, 0.2)), ("", ())])
def test_a_one_step_prediction_is_computed_from_the_measured_past(kind: str, friction: tuple[float, ...]) -> None:
    y = np.random.default_rng(5).uniform(-0.8, 0.8, 60)
    found = body(*friction, kind=kind).one_step(U, y)
    assert np.isnan(found[0])
    sides: set[int] = set()
    for t in range(1, 60):
        free = 0.6 * y[t - 1] + 0.5 * U[t - 1, 0]
        rest = 0.05 if kind == "velocity" else y[t - 1]
        side = 0 if not kind else 2 if -0.1 <= free - rest <= 0.2 else 1 if free > rest else -1
        assert found[t] == pytest.approx({0: free, 1: free - 0.2, -1: free + 0.1, 2: rest}[side])
        sides.add(side)
    assert sides == ({-1, 1, 2} if kind else {0})
    lost = y.copy()
    lost[7] = np.nan
    assert np.flatnonzero(np.isnan(body(*friction, kind=kind).one_step(U, lost))).tolist() == [0, 8]


def test_dynamics_from_their_dictionary_give_the_same_run_and_number_of_parameters() -> None:
    for one in (body(square=0.2), body(0.1, 0.2, 0.05, kind="velocity"), body(0.1, 0.2, kind="position")):
        again = PolynomialDynamics.from_dict(one.to_dict())
        assert np.array_equal(again.terms, one.terms)
        assert np.array_equal(again.run(U, run_by_hand(0.3)), one.run(U, run_by_hand(0.3)))
        assert again.n_values == one.n_values == 3 + one.friction.size
    values = body(0.1, 0.2, 0.05, kind="velocity").to_dict()
    values["friction"]["values"] = [0.1, 0.2]
    with pytest.raises(ValueError, match="friction of 3 values is needed, got 2"):
        PolynomialDynamics.from_dict(values)


def test_noise_in_the_first_outputs_does_not_make_the_run_of_a_softening_spring_diverge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # two samples of 1 ms give a speed: a body in a pit at zero, with a cubic force that drives it away beyond 1.2
    variables = Variables(np.array([0, 0, 1]), np.array([1, 2, 1]), np.array([[-9.0, 9.0]] * 3), "")
    terms = np.array([[0, -1, -1], [1, -1, -1], [2, -1, -1], [0, 0, 0]])
    pit = PolynomialDynamics(variables, terms, np.array([1.98, -0.99, 0.001, 0.007]), np.zeros(0))
    u = np.repeat(np.random.default_rng(2).uniform(-1.0, 1.0, 40), 10)[:, None]
    truth = np.zeros(400)
    for t in range(2, 400):
        truth[t] = 1.98 * truth[t - 1] - 0.99 * truth[t - 2] + 0.001 * u[t - 1, 0] + 0.007 * truth[t - 1] ** 3
    seen = truth.copy()
    seen[:2] += [-0.15, 0.15]
    assert np.abs(pit.run(u, seen) - truth).max() < 0.03
    monkeypatch.setattr(f"{PolynomialDynamics.__module__}.SMOOTHING_SAMPLES", ())
    assert not np.abs(pit.run(u, seen) - truth).max() < 1.0  # with the measured first outputs only
