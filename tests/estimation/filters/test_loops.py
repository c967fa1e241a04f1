"""Loops are Python: run as they are written they give, to the last bit, what the kernels pasted from them give."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem, Trace
from estimation.filters import imm, imm_loops, iterated_smoother, particle, smoother, smoother_loops, trajectory_loops
from estimation.filters.run import filter_problem
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.estimation.filters.banks import Mode, MultipleModelEstimate, run_imm
from tests.kernels import functions_of, text_of

PRIOR = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-3, 1.0]))


def record(samples: int = 40) -> Record:
    rng = np.random.default_rng(4)
    names = ("position_m", "velocity_m_s")
    seen = {name: np.where(rng.random(samples) < 0.2, np.nan, rng.normal(size=samples)) for name in names}
    return Record(1e-3, {"motor_speed_rad_s": rng.normal(size=samples), **seen})


def task(model: ProcessModel) -> FilterProblem:
    variances = {"position_m": 1e-2, "velocity_m_s": 0.1}
    bounds = (replace(model.states[0], upper=0.12), *model.states[1:])
    problem = filter_problem(replace(model, states=bounds), PRIOR, record(), EhaParameters(), variances=variances)
    return replace(problem, keep_innovations=True)


def assert_same(plain: Trace, compiled: Trace) -> None:
    for field in Trace._fields:
        np.testing.assert_array_equal(getattr(plain, field), getattr(compiled, field), err_msg=field)


def test_the_smoother(linear: ProcessModel, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = task(linear)
    compiled = smoother.smoother(problem)
    given = problem.model, problem.channels, "none"
    compile_it = smoother_loops.compile_smoother.__wrapped__
    kernel = functions_of(text_of(monkeypatch, smoother_loops, lambda: compile_it(*given)))
    monkeypatch.setattr(smoother, "compile_smoother", lambda *_: kernel)
    assert_same(smoother.smoother(problem), compiled)


def test_the_iterated_smoother(linear: ProcessModel, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = replace(task(linear), robust="huber")
    compiled = iterated_smoother.iterated_smoother(problem)
    given = problem.model, problem.channels, "huber"
    compile_it = trajectory_loops.compile_trajectory.__wrapped__
    kernel = functions_of(text_of(monkeypatch, trajectory_loops, lambda: compile_it(*given)))
    monkeypatch.setattr(iterated_smoother, "compile_trajectory", lambda *_: kernel)
    assert_same(iterated_smoother.iterated_smoother(problem), compiled)


def bank(model: ProcessModel) -> MultipleModelEstimate:
    modes = [Mode(name, model, EhaParameters(), noise={"force_n": q}) for name, q in (("calm", 1e-2), ("rough", 1e4))]
    return run_imm(modes, PRIOR, record(), dwell_time=0.01, keep_innovations=True)


def test_the_bank_of_interacting_models(linear: ProcessModel, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled, compile_imm = bank(linear), imm_loops.compile_imm

    def in_python(*what: Any) -> imm_loops.ImmKernel:
        text = text_of(monkeypatch, imm_loops, lambda: compile_imm.__wrapped__(*what))
        return replace(compile_imm(*what), run=functions_of(text).run)

    monkeypatch.setattr(imm, "compile_imm", in_python)
    plain = bank(linear)
    np.testing.assert_array_equal(plain.log_probability, compiled.log_probability)
    assert plain.estimate.log_likelihood == compiled.estimate.log_likelihood
    for name in ("mean", "variance", "residuals", "residual_variances"):
        np.testing.assert_array_equal(getattr(plain.estimate, name), getattr(compiled.estimate, name), err_msg=name)


def test_the_particle_filter(linear: ProcessModel, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = task(linear)
    compiled = particle.particle_filter(problem, 20, np.random.default_rng(1))
    compile_it = particle.compile_particles.__wrapped__
    run = functions_of(text_of(monkeypatch, particle, lambda: compile_it(problem.model, problem.channels))).run
    monkeypatch.setattr(particle, "compile_particles", lambda *_: run)
    plain = particle.particle_filter(problem, 20, np.random.default_rng(1))
    for field in Trace._fields:  # powers and exponentials of Python may round the other way
        np.testing.assert_allclose(getattr(plain, field), getattr(compiled, field), 1e-11, err_msg=field)
