"""Loops run as plain Python give bitwise the same results as the kernels that are pasted from them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem, Trace
from estimation.filters import imm, imm_loops, iterated_smoother, particle, smoother, smoother_loops, trajectory_loops
from estimation.filters.ekf import EKF
from estimation.filters.run import filter_problem
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.kernels import functions_of, text_of

PRIOR = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-3, 1.0]))


def record(samples: int = 40) -> Record:
    rng = np.random.default_rng(4)
    names = ("position_m", "velocity_m_s")
    seen = {name: np.where(rng.random(samples) < 0.2, np.nan, rng.normal(size=samples)) for name in names}
    return Record(1e-3, {"motor_speed_rad_s": rng.normal(size=samples), **seen})


EVERY = pytest.mark.parametrize(("every", "kept"), [(1, True), (3, False)])


def task(model: ProcessModel, every: int, *, kept: bool) -> FilterProblem:
    variances = {"position_m": 1e-2, "velocity_m_s": 0.1}
    bounds = (replace(model.states[0], upper=0.12), *model.states[1:])
    problem = filter_problem(replace(model, states=bounds), PRIOR, record(), EhaParameters(), variances=variances)
    return replace(problem, every=every, keep_innovations=kept)


def assert_same(plain: Trace, compiled: Trace) -> None:
    for field in Trace._fields:
        np.testing.assert_array_equal(getattr(plain, field), getattr(compiled, field), err_msg=field)


@EVERY
def test_the_smoother_is_the_same_compiled_and_in_python(
    linear: ProcessModel, monkeypatch: pytest.MonkeyPatch, every: int, kept: bool
) -> None:
    problem = task(linear, every, kept=kept)
    compiled = smoother.smoother(problem)
    given = problem.model, problem.channels, "none"
    compile_it = smoother_loops.compile_smoother.__wrapped__
    kernel = functions_of(text_of(monkeypatch, smoother_loops, lambda: compile_it(*given)))
    monkeypatch.setattr(smoother, "compile_smoother", lambda *_: kernel)
    assert_same(smoother.smoother(problem), compiled)


@EVERY
def test_the_iterated_smoother_is_the_same_compiled_and_in_python(
    linear: ProcessModel, monkeypatch: pytest.MonkeyPatch, every: int, kept: bool
) -> None:
    problem = replace(task(linear, every, kept=kept), robust="huber")
    compiled = iterated_smoother.iterated_smoother(problem)
    given = problem.model, problem.channels, "huber"
    compile_it = trajectory_loops.compile_trajectory.__wrapped__
    kernel = functions_of(text_of(monkeypatch, trajectory_loops, lambda: compile_it(*given)))
    monkeypatch.setattr(iterated_smoother, "compile_trajectory", lambda *_: kernel)
    assert_same(iterated_smoother.iterated_smoother(problem), compiled)


@pytest.mark.parametrize("mean", [0.13, np.nan])
def test_a_trajectory_that_begins_out_of_bounds_gives_nan(
    linear: ProcessModel, monkeypatch: pytest.MonkeyPatch, mean: float
) -> None:
    problem = task(linear, 1, kept=True)
    problem = replace(problem, mean=np.array([mean / 0.1, 1.0, 1.0]) * problem.mean)
    compiled = iterated_smoother.iterated_smoother(problem)
    compile_it = trajectory_loops.compile_trajectory.__wrapped__
    text = text_of(monkeypatch, trajectory_loops, lambda: compile_it(problem.model, problem.channels, "none"))
    monkeypatch.setattr(iterated_smoother, "compile_trajectory", lambda *_: functions_of(text))
    for trace in (compiled, iterated_smoother.iterated_smoother(problem)):
        assert np.isnan(trace.log_likelihood)
        for part in (trace.mean, trace.covariance, trace.track, trace.residuals, trace.residual_variances):
            assert np.isnan(part).all()


def bank(model: ProcessModel, every: int, *, kept: bool) -> tuple[Trace, np.ndarray]:
    variances = {"position_m": 1e-2, "velocity_m_s": 0.1}
    problems = [
        filter_problem(model, PRIOR, record(), EhaParameters(), variances=variances, noise={"force_n": q})
        for q in (1e-2, 1e4)
    ]
    modes = [(EKF, replace(one, every=every, keep_innovations=kept)) for one in problems]
    return imm.interacting(modes, imm.log_transitions([0.01, 0.01], 1e-3), np.log([0.5, 0.5]))


@EVERY
def test_the_bank_of_interacting_models_is_the_same_compiled_and_in_python(
    linear: ProcessModel, monkeypatch: pytest.MonkeyPatch, every: int, kept: bool
) -> None:
    (compiled, history), compile_imm = bank(linear, every, kept=kept), imm_loops.compile_imm

    def in_python(*what: Any) -> imm_loops.ImmKernel:
        text = text_of(monkeypatch, imm_loops, lambda: compile_imm.__wrapped__(*what))
        return replace(compile_imm(*what), run=functions_of(text).run)

    monkeypatch.setattr(imm, "compile_imm", in_python)
    plain, plain_history = bank(linear, every, kept=kept)
    np.testing.assert_array_equal(plain_history, history)
    assert_same(plain, compiled)
    assert len(plain.track) == len(range(0, 40, every))


@EVERY
def test_the_particle_filter_is_the_same_compiled_and_in_python(
    linear: ProcessModel, monkeypatch: pytest.MonkeyPatch, every: int, kept: bool
) -> None:
    problem = task(linear, every, kept=kept)
    problem = replace(problem, noise=problem.noise * [1.0, 0.0, 1.0])  # a state without process noise
    compiled = particle.particle_filter(problem, 20, np.random.default_rng(1))
    compile_it = particle.compile_particles.__wrapped__
    run = functions_of(text_of(monkeypatch, particle, lambda: compile_it(problem.model, problem.channels))).run
    monkeypatch.setattr(particle, "compile_particles", lambda *_: run)
    plain = particle.particle_filter(problem, 20, np.random.default_rng(1))
    for field in Trace._fields:  # powers and exponentials of Python may round differently
        np.testing.assert_allclose(getattr(plain, field), getattr(compiled, field), 1e-11, err_msg=field)
