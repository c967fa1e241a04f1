"""Fixed steps compiled to straight-line code equal the plant's own steps, for one run or eight."""

import numpy as np
import pytest

from plant.piezo_stack.hysteresis import slow_stack_step
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.trajectory import stack_row
from plant.solvers.fixed_step_kernel import compile_fixed_step
from plant.solvers.trajectory import compile_trajectory

VOLTAGE = 50.0 * (1.0 - np.cos(np.arange(300) / 20.0))
STARTS = np.linspace(-1e-6, 1e-6, 8)[None]
ROWS = np.array([stack_row(PiezoStackParameters(hysteresis=6e-8 + 1e-9 * lane)) for lane in range(8)])


def runs(lanes: int, some: slice) -> np.ndarray:
    run = compile_fixed_step("slow_stack", slow_stack_step, 1, PiezoStackParameters, lanes)
    states = np.empty((len(VOLTAGE), 1, lanes))
    drives = np.repeat(VOLTAGE[:, None], lanes, 1)
    run(np.ascontiguousarray(STARTS[:, some]), drives, ROWS[some], 0.1, 3, states)
    return states[:, 0]


def test_runs_side_by_side_agree_with_the_plants_step_and_have_the_bits_of_a_run_alone() -> None:
    together = runs(8, slice(0, 8))
    one = compile_trajectory("slow_stack", slow_stack_step, 1, PiezoStackParameters)
    for lane in (0, 5):
        wanted = one(STARTS[:, lane], VOLTAGE, ROWS[lane][None], 0.1, 3)[:, 0]
        assert together[:, lane] == pytest.approx(wanted, rel=1e-12, abs=1e-20)
        np.testing.assert_array_equal(runs(1, slice(lane, lane + 1))[:, 0], together[:, lane])
