"""The results of every solver for a small damper, kept in `numbers.json`."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from plant.compiled.functions import Scalar, absolute
from plant.errors import HydrostateError
from plant.solvers.adaptive import STRAIGHT, ErrorControl, controlled_groups, controlled_run
from plant.solvers.adaptive_loop import are_equal, drive_along_step, parabolic_piece, step_growth, step_within_piece
from plant.solvers.block_means import block_means
from plant.solvers.fixed_step_kernel import compile_fixed_step
from plant.solvers.steps import parameter_row, rate_driven_step, rk4_step, ros2_step, solve_linear
from plant.solvers.trajectory import compile_trajectory
from tests.edges import edge
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)


@dataclass(frozen=True)
class Damper:
    mass: float = 2.0
    stiffness: float = 50.0
    quadratic: float = 3.0


def rates(state: tuple[Scalar, Scalar], force: Scalar, p: Any) -> tuple[Scalar, Scalar]:
    x, v = state
    return v, (force - p.stiffness * x - p.quadratic * absolute(v) * v) / p.mass


def observed(state: tuple[Scalar, Scalar], p: Any) -> dict[str, Scalar]:
    return {"force": p.stiffness * state[0] + 0.5 * state[1] * state[1]}


DRIVE = np.concatenate(
    [np.zeros(5), np.full(20, 30.0), np.linspace(30.0, -20.0, 15), 0.3 * np.arange(12.0) ** 2 - 20.0]
)
ROWS = np.array([[2.0 + 0.3 * lane, 50.0 - lane, 3.0] for lane in range(11)])
STARTS = np.linspace(0.0, 0.1, 22).reshape(11, 2)
T = 0.02
CONTROL = ErrorControl(
    rates, lambda _: np.array([0.5, 2.0]), lambda _: 30.0, lambda rows: 1e-4 * float(rows[:, 0].min())
)


@NUMBERS.case()
def steps_by_formula() -> dict[str, Any]:
    p = Damper()
    state, forces = (0.2, -1.5), (20.0, 26.0)
    matrix = [[4.0, 1.0, -2.0], [1.0, 5.0, 0.5], [-2.0, 0.3, 6.0]]
    return {
        "RK4": [list(rk4_step(rates)(state, forces, p, h)) for h in (0.02, 0.3)],
        "by rates": list(
            rate_driven_step(
                lambda s, speed, rate, p: (speed - p.quadratic * s[0] + 0.01 * rate, speed * s[1] / p.mass)
            )(state, forces, p, 0.02)
        ),
        "linear": solve_linear(matrix, [1.0, -2.0, 3.0]),
        "row": parameter_row(p),
        "row, changed": or_refused(lambda: parameter_row(p, stiffness=7.0)),  # type: ignore[call-arg]
    }


def or_refused(made: Any) -> Any:
    try:
        return made()
    except (HydrostateError, TypeError) as error:
        return type(error).__name__


@NUMBERS.case()
def runs_of_fixed_steps() -> dict[str, Any]:
    run = compile_trajectory("kept_damper", rk4_step(rates), 2, Damper)
    side = compile_fixed_step("kept_damper", rk4_step(rates), 2, Damper, 8)
    changing = np.repeat(ROWS[:2], 26, axis=0)
    states = np.empty((len(DRIVE), 2, 8))
    drives = np.repeat(DRIVE[:, None], 8, axis=1) * np.linspace(0.5, 1.2, 8)
    side(np.ascontiguousarray(STARTS[:8].T), drives, ROWS[:8], T, 3, states)
    stiff = compile_trajectory("kept_damper_ros2", ros2_step(rates), 2, Damper)
    return {
        "ROS2": [stiff(STARTS[3], DRIVE, ROWS[3:4], T, count)[[0, 1, 6, 30, 51]].T for count in (1, 4)],
        "alone": [run(STARTS[3], DRIVE, ROWS[3:4], T, count)[[0, 1, 6, 30, 51]].T for count in (1, 4)],
        "changing": run(STARTS[3], DRIVE, changing, T, 2)[[1, 25, 26, 27, 51]].T,
        "side by side": states[[0, 1, 30, 51]][:, :, [0, 3, 7]],
    }


@NUMBERS.case()
def runs_of_controlled_steps() -> dict[str, Any]:
    changing = np.repeat(ROWS[None, :3], len(DRIVE), axis=0)
    changing[20:, :, 1] *= 1.5
    told = {
        "alone": controlled_run("kept_damper", CONTROL, STARTS[:1], DRIVE, ROWS[None, :1], T, Damper),
        "eleven": controlled_run("kept_damper", CONTROL, STARTS, DRIVE, ROWS[None], T, Damper),
        "coarse": controlled_run("kept_damper", CONTROL, STARTS[:2], DRIVE, ROWS[None, :2], T, Damper, tolerance=0.05),
        "a drive that bends": controlled_run(
            "kept_damper", CONTROL, STARTS[:2], DRIVE, ROWS[None, :2], T, Damper, drive_tolerance=0.3
        ),
        "short steps": controlled_run(
            "kept_damper", CONTROL, STARTS[:2], DRIVE, ROWS[None, :2], T, Damper, longest=0.004
        ),
        "changing": controlled_run("kept_damper", CONTROL, STARTS[:3], DRIVE, changing, T, Damper),
    }
    groups = [one.shape[2] for one in controlled_groups("kept_damper", CONTROL, STARTS, DRIVE, ROWS[None], T, Damper)]
    return {name: found[[0, -1]][:, [0, 1, 6, 30, 41, 51]] for name, found in told.items()} | {"groups": groups}


@NUMBERS.case()
def pieces_and_steps() -> dict[str, Any]:
    rows = np.zeros((1, 1, 1))

    def piece(drive: np.ndarray, begin: int = 0, bend: float = 1e-3) -> tuple[int, float, float, float]:
        return parabolic_piece(drive, rows, begin, bend, STRAIGHT)

    curve = 0.2 * np.arange(14.0) ** 2 + 1e-3 * np.sin(np.arange(14.0))
    cubic = 0.01 * np.arange(14.0) ** 3
    changing = np.repeat(np.arange(2.0), 7)[:, None, None]
    return {
        "smooth": [
            list(piece(drive, begin, bend))
            for drive in (curve, cubic, DRIVE)
            for begin, bend in ((0, 1e-2), (3, 1e-3), (5, 0.5))
        ],
        "a corner from": edge(
            lambda one: piece(np.where(np.arange(9) < 5, 0.0, one * (np.arange(9.0) - 4.0)))[0], 1e-6, 1.0
        ),
        "a straight bend from": edge(lambda one: piece(one * np.arange(9.0) ** 2)[0], 1e-6, 1.0),
        "changing": [list(parabolic_piece(curve, changing, begin, 1.0, STRAIGHT)) for begin in (0, 7)],
        "the last": list(piece(curve, 12, 1.0)),
        "same": [are_equal(np.ones((2, 2)), np.array([[1.0, 1.0], [1.0, one]])) for one in (1.0, 1.0 + 1e-15)],
        "within": [
            step_within_piece(*one)
            for one in (
                (3.0, 3.0, 20.0, 0.1),
                (2.9999971, 3.0, 20.0, 0.1),
                (2.99999, 3.0, 20.0, 0.1),
                (1.6, 3.0, 20.0, 0.1),
                (1.4, 3.0, 20.0, 0.1),
                (50.0, 99.0, 20.0, 0.1),
                (3.0, 0.0, 20.0, 0.1),
            )
        ],
        "along": [
            list(drive_along_step(1.0, 0.5, 0.2, place, 6.0, size))
            for place, size in ((0.0, 1.0), (2.5, 0.7), (5.0, 1.0))
        ],
        "growth": [step_growth(error) for error in (0.0, 1e-3, 0.02, 0.1, 0.3, 0.8)],
        "growth turns at": [
            edge(step_growth, low, high)
            for low, high in ((1e-5, 5e-3), (5e-3, 0.02), (0.02, 0.1), (0.1, 0.3), (0.3, 0.9))
        ],
    }


@NUMBERS.case()
def means_over_blocks() -> dict[str, Any]:
    states = np.random.default_rng(1).standard_normal((23, 2, 9))
    rows = np.repeat(ROWS[None, :9], 23, axis=0) * np.linspace(1.0, 2.0, 23)[:, None, None]
    return {
        "one row": block_means(observed, "force", states, ROWS[None, :9], 5, Damper)[:, [0, 3, 8]],
        "a row a sample": block_means(observed, "force", states, rows, 4, Damper)[:, [0, 7, 8]],
        "one run": block_means(observed, "force", states[:, :, :1], ROWS[None, :1], 23, Damper),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
