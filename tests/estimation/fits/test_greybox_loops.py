"""The misfit's kernel is Python: its text, run as it stands, gives what the machine code gives, to the last bit."""

import ctypes
from typing import Any

import numpy as np
import pytest

from estimation.fits import greybox_loops
from estimation.fits.greybox_loops import compile_kernel
from estimation.models.flow import FLOW_FORM, MASS_FLOW_FORM
from estimation.models.greybox import GreyBoxModel
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_row
from tests.kernels import functions_of, text_of


def _numbers(address: int, count: int) -> "ctypes.Array[ctypes.c_double]":
    return (ctypes.c_double * count).from_address(address)


@pytest.mark.parametrize("model", [FLOW_FORM, MASS_FLOW_FORM], ids=lambda model: model.name)
def test_the_same_bits_as_python(model: GreyBoxModel, monkeypatch: pytest.MonkeyPatch) -> None:
    text = text_of(monkeypatch, greybox_loops, lambda: compile_kernel.__wrapped__(model))
    rng, samples, block = np.random.default_rng(3), 60, 4
    drives = np.stack([120.0 * np.sign(np.sin(0.3 * np.arange(samples))), 0.01 * np.sin(0.1 * np.arange(samples))], 1)
    measured = 1e6 * rng.normal(size=(samples, 1))
    measured[rng.random(samples) < 0.2] = np.nan
    theta = np.array([*np.log([2e8, 1e-12, 1e-6, 1e-9, 1e4, 1e-13]), 0.3, *[2.0] * (len(model.unknowns) - 7)])
    gaps = np.array([[10.0, 14.0, 1e9], [30.0, 31.0, 1e8]])
    given = (theta, drives, measured, parameter_row(EhaParameters()), 1e-3, rng.integers(1, 3, samples), block)
    given = (*given, np.array([2.5e7]), np.array([1e3]), gaps, 3.0)
    blocks = -(-samples // block)
    found, wanted = ((np.zeros((1, blocks)), np.zeros((1, blocks, theta.size))) for _ in range(2))
    sums = compile_kernel(model)(*given, *found)
    file: Any = functions_of(text)
    file.load = lambda address: tuple(_numbers(address, file.WIDTH * (1 + file.UNKNOWNS + file.JUMPS)))
    file.store = lambda point, address: _numbers(address, len(point)).__setitem__(slice(None), point)
    with np.errstate(all="ignore"):
        expected = greybox_loops.run(file, *given, *wanted)
    for one, other in zip((*sums, *found), (*expected, *wanted), strict=True):
        np.testing.assert_array_equal(one, other)
    assert np.isfinite(sums[0])
