"""The loop over filters side by side, run as plain Python, gives bitwise the same result as its kernel."""

import ctypes
import math
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


@pytest.mark.parametrize("kept", [True, False])
def test_one_filter_gives_the_same_result_compiled_and_in_python(
    linear: ProcessModel, monkeypatch: pytest.MonkeyPatch, kept: bool
) -> None:
    rng = np.random.default_rng(4)
    names = ("position_m", "velocity_m_s")
    seen = {name: np.where(rng.random(20) < 0.2, np.nan, rng.normal(size=20)) for name in names}
    record = Record(1e-3, {"motor_speed_rad_s": rng.normal(size=20), **seen})
    # so large that the product of innovation variances is moved into the logarithm
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e65, 1e-3, 1.0]))
    variances = {"position_m": 1e-2, "velocity_m_s": 0.1}
    problem = filter_problem(linear, prior, record, EhaParameters(), variances=variances)
    problem = replace(problem, keep_innovations=kept, every=3)
    compiled = ekf(problem)

    def in_python(*what: Any) -> SimpleNamespace:
        file = functions_of(text_of(monkeypatch, kernels, lambda: compile_kernel.__wrapped__(*what)))
        halves = {"prepare_at": [file.prepare], "predict_at": [file.predict], "update_at": [file.update]}
        halves["both_at"] = [file.onward, file.whole]
        plain = SimpleNamespace(**{**vars(file), **{name: on_memory(file, *lines) for name, lines in halves.items()}})
        plain.move = lambda source, target: ctypes.memmove(target, source, 8)
        sample = ctypes.c_double * len(names)
        plain.complete_at = lambda address: not any(math.isnan(one) for one in sample.from_address(address))
        plain.steps = lambda *arguments: lanes.steps(plain, *arguments)
        return plain

    monkeypatch.setattr(runner, "compile_kernel", in_python)
    plain = ekf(problem)
    for field in compiled._fields:
        np.testing.assert_array_equal(getattr(plain, field), getattr(compiled, field), err_msg=field)


def test_samples_of_separate_logs_are_laid_side_by_side() -> None:
    count, width, begin = 16, 2, 3
    logs = np.random.default_rng(6).normal(size=(count, 20, width))
    places = logs.ctypes.data + logs.strides[0] * np.arange(count)

    def transpose(at: int, offset: int, ahead: int, target: int, stride: int) -> None:  # noqa: ARG001
        for lane in range(lanes.ROWS):
            source = ctypes.c_int64.from_address(at + 8 * lane).value + offset
            for row in range(lanes.ROWS):
                ctypes.memmove(target + row * stride + 8 * lane, source + 8 * row, 8)

    rows = np.zeros((lanes.ROWS * width, count))
    kernel: Any = SimpleNamespace(LINE=8 * count, transpose=transpose)
    lanes.lay_side_by_side(kernel, places, begin, width, rows.ctypes.data)
    np.testing.assert_array_equal(rows.T, logs[:, begin : begin + lanes.ROWS].reshape(count, -1))


@pytest.mark.parametrize("samples", [lanes.ROWS, 2 * lanes.ROWS, 2 * lanes.ROWS + 4])
def test_every_sample_of_separate_logs_is_filtered_once(samples: int, monkeypatch: pytest.MonkeyPatch) -> None:
    filtered, laid = list[int](), list[int]()

    def steps(_: Any, work: Any, drive: int, sample: int, at: int, new: int, end: int, *rest: Any) -> None:  # noqa: ARG001
        assert laid[-2:] == [at, at]
        filtered.extend(range(at + new, at + end))

    monkeypatch.setattr(lanes, "steps", steps)
    monkeypatch.setattr(lanes, "lay_side_by_side", lambda _, places, begin, *rest: laid.append(begin))  # noqa: ARG005
    kernel: Any = SimpleNamespace(LINE=64, DRIVES=1, CHANNELS=2)
    nothing: Any = None
    lanes.run(kernel, np.zeros(1), nothing, nothing, np.zeros(1), samples, 1, 1, nothing)
    assert filtered == list(range(samples))
    assert max(laid) + lanes.ROWS == samples


def test_steps_over_no_samples_leave_the_working_memory_unchanged() -> None:
    kernel: Any = SimpleNamespace(LINE=8, WIDTH=1, DRIVES=1, LANES=1, CHANNELS=1, COUNT=2)
    work, nothing = np.arange(4.0), np.empty((0, 1))
    lanes.steps(kernel, work, 0, 0, 0, 0, 0, 1, 1, (nothing, nothing, nothing, nothing, nothing))
    assert work.tolist() == [0.0, 1.0, 2.0, 3.0]


def test_a_large_product_of_variances_goes_into_the_logarithm_of_its_own_lane_and_channel() -> None:
    kernel: Any = SimpleNamespace(LANES=3, CHANNELS=2, PRODUCT=4)
    work, logs = np.ones(4 + 3 * 2 + 1), np.zeros((2, 3))
    large = {(0, 1): 2.0 * lanes.LARGE, (1, 2): 3.0 * lanes.LARGE}
    for (channel, lane), product in large.items():
        work[4 + 3 * channel + lane] = product
    work[4 + 3 * 1 + 0] = 0.5 * lanes.LARGE
    lanes.flush(kernel, work, logs)
    wanted = np.zeros((2, 3))
    for place, product in large.items():
        wanted[place] = np.log(product)
    assert logs == pytest.approx(wanted)
    assert work.tolist() == [1.0] * 7 + [0.5 * lanes.LARGE] + [1.0] * 3


@pytest.mark.parametrize("large", [(True, False), (True, True)])
def test_large_products_go_into_the_logarithms_whether_one_or_all_are_large(large: tuple[bool, bool]) -> None:
    kernel: Any = SimpleNamespace(PRODUCT=1, LANES=2, CHANNELS=1)
    products = [2.0 * lanes.LARGE if one else 3.0 for one in large]
    work, logs = np.array([7.0, *products, 8.0]), np.full((1, 2), 0.5)
    lanes.flush(kernel, work, logs)
    assert work.tolist() == [7.0, *(1.0 if one else 3.0 for one in large), 8.0]
    assert logs[0] == pytest.approx([0.5 + (math.log(2.0 * lanes.LARGE) if one else 0.0) for one in large])


def test_the_score_is_the_log_density_of_the_innovations(linear: ProcessModel) -> None:
    rng = np.random.default_rng(4)
    names = ("position_m", "velocity_m_s")
    seen = {name: np.where(rng.random(20) < 0.2, np.nan, rng.normal(size=20)) for name in names}
    record = Record(1e-3, {"motor_speed_rad_s": rng.normal(size=20), **seen})
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1.0, 1e-3, 1.0]))
    problem = filter_problem(
        linear, prior, record, EhaParameters(), variances={"position_m": 1e-2, "velocity_m_s": 0.1}
    )
    found = ekf(replace(problem, keep_innovations=True))
    density = -0.5 * (found.residuals**2 / found.residual_variances + np.log(2.0 * np.pi * found.residual_variances))
    assert np.count_nonzero(np.isnan(density)) == np.count_nonzero(np.isnan([*seen.values()]))
    assert found.log_likelihood == pytest.approx(float(np.nansum(density)))


def test_sub_steps_between_samples_equal_the_steps_of_a_faster_log_with_missing_samples(linear: ProcessModel) -> None:
    rng = np.random.default_rng(7)
    model = replace(linear, longest_step=5e-4)
    speed, seen = rng.normal(size=12), rng.normal(size=12)
    slow = Record(1e-3, {"motor_speed_rad_s": speed, "position_m": seen})
    halved, between = np.full(23, np.nan), np.empty(23)
    halved[::2] = seen
    between[::2], between[1::2] = speed, 0.5 * (speed[1:] + speed[:-1])
    fast = Record(5e-4, {"motor_speed_rad_s": between, "position_m": halved})
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1.0, 1e-3, 1.0]))
    found, wanted = (
        ekf(filter_problem(model, prior, one, EhaParameters(), variances={"position_m": 1e-2})) for one in (slow, fast)
    )
    assert found.mean == pytest.approx(wanted.mean, rel=1e-9)
    assert found.covariance == pytest.approx(wanted.covariance, rel=1e-9)
    assert found.log_likelihood == pytest.approx(wanted.log_likelihood)
