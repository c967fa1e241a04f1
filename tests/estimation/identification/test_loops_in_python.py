"""Loops of identification, run as plain Python, give the same results as their machine code."""

from collections.abc import Callable

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.data import channels_from, scaled
from estimation.identification.free_run.input_nonlinearity import play
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.polynomial_fit import Runs
from estimation.identification.free_run.polynomial_terms import candidate_terms, polynomial_of_linear, with_best_product
from estimation.identification.search.criterion import Structure
from estimation.identification.search.descent import descend
from estimation.identification.search.one_step import prediction_errors
from estimation.identification.search.pole_search import banded_spectra, search_poles
from estimation.identification.state_space.joint import joined_outputs
from estimation.identification.state_space.problem import Problem, Size
from plant.compiled.native.loops import Loop

RNG = np.random.default_rng(7)
U = np.repeat(RNG.choice([-1.0, 1.0], 30), 4)
E = RNG.normal(size=U.size)
WEIGHT = (RNG.random(U.size) > 0.1).astype(float)
BOUNDS = np.array([0, 70, U.size])


def resonance() -> Array:
    y = 0.02 * E
    for t in range(2, U.size):
        y[t] += 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.2 * U[t - 1] - 0.05 * y[t - 1] ** 3
    return y


def output_error() -> list[Array]:
    start = np.array([0.1, 0.1, -1.2, 0.5, 0.0, 0.0, 0.0, 0.0])
    found = descend(start, np.array([2, 2, 1, 2]), U, resonance(), WEIGHT, BOUNDS, 20, 1e-9)
    return [np.array([found[0]]), *found[1:3]]


def one_step_errors() -> list[Array]:
    given = []
    for tied, of_d in ((False, [-0.3]), (True, [])):
        theta = np.array([0.2, 0.1, -1.4, 0.6, 0.2, *of_d, 0.1, 0.0, -0.1, 0.2])
        error, jacobian = np.zeros(U.size), np.zeros((U.size, theta.size))
        sizes = np.array([2, 2, 1, len(of_d), 1, 2])
        prediction_errors(theta, sizes, tied, U, resonance(), WEIGHT > 0.0, BOUNDS, error, jacobian)
        given += [error, jacobian]
    return given


def poles() -> list[Array]:
    y = resonance()
    costs, thetas = search_poles(Structure(1, 2, 1), banded_spectra([(U, y / y.std())]), U.size)
    return [np.asarray(costs)[:1], np.asarray(thetas)[:1]]


def polynomial() -> list[Array]:
    data, _ = scaled(channels_from([U[:, None]], [resonance()], 0.01, ["force"], "deflection"))
    start = polynomial_of_linear(fit_linear(Form(2, (1,), (1,)), data), data)
    assert start is not None
    fit = with_best_product(start, candidate_terms(start.variables), data)
    assert fit is not None
    runs = Runs(fit.variables, fit.terms, data)
    equations = NormalEquations(runs, runs.ends)
    ran = equations.outputs(fit.theta)
    assert ran is not None
    return [fit.theta, ran, equations.start_slopes(), *equations.sums(ran - runs.target)]


def state_space() -> list[Array]:
    data = [scaled(channels_from([U[:, None]], [y], 0.1, ["force"], "y"))[0] for y in (resonance(), np.roll(E, 1))]
    size = Size(2, 1, 2, direct=True)
    problem = Problem(size, joined_outputs(data))
    return list(problem.jacobian(0.3 * np.cos(np.arange(size.n_matrices + size.n))))


def backlash() -> list[Array]:
    out, slopes = np.zeros(U.size), np.zeros((U.size, 2))
    play(np.cumsum(E), 1.5, 0.2, out, slopes)
    return [out, slopes]


@pytest.mark.parametrize("fit", [output_error, one_step_errors, poles, polynomial, state_space, backlash])
def test_machine_code_and_python_agree(fit: Callable[[], list[Array]], monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = [np.array(one) for one in fit()]
    monkeypatch.setattr(Loop, "__call__", lambda loop, *args: loop.__wrapped__(*args))
    for mine, machine in zip(fit(), compiled, strict=True):
        np.testing.assert_allclose(mine, machine, rtol=1e-7, atol=1e-9 * max(1.0, float(np.abs(machine).max())))
