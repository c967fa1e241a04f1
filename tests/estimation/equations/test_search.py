"""Starts of searches for parameters of user equations, and their first noise level."""

from typing import Any

import numpy as np
import pytest

from estimation.equations import search
from estimation.equations.definition import Equations, Parameter
from estimation.equations.problem import Problem, part_of
from estimation.equations.search import _guesses, _step_length_shift
from plant.log.record import Record

RECORD = Record(0.05, {"push": np.sin(np.arange(100.0)), "way": np.cos(np.arange(100.0))})


def lag(state: Any, inputs: Any, p: Any) -> Any:
    return (p.gain * inputs.push - p.rate * state.way + p.load,)


def test_further_starts_are_drawn_within_the_bounds_or_if_unbounded_near_the_first_start() -> None:
    equations = Equations(
        lag,
        states={"way": "m"},
        inputs={"push": "N"},
        outputs={"way": "m"},
        parameters={"gain": Parameter(3.0), "rate": Parameter(0.5, (0.1, 10.0)), "load": Parameter(-1.0)},
        initial={"way": Parameter(0.3)},
    )
    problem = Problem(equations, (part_of(equations, RECORD),), "rk4", 1, np.array([0.01]))
    given, *others = _guesses(problem, 400, seed=2)
    assert problem.values(given) == pytest.approx([3.0, 0.5, -1.0, 0.3])
    assert len(others) == 399
    away = np.array(others) - given
    for free in (0, 2):  # two units of the search on either side
        assert np.abs(away[:, free]).max() <= 2.0
        assert away[:, free].min() < -1.9
        assert away[:, free].max() > 1.9
    rates = np.array([problem.values(one)[1] for one in others])
    assert rates.min() >= 0.1
    assert rates.max() <= 10.0
    assert rates.min() < 0.11 * 1.2
    assert rates.max() > 9.0
    assert np.all(away[:, 3] == 0.0)  # initial states start from their given values
    again = _guesses(problem, 2, seed=2)
    assert np.array_equal(again[1], others[0])
    assert not np.array_equal(_guesses(problem, 2, seed=3)[1], others[0])


@pytest.mark.parametrize("substeps", [1, 2])
def test_a_solution_that_diverges_with_other_steps_has_an_infinite_step_error(
    substeps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    equations = Equations(
        lag,
        states={"way": "m"},
        inputs={"push": "N"},
        outputs={"way": "m"},
        parameters={"gain": Parameter(3.0), "rate": Parameter(0.5), "load": Parameter(-1.0)},
        initial={"way": Parameter(0.3)},
    )
    problem = Problem(equations, (part_of(equations, RECORD),), "rk4", 1, np.array([0.01]))
    point = problem.at(problem.coordinates(np.array([3.0, 0.5, -1.0, 0.3])))
    assert 0.0 < _step_length_shift(problem, point) < 0.05
    whole = search._finite_residuals
    monkeypatch.setattr(
        search, "_finite_residuals", lambda one, at: None if one.substeps == substeps else whole(one, at)
    )
    assert _step_length_shift(problem, point) == np.inf
