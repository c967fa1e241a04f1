"""Effort of a search for a user's parameters, kept in `numbers_asked.json`."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.equations import fit, search
from estimation.equations.definition import Equations, Parameter
from estimation.equations.problem import Part, Problem
from estimation.fits.greybox.descent import Point
from plant.arrays import Array
from plant.log.record import Record
from tests.numbers import Numbers, refused
from tests.watched import watched

NUMBERS = Numbers(__file__)
N = 320
PUSH: Array = np.sign(np.sin(0.11 * np.arange(N)))
NOISE: Array = np.random.default_rng(71).standard_normal(N)


def lag(state: Any, inputs: Any, p: Any) -> Any:
    return ((p.gain * inputs.push - state.way) / p.time,)


MODEL = Equations(
    lag,
    states={"way": "m"},
    inputs={"push": "N"},
    outputs={"way": "m"},
    parameters={"gain": Parameter(0.5, (0.0, 4.0)), "time": Parameter(0.3, (0.01, 9.0))},
    initial={"way": 0.0},
)
THETA: Array = np.array([2.0, np.log(0.4)])


def problem(**changes: Any) -> Problem:
    part = Part(PUSH[:, None], np.zeros((1, N)), 0.05)
    bare = Problem(MODEL, (part,), "rk4", 1, np.array([0.05]))
    way = bare.predicted(THETA)[0] + 0.05 * NOISE
    return replace(bare, parts=(replace(part, measured=way),), **changes)


def evaluations(_: Any, start: Array, most: int, __: Any, *promised: float) -> list[Any]:
    return [len(start), most, *promised]


@NUMBERS.case()
def descents() -> dict[str, Any]:
    told: dict[str, Any] = {}
    one = problem()
    guesses = [THETA + 0.1 * k for k in range(5)]
    with watched(search, "descend", evaluations) as asked:
        search._optima(one, guesses[:1])
        search._optima(one, guesses)
    told["starts"] = asked
    lengths: list[int] = []

    def stay(at: Callable[[Array], Point], start: Array, *_: Any) -> Point:
        lengths.append(len(at.__self__.parts[0].inputs))  # type: ignore[attr-defined]  # a problem's method
        return at(start)

    with watched(search, "descend", evaluations, stay):
        search._optimum_by_lengthening(one, THETA)
    told["beginnings"] = lengths
    with watched(search, "descend", evaluations) as asked:
        point, left = search._final_descent(one, THETA + 0.2)
    told["finished"] = [asked, left, point.theta]
    with watched(search, "descend", evaluations, lambda at, start, most, *_: [at(start) for _ in range(most)].pop()):
        told["not finished"] = search._final_descent(one, THETA)[1]
    return told


@NUMBERS.case()
def threads() -> dict[str, Any]:
    """Return the number of threads for matrix products: more threads make small products slower."""
    record = Record(0.05, {"push": PUSH, "way": problem().parts[0].measured[0]})
    with watched(fit, "threadpool_limits", lambda **given: given) as asked:
        fit.fit_equations(MODEL, [record])
    return {"fits": asked}


@NUMBERS.case()
def rounds() -> dict[str, Any]:
    told: dict[str, Any] = {}
    one = problem()
    typical = np.array([1.0])
    for name, sizes in {
        "never agree": [0.1, 0.05] * 9,
        "nearly agree": [0.05 * (1.0 + 0.009), *[0.05] * 9],
        "do not quite": [0.05 * (1.0 + 0.011), *[0.05 * (1.0 + 0.011)] * 9],
    }.items():
        shown = iter(sizes)
        with watched(search, "_residual_deviations", lambda *_: 0, lambda *_: np.array([next(shown)])) as asked:  # noqa: B023
            search._refined_solution(one, one.at(THETA), np.array([np.nan]), typical)
        told[f"noises that {name}"] = len(asked)
    with watched(search, "_residual_deviations", lambda *_: 0) as asked:
        found = search._refined_solution(one, one.at(THETA), np.array([0.07]), typical)
    told["noise that is given"] = [len(asked), found.problem.noise, found.moved, found.evaluations]
    return told


@NUMBERS.case()
def whole_searches() -> dict[str, Any]:
    told: dict[str, Any] = {}
    one = problem()
    end = one.at(THETA)
    for name, moved in {
        "settles": [0.049],
        "does not settle": [0.051] * 9,
        "settles at last": [0.3, 0.1, 0.04],
    }.items():
        left = iter(moved)

        def refined(this: Problem, *_: Any, left: Iterator[float] = left) -> search.Solution:
            return search.Solution(this, end, moved=next(left))

        with watched(search, "_refined_solution", lambda this, *_: this.substeps, refined) as asked:
            found = search.best_solution(MODEL, one.parts, np.array([np.nan]), robust=False, starts=1, seed=0)
        told[name] = [asked, found.moved]
    for name, explained in (("explained", True), ("astray", False)):
        with (
            watched(
                search, "_is_explained", lambda this, _, noise: [this.noise, noise], lambda *_, to=explained: to
            ) as noises,
            watched(search, "_optimum_by_lengthening", lambda this, _: this.noise) as longer,
        ):
            found = search.best_solution(MODEL, one.parts, np.array([np.nan]), robust=True, starts=2, seed=1)
        told[name] = [noises, longer, len(found.others), found.problem.noise]
    far = Equations(lambda state, *_: (state.way * state.way * 1e9,), **_given())
    told["refused"] = [
        refused(
            lambda: search.with_enough_steps(Problem(far, one.parts, "rk4", 1, np.ones(1)), np.array([2.0, 0.0, 9e9]))
        ),
        refused(lambda: search._optima(Problem(far, one.parts, "rk4", 1, np.ones(1)), [np.array([2.0, 0.0, 9e9])])),
    ]
    return told


def _given() -> dict[str, Any]:
    names = ("states", "inputs", "outputs", "parameters")
    return {name: getattr(MODEL, name) for name in names}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
