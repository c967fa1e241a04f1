"""The compiled run gives the same results as its functions in plain Python."""

import numpy as np
import pytest

from experiments.open_benchmark.friction import SLIPS
from experiments.open_benchmark.machine import Machine
from experiments.open_benchmark.run import at_rest, compiled, trajectory


@pytest.mark.parametrize("loop_gain", [0.0, 30.0])
def test_the_compiled_simulation_gives_the_result_of_the_python_one(loop_gain: float) -> None:
    machine = Machine()._replace(loop_gain=loop_gain)
    course = np.ones((12, 5))
    course[:, 3] = 0.01
    course[:, 0] = np.where(np.arange(12) < 6, 100.0, -100.0)
    runs = []
    for way in (trajectory, compiled()):
        y, stretch, out = at_rest(machine), np.zeros(len(SLIPS)), np.empty((120, 7))
        way(machine, course, y, stretch, 5, out)
        runs.append((out, y, stretch))
    for python, native in zip(*runs, strict=True):
        np.testing.assert_allclose(native, python, rtol=1e-9, atol=1e-12 * np.max(np.abs(python)))
    assert np.ptp(runs[0][0][:, 3]) > 0.0
