"""The loop of filters side by side is Python: run as it is written, it gives what its kernel gives, to the last bit."""

import ctypes
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.engine import kernels, lanes, runner
from estimation.engine.kernels import compile_kernel
from estimation.filters.ekf import ekf
from estimation.filters.run import filter_problem
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.kernels import functions_of, on_memory, text_of


def test_one_filter(linear: ProcessModel, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    names = ("position_m", "velocity_m_s")
    seen = {name: np.where(rng.random(20) < 0.2, np.nan, rng.normal(size=20)) for name in names}
    record = Record(1e-3, {"motor_speed_rad_s": rng.normal(size=20), **seen})
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e65, 1e-3, 1.0]))  # a product that goes into the logarithm
    variances = {"position_m": 1e-2, "velocity_m_s": 0.1}
    problem = filter_problem(linear, prior, record, EhaParameters(), variances=variances)
    problem = replace(problem, keep_innovations=True, every=3)
    compiled = ekf(problem)

    def in_python(*what: Any) -> SimpleNamespace:
        file = functions_of(text_of(monkeypatch, kernels, lambda: compile_kernel.__wrapped__(*what)))
        halves = {"prepare_at": [file.prepare], "predict_at": [file.predict], "update_at": [file.update]}
        halves["both_at"] = [file.predict, file.update]
        plain = SimpleNamespace(**{**vars(file), **{name: on_memory(file, *lines) for name, lines in halves.items()}})
        plain.move = lambda source, target: ctypes.memmove(target, source, 8)
        plain.steps = lambda *arguments: lanes.steps(plain, *arguments)
        return plain

    monkeypatch.setattr(runner, "compile_kernel", in_python)
    plain = ekf(problem)
    for field in compiled._fields:
        np.testing.assert_array_equal(getattr(plain, field), getattr(compiled, field), err_msg=field)
