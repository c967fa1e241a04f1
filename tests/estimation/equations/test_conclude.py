"""Objections to a fit of user equations, and notes for information only."""

# ruff: noqa: ARG005 - every function is given the same three things

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.equations.conclude import concluded_finding, covariance_of
from estimation.equations.definition import Equations, Parameter
from estimation.equations.fit import EquationsFit, _with_fitted_starts, fit_equations, simulated_outputs
from estimation.equations.problem import Problem, part_of
from estimation.equations.search import EVALUATIONS, LARGEST_SHIFT, MOST_STEPS
from plant.errors import HydrostateError, LogError
from plant.log.record import Record

TIME = 0.05 * np.arange(300)
NOISE = 0.01 * np.random.default_rng(3).standard_normal(300)
PUSH = np.clip(2.0 * np.sin(TIME), -1.0, 1.0)


def lag(state: Any, inputs: Any, p: Any) -> Any:
    return (p.gain * p.gain * inputs.push - state.way,)


def limited(state: Any, inputs: Any, p: Any) -> Any:  # noqa: ARG001  all are given the same three things
    return (np.clip(state.way, -0.5, 0.5),)


def equations(derivative: Any = lag, **changes: Any) -> Equations:
    names: dict[str, Any] = {"states": {"way": "m"}, "inputs": {"push": "N"}, "outputs": {"way": "m"}}
    parameters = {"gain": Parameter(0.8, (-3.0, 3.0))}
    return Equations(derivative, **{**names, "parameters": parameters, "initial": {"way": 0.0}, **changes})


def response(push: Any) -> Any:
    """Return the exact response of a lag with a gain of one to an input that is linear between samples."""
    way, fall = np.zeros(len(push)), np.exp(-0.05)
    for k in range(1, len(push)):
        rise = (push[k] - push[k - 1]) / 0.05
        way[k] = push[k] - rise + (way[k - 1] - push[k - 1] + rise) * fall
    return way


WAY = response(PUSH)


def log(way: Any = WAY, push: Any = PUSH) -> Record:
    return Record(0.05, {"push": push, "way": way + NOISE})


@pytest.fixture(scope="module")
def found() -> EquationsFit:
    return fit_equations(equations(), [log()])


def codes(notes: Any) -> set[str]:
    return {str(note.code) for note in notes}


def test_an_input_at_its_limit_is_noted_and_does_not_fail_the_gate(found: EquationsFit) -> None:
    assert found.finding.gate.passed
    ends = {note.data["end"]: note.data["value"] for note in found.finding.notes if note.code == "input_at_limit"}
    assert ends == {"least": -1.0, "largest": 1.0}


def test_an_output_at_a_limit_in_the_equations_is_noted_and_does_not_fail_the_gate() -> None:
    fit = fit_equations(equations(observe=limited), [log(np.clip(WAY, -0.5, 0.5))])
    assert fit.finding.gate.passed
    ends = {note.data["end"]: note.data["value"] for note in fit.finding.notes if note.code == "output_at_limit"}
    assert ends == {"least": pytest.approx(-0.5, abs=0.02), "largest": pytest.approx(0.5, abs=0.02)}


def test_a_misfit_is_not_attributed_to_a_constant_input() -> None:
    push = np.ones(300)
    slow = equations(lambda s, i, p: (p.gain * (i.push - s.way),), parameters={"gain": Parameter(0.5, (0.01, 10.0))})
    drifting = response(push) + 0.3 * np.sin(2.0 * TIME)
    reasons = codes(fit_equations(slow, [log(drifting, push)]).finding.gate.reasons)
    assert "misfit_correlated" in reasons
    assert "misfit_follows_input" not in reasons


def test_different_solutions_that_fit_the_log_equally_well_are_noted() -> None:
    fit = fit_equations(equations(), [log()], starts=6, seed=1)
    assert abs(fit.values["gain"]) == pytest.approx(1.0, abs=0.01)
    (other,) = (note for note in fit.finding.notes if note.code == "starts_disagree")
    assert other.data["parameter"] == "gain"
    assert other.data["value"] == pytest.approx(-fit.values["gain"], abs=1e-3)


@pytest.mark.parametrize(("worse", "told"), [(1.5, True), (2.5, False)])
def test_starts_disagree_only_if_their_log_likelihoods_differ_by_less_than_two(
    found: EquationsFit, worse: float, told: bool
) -> None:
    solution = found.solution
    mirror = -solution.point.theta  # the gain is squared, so its sign is undetermined
    other = replace(solution, others=(mirror,), point=replace(solution.point, cost=solution.point.cost - worse))
    notes = concluded_finding(other, np.array([np.nan]))[0].notes
    assert ("starts_disagree" in codes(notes)) is told


def test_too_long_steps_and_a_search_that_did_not_converge_fail_the_gate(found: EquationsFit) -> None:
    given = np.array([np.nan])
    doubted = replace(found.solution, moved=1.01 * LARGEST_SHIFT, evaluations=EVALUATIONS)
    reasons = {str(note.code): note.data for note in concluded_finding(doubted, given)[0].gate.reasons}
    assert reasons == {
        "steps_too_long": {"deviations": 1.01 * LARGEST_SHIFT, "steps": 2 * MOST_STEPS},
        "not_converged": {"evaluations": EVALUATIONS},
    }
    assert concluded_finding(replace(found.solution, moved=0.99 * LARGEST_SHIFT), given)[0].gate.passed


def test_equations_need_a_log() -> None:
    with pytest.raises(LogError, match="a log is needed to fit the equations to, got none"):
        fit_equations(equations(), [])


def test_the_search_of_a_free_initial_state_begins_at_the_given_value() -> None:
    free = equations(initial={"way": Parameter(0.3, (0.0, 1.0))})
    problem = Problem(free, (part_of(free, log()),), "rk4", 1, np.array([0.01]))
    assert [one.start for one in problem.unknowns] == [0.8, 0.3]
    assert problem.values(problem.bounds[1])[1] == pytest.approx(1.0)
    fit = fit_equations(free, [log(1.0 * WAY + 0.2 * np.exp(-TIME))])
    assert fit.finding.quantities["initial way"].covers(0.2)


@pytest.mark.parametrize("size", [1e4, 25.0], ids=["beyond all numbers", "squares beyond all numbers"])
def test_a_point_at_which_the_equations_diverge_has_an_infinite_cost(size: float) -> None:
    growing = equations(
        lambda s, i, p: (p.rate * s.way + i.push,),
        parameters={"rate": Parameter(1.0, (0.0, 1e9))},
        initial={"way": 1.0},
    )
    problem = Problem(growing, (part_of(growing, log()),), "rk4", 1, np.array([0.01]))
    assert np.isfinite(problem.at(problem.coordinates(np.array([0.5]))).cost)
    point = problem.at(problem.coordinates(np.array([size])))
    assert point.cost == np.inf
    assert not point.gradient.any()


def test_equations_that_diverge_from_every_start_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("estimation.equations.search.with_enough_steps", lambda problem, _: problem)
    growing = equations(
        lambda s, i, p: (p.rate * s.way + i.push,),
        parameters={"rate": Parameter(1e4, (9e3, 1e5))},
        initial={"way": 1.0},
    )
    with pytest.raises(HydrostateError, match="the equations run away from every start"):
        fit_equations(growing, [log()], starts=3)


def test_steps_are_halved_until_the_solution_no_longer_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "estimation.equations.search.LARGEST_STEP_CHANGE", 1e3
    )  # the first check finds all steps short enough
    swinging = equations(
        lambda s, i, p: (s.pace, 40.0 * (i.push - s.way) - p.damping * s.pace),
        states={"way": "m", "pace": "m/s"},
        parameters={"damping": Parameter(2.0, (0.1, 10.0))},
        initial={"way": 0.0, "pace": 0.0},
    )
    way = simulated_outputs(swinging, log(), {"damping": 1.5}, {})["way"]
    fit = fit_equations(swinging, [Record(0.05, {"push": PUSH, "way": way + 1e-3 * NOISE})])
    assert fit.solution.problem.substeps > 1
    assert fit.solution.moved <= LARGEST_SHIFT
    assert fit.finding.quantities["damping"].covers(1.5)


def test_a_noise_estimate_that_does_not_converge_ends_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("estimation.equations.search.ROUNDS", 1)
    fit = fit_equations(equations(), [log()])
    assert fit.noise["way"] == pytest.approx(0.01, rel=0.2)


def test_the_search_of_initial_states_takes_at_most_ten_steps() -> None:
    flat = equations(
        lambda s, i, p: (0.0 * p.gain * i.push + 0.0 * s.way,), observe=lambda s, i, p: (s.way**3,), initial={}
    )
    record = Record(0.05, {"push": PUSH, "way": np.zeros(300)})
    problem = Problem(flat, (part_of(flat, record),), "rk4", 1, np.array([1.0]))
    theta = _with_fitted_starts(problem, problem.coordinates(np.array([0.8, 1.0])), [1])
    assert problem.values(theta)[1] == pytest.approx((2.0 / 3.0) ** 10)


def linear(slopes: np.ndarray) -> Any:
    """Return a problem whose residuals are white and whose sensitivities are given."""
    errors = np.random.default_rng(9).standard_normal(len(slopes))
    errors *= 0.1 / np.sqrt(np.mean(errors**2))
    part = SimpleNamespace(measured=np.zeros((1, len(slopes))))
    return SimpleNamespace(slopes=lambda _: slopes, residuals=lambda _: [errors], parts=[part])


def test_deviations_equal_linear_least_squares_for_sensitivities_of_any_size() -> None:
    rng = np.random.default_rng(0)
    slopes = rng.normal(size=(400, 3)) * [1e-4, 1.0, 1e3]
    found = covariance_of(linear(slopes), np.zeros(3))
    exact = 0.01 * 400 / 397 * np.linalg.inv(slopes.T @ slopes)
    assert found.std == pytest.approx(np.sqrt(np.diag(exact)), rel=1e-9)
    assert found.correlation[0, 1] == pytest.approx(exact[0, 1] / np.sqrt(exact[0, 0] * exact[1, 1]), rel=1e-6)
    assert found.groups == ()
    scaled = slopes / np.linalg.norm(slopes, axis=0)
    assert found.condition == pytest.approx(np.linalg.cond(scaled))


def test_undetermined_unknowns_are_grouped_and_the_others_keep_their_deviations() -> None:
    rng = np.random.default_rng(0)
    own, shared = rng.normal(size=(2, 400))
    found = covariance_of(linear(np.column_stack([shared, own, np.zeros(400), -2.0 * shared])), np.zeros(4))
    assert np.isfinite(found.std).tolist() == [False, True, False, False]
    assert set(found.groups) == {(2,), (0, 3)}
    assert np.isnan(found.correlation[1]).tolist() == [True, False, True, True]
    assert found.condition == np.inf
    pair = np.column_stack([own, shared])
    assert found.std[1] ** 2 == pytest.approx(0.01 * 400 / 398 * np.linalg.inv(pair.T @ pair)[0, 0], rel=1e-9)
