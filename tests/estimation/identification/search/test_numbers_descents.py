"""Loops, solvers and descents on small records, kept in `numbers_descents.json`; loops run as plain Python."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from estimation.identification.search import pole_search
from estimation.identification.search.criterion import (
    is_stable,
    stabilised_denominator,
)
from estimation.identification.search.descent import CHUNK, descend, normal_equations, solve_damped, stable
from estimation.identification.search.levenberg import levenberg
from estimation.identification.search.linear import inverse_of_triangle, least_squares
from estimation.identification.search.one_step import prediction_errors
from estimation.identification.search.response import impulse_response, respond
from plant.arrays import Array
from tests.estimation.identification.search.made_answers import BOUNDS, WEIGHT, F, U, answer
from tests.kernels import loops_in_python
from tests.numbers import Found, Numbers, some

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def stability() -> dict[str, Any]:
    with loops_in_python():
        rows = {
            "first order": [stable(np.array([f])) for f in (-1.0, -0.999, 0.999, 1.0, 1.001)],
            "second order": [
                stable(np.array(f)) for f in ((-1.9, 0.91), (-1.9, 0.89), (0.0, 0.99), (0.0, 1.01), (1.9, 0.91))
            ],
            "third order": [
                stable(np.poly(roots)[1:])
                for roots in ((0.9, 0.5, 0.3), (1.05, 0.5, 0.3), (-0.9, 0.5, 0.3), (-1.05, 0.5, 0.3), (0.9, 0.9, 1.2))
            ],
            "fifth order": [stable(np.poly([one, 0.3, -0.4, 0.6, 0.1])[1:]) for one in (0.98, 1.02, -0.98, -1.02)],
            "not finite": stable(np.array([np.nan, 0.1])),
        }
    told = {"by roots": [is_stable(np.array([1.0, f])) for f in (-1.0, -0.99, 1.01, np.inf)]}
    for name, roots in {"one outside": (1.5, 0.5), "on the circle": (1.0, 0.3), "beyond it": (-2.0, 1.001)}.items():
        told[f"reflected, {name}"] = stabilised_denominator(np.poly(roots), 50).tolist()
    reflected = pole_search.reflected([np.poly((1.5, 0.5)), np.poly((1.0, 0.3)), np.poly((0.2, 0.3))])
    return {**rows, **told, "kept inside": reflected}


@NUMBERS.case()
def equations_that_are_solved() -> dict[str, Any]:
    gram = np.array([[4.0, 9.0, 9.0], [1.0, 3.0, 9.0], [0.5, -0.7, 2.0]])
    gradient = np.array([1.0, -2.0, 0.5])
    told: dict[str, Any] = {}
    with loops_in_python():
        for damping in (0.0, 0.1, 10.0):
            step = np.zeros(3)
            told[f"damped by {damping:g}"] = [solve_damped(gram, gradient, damping, step, np.zeros((3, 3))), step]
        hollow, step = gram.copy(), np.zeros(3)
        hollow[2], hollow[:, 2] = 0.0, 0.0
        told["nothing is known of one"] = [solve_damped(hollow, gradient, 0.1, step, np.zeros((3, 3))), step]
        wrong = np.array([[1.0, 0.0], [2.0, 1.0]])
        told["not definite"] = solve_damped(wrong, gradient[:2], 0.0, np.zeros(2), np.zeros((2, 2)))
        told["bordering"] = solve_damped(np.array([[1.0, 0.0], [1.0, 1.0]]), np.ones(2), 0.0, step, np.zeros((2, 2)))
    told["inverse of a triangle"] = inverse_of_triangle(np.array([[2.0, 1.0, 3.0], [0.0, 4.0, -1.0], [0.0, 0.0, 0.5]]))
    near = np.array([[1.0, 1.0], [1.0, 1.0 + 1e-15]])
    told["of least size"] = least_squares(near, np.array([2.0, 2.0]))
    return told


@NUMBERS.case()
def responses() -> dict[str, Any]:
    told: dict[str, Any] = {}
    with loops_in_python():
        for name, f, n_s in (
            ("resonance", F[1:], 2),
            ("resonance that lasts", np.array([-1.9, 0.95]), 3),
            ("quick", np.array([-0.01]), 2),
            ("quick and through zero", np.array([0.0, 0.001]), 2),
            ("none is asked", F[1:], 0),
        ):
            pulse = np.zeros(100)
            felt = impulse_response(f, 60, n_s, 4, pulse)
            told[name] = [felt, np.count_nonzero(pulse), some(pulse[:64], 9)]
        pad, n = 4, 60
        signals, simulated = np.zeros((3, pad + n)), np.zeros(n)
        felt = impulse_response(F[1:], n, 2, pad, signals[0])
        respond(np.array([0.3, -0.1]), F[1:], 1, np.array([0.5, -0.2]), U[:n], pad, signals, felt, simulated)
        told["an experiment"] = [some(simulated, 9), *(some(one) for one in signals)]
    return told


@NUMBERS.case()
def normal_equations_of_two_experiments() -> dict[str, Any]:
    told: dict[str, Any] = {}
    y = answer()
    theta = np.array([0.25, -0.05, -1.45, 0.66, 0.1, -0.05, 0.02, 0.1])
    sizes = np.array([2, 2, 1, 2])
    with loops_in_python():
        gram, gradient = np.zeros((8, 8)), np.zeros(8)
        cost = normal_equations(theta, sizes, U, y, WEIGHT, BOUNDS, gram, gradient)
        told["both"] = [cost, gram, gradient]
        free, least = np.zeros((4, 4)), np.zeros(4)
        cost = normal_equations(theta[:4], np.array([2, 2, 1, 0]), U, y, WEIGHT, BOUNDS, free, least)
        told["at rest"] = [cost, free, least]
        wide, rest = np.zeros((6, 6)), np.zeros(6)
        late = np.concatenate([theta[:1], theta[2:4], [0.1, 0.2, 0.3]])
        cost = normal_equations(late, np.array([1, 2, 3, 3]), U, y, WEIGHT, np.array([0, 200]), wide, rest)
        told["late"] = [cost, wide, rest]
    n = CHUNK + 300
    u = np.sign(np.sin(0.003 * np.arange(n) ** 1.3))
    quick = np.array([0.2, -0.4, 0.3])
    gram, gradient = np.zeros((3, 3)), np.zeros(3)
    slow = np.array([0.002, -0.998, 0.3])
    for name, values in (("quick", quick), ("slow", slow)):
        cost = normal_equations(
            values, np.array([1, 1, 0, 1]), u, 0.5 * u, np.ones(n), np.array([0, n]), gram, gradient
        )
        told[f"longer than a chunk, {name}"] = [cost, gram.copy(), gradient.copy()]
    return told


@NUMBERS.case()
def steps_of_a_descent() -> dict[str, Any]:
    told: dict[str, Any] = {}
    y, sizes = answer(), np.array([2, 2, 1, 2])
    begin = {
        "near": np.array([0.25, -0.05, -1.45, 0.66, 0.0, 0.0, 0.0, 0.0]),
        "far": np.array([0.1, 0.1, -0.2, -0.5, 0.0, 0.0, 0.0, 0.0]),
        "at the circle": np.array([0.1, 0.1, -1.95, 0.9506, 0.0, 0.0, 0.0, 0.0]),
        "on the other side": np.array([-0.3, 0.4, 1.2, 0.4, 0.3, 0.0, 0.0, 0.2]),
    }
    with loops_in_python():
        for name, start in begin.items():
            for most in (1, 2, 3, 5, 8):
                cost, theta, gram, ended = descend(start, sizes, U, y, WEIGHT, BOUNDS, most, 1e-9)
                told[f"{name}, {most}"] = [cost, theta, float(np.trace(gram)), ended]
        start = begin["near"]
        for tolerance in (1e-1, 1e-3, 1e-6):
            cost, _, _, ended = descend(start, sizes, U, y, WEIGHT, BOUNDS, 40, tolerance)
            told[f"to a share of {tolerance:g}"] = [cost, ended]
        exact = answer(0.0)
        exact[:70], exact[70:] = answer(0.0, U[:70]), answer(0.0, U[70:])
        truth = np.array([0.3, -0.1, -1.5, 0.7, 0.0, 0.0, 0.0, 0.0])
        told["at the truth"] = descend(truth, sizes, U, exact, WEIGHT, BOUNDS, 5, 1e-9)[3]
        none = descend(np.zeros(8), sizes, U, y, 0.0 * WEIGHT, BOUNDS, 3, 1e-9)
        told["where nothing is seen"] = [none[0], none[3]]
    return told


def line(x: Array) -> tuple[float, Array, Array]:
    """Return the cost of a curved valley, and its normal equations."""
    left = np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0], 0.3])
    slopes = np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0], [0.0, 0.0]])
    return float(left @ left), slopes.T @ slopes, slopes.T @ left


@NUMBERS.case()
def steps_of_levenberg() -> dict[str, Any]:
    told: dict[str, Any] = {}
    asked: list[float] = []

    def counted(x: Array) -> tuple[float, Array, Array]:
        asked.append(float(x[0]))
        return line(x)

    acceptances: dict[str, Callable[[Array], bool]] = {
        "free": lambda _: True,
        "held back": lambda x: bool(x[0] < 0.6),
        "nowhere": lambda _: False,
    }
    with loops_in_python():
        for name, acceptable in acceptances.items():
            for most in (1, 2, 4, 7, 12, 60):
                for slower in (3.0, 0.1):
                    asked.clear()
                    cost, x = levenberg(
                        counted, np.array([-1.2, 1.0]), acceptable, tolerance=1e-9, most_steps=most, slower=slower
                    )
                    told[f"{name}, {most}, slower {slower:g}"] = [cost, x, len(asked)]
        asked.clear()
        cost, x = levenberg(counted, np.array([0.9, 0.8]), lambda _: True, tolerance=0.5, most_steps=20)
        told["coarse"] = [cost, x, len(asked)]
        steep = (4.0, np.array([[1.0, 2.0], [2.0, 1.0]]), np.array([1.0, 0.0]))
        asked.clear()

        def indefinite(_: Array) -> tuple[float, Array, Array]:
            asked.append(0.0)
            return (steep[0] + len(asked), *steep[1:]) if len(asked) < 4 else (0.5 / len(asked), *steep[1:])

        told["not definite"] = [*levenberg(indefinite, np.zeros(2), lambda _: True, tolerance=0.0, most_steps=20)]
    return told


@NUMBERS.case()
def one_step_ahead() -> dict[str, Any]:
    told: dict[str, Any] = {}
    y, used = answer(0.3), WEIGHT > 0.0
    with loops_in_python():
        for name, tied, theta, sizes in (
            ("Box-Jenkins", False, [0.2, 0.1, -1.4, 0.6, 0.2, 0.1, -0.3, 0.1, 0.0, -0.1, 0.2], [2, 2, 2, 1, 1, 2]),
            ("more of D", False, [0.2, -1.4, 0.6, 0.2, -0.3, 0.1, 0.05, 0.1, 0.0, -0.1, 0.2], [1, 2, 1, 3, 2, 2]),
            ("ARMAX", True, [0.2, 0.1, -1.4, 0.6, 0.2, 0.1, 0.0, -0.1, 0.2], [2, 2, 1, 0, 1, 2]),
            ("no noise model", False, [0.2, 0.1, -1.4, 0.6], [2, 2, 0, 0, 1, 0]),
        ):
            error, jacobian = np.zeros(200), np.zeros((200, len(theta)))
            cost = prediction_errors(np.array(theta), np.array(sizes), tied, U, y, used, BOUNDS, error, jacobian)
            told[name] = [cost, some(error, 9), jacobian.T @ error, np.einsum("ij,ij->j", jacobian, jacobian)]
    return told


@NUMBERS.case()
def minima() -> dict[str, Any]:
    """Return ends of descents, with deviations."""
    y, sizes = answer(), np.array([2, 2, 1, 2])
    start = np.array([0.25, -0.05, -1.45, 0.66, 0.0, 0.0, 0.0, 0.0])
    cost, theta, gram, ended = descend(start, sizes, U, y, WEIGHT, BOUNDS, 60, 1e-12)
    whole = gram + np.tril(gram, -1).T
    spread = np.sqrt(np.diag(np.linalg.inv(whole)) * cost / (WEIGHT.sum() - 8))
    return {"cost": cost, "ended": ended, "values": [Found(*pair) for pair in zip(theta, spread, strict=True)]}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
