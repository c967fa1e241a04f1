"""The misfit's kernel, run as plain Python, gives the same result as its machine code to the last bit."""

import ctypes
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox import kernel as greybox_kernel
from estimation.fits.greybox import loops as greybox_loops
from estimation.fits.greybox.kernel import compile_kernel
from estimation.models.flow import FLOW_FORM, MASS_FLOW_FORM
from estimation.models.flow_parameters import flow_parameters
from estimation.models.greybox import GreyBoxModel
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_row
from tests.kernels import functions_of, text_of


def _numbers(address: int, count: int) -> "ctypes.Array[ctypes.c_double]":
    return (ctypes.c_double * count).from_address(address)


@pytest.mark.parametrize("asked", [True, False], ids=["all", "sums"])
@pytest.mark.parametrize(
    "model",
    [
        pytest.param(FLOW_FORM, id="flow"),
        pytest.param(replace(FLOW_FORM, jump=(), stiff=True), id="flow in implicit steps"),
        pytest.param(replace(MASS_FLOW_FORM, jump=()), id="mass flow without gaps"),
        pytest.param(MASS_FLOW_FORM, id="mass flow", marks=pytest.mark.slow),
    ],
)
def test_the_compiled_kernel_gives_the_same_bits_as_python(
    model: GreyBoxModel, asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = text_of(monkeypatch, greybox_kernel, lambda: compile_kernel.__wrapped__(model))
    rng, samples, block = np.random.default_rng(3), 60, 4
    drives = np.stack([120.0 * np.sign(np.sin(0.3 * np.arange(samples))), 0.01 * np.sin(0.1 * np.arange(samples))], 1)
    measured = 1e6 * rng.normal(size=(samples, 1))
    measured[rng.random(samples) < 0.2] = measured[20:24] = np.nan  # including a whole block
    theta = np.array([*np.log([2e8, 1e-12, 1e-6, 1e-9, 1e4, 1e-13]), 0.3, *[2.0] * (len(model.unknowns) - 7)])
    gaps = np.array([[10.0, 14.0, 1e9], [30.0, 31.0, 1e8]])
    given = (
        theta,
        drives,
        measured,
        parameter_row(flow_parameters(EhaParameters())),
        1e-3,
        rng.integers(1, 3, samples),
        block,
    )
    given = (*given, np.array([2.5e7]), np.array([[1e3, 0.0, 2e3]]), np.array([[0.0, 5e7]]), 0.9, gaps, 3.0)
    blocks = -(-samples // block)
    shapes = ((1, blocks), (1, blocks, theta.size)) if asked else ((0, 0), (0, 0, theta.size))
    found, wanted = (tuple(np.zeros(shape) for shape in shapes) for _ in range(2))
    sums = compile_kernel(model)(*given, *found)
    file: Any = functions_of(text)
    file.load = lambda address: tuple(_numbers(address, file.WIDTH * (1 + file.UNKNOWNS + file.JUMPS)))
    file.store = lambda point, address: _numbers(address, len(point)).__setitem__(slice(None), point)
    with np.errstate(all="ignore"):
        expected = greybox_loops.run(file, *given, *wanted)
    for one, other in zip((*sums, *found), (*expected, *wanted), strict=True):
        np.testing.assert_array_equal(one, other)
    assert np.isfinite(sums[0])


KERNEL: Any = SimpleNamespace(JUMPS=2, UNKNOWNS=3)


def test_the_covariance_in_a_gap_is_carried_through_a_step_by_its_jacobian() -> None:
    rng = np.random.default_rng(1)
    point = rng.standard_normal((4, 6))
    root = rng.standard_normal((2, 2))
    covariance, F = root @ root.T, point[:2, 4:]
    wanted = F @ covariance @ F.T
    greybox_loops.carry(KERNEL, point, covariance, np.empty((2, 2)))
    assert covariance == pytest.approx(wanted)


def test_the_first_sample_after_a_gap_applies_the_kalman_update() -> None:
    rng = np.random.default_rng(2)
    point, shown = rng.standard_normal((4, 6)), rng.standard_normal(6)
    root = rng.standard_normal((2, 2))
    covariance, before, excess, variance = root @ root.T, point.copy(), 0.7, 0.2
    H = shown[4:]
    opened, gain = H @ covariance @ H, covariance @ H / (H @ covariance @ H + variance)
    left = (np.eye(2) - np.outer(gain, H)) @ covariance
    found = greybox_loops.correct(KERNEL, point, covariance, np.empty(2), shown, excess, variance)
    assert found == pytest.approx(opened)
    assert covariance == pytest.approx(left)
    assert point[:2, 0] == pytest.approx(before[:2, 0] - gain * excess)
    assert point[:2, 1:4] == pytest.approx(before[:2, 1:4] - np.outer(gain, shown[1:4]))
    np.testing.assert_array_equal(point[2:], before[2:])
    np.testing.assert_array_equal(point[:, 4:], before[:, 4:])


@pytest.mark.parametrize("size", [2.0, -2.0, 9.0, -9.0])
def test_a_block_counts_quadratically_up_to_the_outlier_limit_and_linearly_beyond(size: float) -> None:
    row, level = np.array([size, 0.5, -1.0]), np.array([0.4, 0.1, 0.2])
    gain, scale, outlier = 0.25, 0.8, 3.0
    error, *slopes = scale * (row - level)
    moved, gradient, gram = level + gain * (row - level), np.zeros(2), np.zeros((2, 2))
    cost = greybox_loops.absorb(row, level, gain, scale, outlier, gradient, gram)
    far = abs(error) > outlier
    assert cost == pytest.approx(outlier * (abs(error) - 0.5 * outlier) if far else 0.5 * error**2)
    assert gradient == pytest.approx(np.array(slopes) * np.clip(error, -outlier, outlier))
    assert gram == pytest.approx(np.tril(np.outer(slopes, slopes)) * (greybox_loops.STRAIGHT if far else 1.0))
    assert level == pytest.approx(moved)


def test_a_runaway_residual_counts_as_a_fixed_large_value() -> None:
    for value in (np.nan, 1e300):
        row, level, gradient, gram = np.array([value, 1.0]), np.zeros(2), np.zeros(1), np.zeros((1, 1))
        with np.errstate(all="ignore"):
            greybox_loops.absorb(row, level, 0.0, 1.0, 3.0, gradient, gram)
        assert row[0] == greybox_loops.RUNAWAY
        assert gradient[0] == pytest.approx(3.0)
