"""The loops from which kernels are made give the same results in plain Python."""

import ctypes
import inspect
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from plant.compiled.functions import Scalar, absolute
from plant.solvers import adaptive_kernel, fixed_step_kernel, trajectory
from plant.solvers.adaptive import MEANS, SAMPLES, STRAIGHT
from plant.solvers.adaptive_kernel import compile_adaptive
from plant.solvers.adaptive_loop import run_controlled, step_growth, step_within_piece
from plant.solvers.drive_pieces import parabolic_piece
from plant.solvers.fixed_step_kernel import compile_fixed_step
from plant.solvers.fixed_step_loops import run_alone, run_side_by_side
from plant.solvers.steps import rk4_step
from plant.solvers.trajectory import compile_trajectory
from tests.kernels import functions_of, in_python, on_memory, text_of


@dataclass(frozen=True)
class Damper:
    mass: float = 2.0
    stiffness: float = 50.0
    quadratic: float = 3.0


def rates(state: tuple[Scalar, Scalar], force: Scalar, p: Any) -> tuple[Scalar, Scalar]:
    x, v = state
    return v, (force - p.stiffness * x - p.quadratic * absolute(v) * v) / p.mass


DRIVE = np.concatenate([np.zeros(5), np.full(20, 30.0), np.linspace(30.0, -20.0, 15)])
ROWS = np.array([[2.0 + 0.1 * lane, 50.0, 3.0] for lane in range(8)])
STARTS = np.linspace(0.0, 0.1, 16).reshape(2, 8)
T = 0.02


def kernel_in_python(file: SimpleNamespace, *names: str, **others: Any) -> Any:
    sizes = {name: getattr(file, name) for name in ("LANES", "WIDTH", "COLUMNS", "NUMBERS") if hasattr(file, name)}
    operations = {f"{name}_at": on_memory(file, getattr(file, name)) for name in names}
    return SimpleNamespace(**sizes, **operations, VECTOR=1, **others)


@pytest.mark.parametrize("rows", [1, 40], ids=["constant", "changing"])
def test_one_run_is_the_same_compiled_and_in_python(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    given: Any = "damper", rk4_step(rates), 2, Damper
    run, width = compile_trajectory(*given), 2
    file = functions_of(text_of(monkeypatch, trajectory, lambda: compile_trajectory.__wrapped__(*given)))
    step = in_python(file.step)

    def advance(numbers: tuple[float, ...], address: int) -> tuple[float, ...]:
        given = dict(zip(("x0", "x1", "u_start", "u_end"), numbers, strict=True))
        memory = (ctypes.c_double * file.NUMBERS).from_address(address)
        names = inspect.signature(file.step).parameters
        return tuple(step(*(given[n] if n in given else memory[file.SLOTS[n]] for n in names)).values())

    def store(state: tuple[float, ...], address: int) -> None:
        (ctypes.c_double * width).from_address(address)[:] = state

    plain = kernel_in_python(
        file,
        "settle",
        load=lambda address: tuple((ctypes.c_double * width).from_address(address)),
        store=store,
        advance=advance,
    )
    parameters = np.repeat(ROWS[:1], rows, 0)
    parameters[rows // 2 :, 1] = 60.0
    given = STARTS[:, 1], DRIVE, parameters, T, 3
    np.testing.assert_array_equal(run_alone(plain, *given), run(*given))


def test_runs_side_by_side_are_the_same_compiled_and_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    given: Any = "damper", rk4_step(rates), 2, Damper, 8
    run = compile_fixed_step(*given)
    text = text_of(monkeypatch, fixed_step_kernel, lambda: compile_fixed_step.__wrapped__(*given))
    plain = kernel_in_python(functions_of(text), "settle", "step")
    drives = np.ascontiguousarray(np.outer(DRIVE, np.linspace(0.5, 1.5, 8)))
    found, wanted = np.empty((len(DRIVE), 2, 5)), np.empty((len(DRIVE), 2, 5))
    run_side_by_side(plain, STARTS, drives, ROWS, T, 3, found)
    run(STARTS, drives, ROWS, T, 3, wanted)
    np.testing.assert_allclose(found, wanted, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize(
    ("lanes", "kept", "rows", "bulge"),
    [(1, 1, 1, STRAIGHT), (8, 8, 1, SAMPLES), (8, 3, 40, STRAIGHT), (8, 3, 40, MEANS)],
)
def test_steps_of_controlled_error_are_the_same_compiled_and_in_python(
    lanes: int, kept: int, rows: int, bulge: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    model: Any = "damper", rates, 2, Damper, lanes
    run = compile_adaptive(*model)
    text = text_of(monkeypatch, adaptive_kernel, lambda: compile_adaptive.__wrapped__(*model))

    def move(source: int, target: int) -> None:
        ctypes.memmove(target, source, 8 * lanes)

    plain = kernel_in_python(functions_of(text), "settle", "stages", "between", move=move)
    parameters = np.repeat(ROWS[None, :lanes], rows, 0)
    parameters[rows // 2 :, :, 1] = 60.0
    starts = np.ascontiguousarray(STARTS[:, :lanes])
    given = starts, DRIVE, parameters, T, np.array([1e3, 1e2]), 1e-3, bulge, 20.0, 1e-3
    found, wanted = np.empty((len(DRIVE), 2, kept)), np.empty((len(DRIVE), 2, kept))
    run_controlled(plain, *given, found)
    run(*given, wanted)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12)


def test_samples_before_a_change_of_parameters_do_not_depend_on_it() -> None:
    run = compile_adaptive("damper", rates, 2, Damper, 8)
    drive = np.zeros(60)
    control = T, np.array([3e2, 3e1]), 1e-3, STRAIGHT, 20.0, 1e-3
    changing = np.repeat(ROWS[None], 60, 0)
    changing[37:, :, 1] = 500.0
    found, alone = np.empty((60, 2, 8)), np.empty((38, 2, 8))
    run(STARTS, drive, changing, *control, found)
    run(STARTS, drive[:38], ROWS[None], *control, alone)
    np.testing.assert_allclose(found[:38], alone, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("steps", [8, 41, 240, 480])
def test_a_run_at_its_shortest_step_ends_if_the_steps_fill_a_sample_up_to_rounding(steps: int) -> None:
    asked = 0

    def stages(address: int, _: float) -> None:
        nonlocal asked
        asked += 1
        assert asked < 10 * steps, "the same step is asked for again and again"
        ctypes.c_double.from_address(address + 8 * 7).value = 2.0  # an error that no step size reduces

    kernel: Any = SimpleNamespace(LANES=1, WIDTH=1, COLUMNS=1, NUMBERS=14, VECTOR=1, move=lambda *_: None)
    kernel.settle_at, kernel.between_at, kernel.stages_at = (lambda *_: None), (lambda *_: None), stages
    drive, rows, found = np.array([0.0, 1.0, 0.0]), np.ones((1, 1, 1)), np.empty((3, 1, 1))
    run_controlled(kernel, np.zeros((1, 1)), drive, rows, T, np.ones(1), 1e-3, STRAIGHT, 20.0, 1.0 / steps, found)
    assert asked > 2 * steps


@pytest.mark.parametrize("lost", [(0,), (3,), (7,), (2, 5), tuple(range(8))])
def test_a_run_that_turns_nan_ends_and_does_not_affect_runs_beside_it(lost: tuple[int, ...]) -> None:
    run = compile_adaptive("damper", rates, 2, Damper, 8)
    # the shortest step is so short that a run that stays at it never ends
    control = T, np.array([1e3, 1e2]), 1e-3, STRAIGHT, 20.0, 1e-9
    wanted, found = np.empty((len(DRIVE), 2, 8)), np.empty((len(DRIVE), 2, 8))
    run(STARTS, DRIVE, ROWS[None], *control, wanted)
    parameters = ROWS[None].copy()
    parameters[:, list(lost), 1] = np.nan
    run(STARTS, DRIVE, parameters, *control, found)
    others = [lane for lane in range(8) if lane not in lost]
    apart = np.abs(found - wanted)[..., others] * control[1][:, None]  # in units of a step's permitted error
    assert not np.any(apart > 10.0)
    assert np.all(np.isnan(found[1:][..., list(lost)]))


def test_a_piece_of_the_drive_extends_as_far_as_one_parabola_fits() -> None:
    line = np.concatenate([np.arange(10.0), np.full(5, 9.0)])
    rows = np.zeros((1, 1, 1))
    assert parabolic_piece(line, rows, 0, 1e-3, STRAIGHT) == (9, 0.0, 1.0, 0.0)
    end, lift, ramp, curvature = parabolic_piece(0.5 * np.arange(6.0) ** 2, rows, 0, 0.1, STRAIGHT)
    assert (end, lift, ramp, curvature) == (5, pytest.approx(1.0 / 12.0), 2.5, 1.0)
    changing = np.repeat(np.array([0.0, 1.0]), [4, 11])[:, None, None]
    assert parabolic_piece(line, changing, 0, 1e-3, STRAIGHT)[0] == 4


def volumes(drive: np.ndarray, bend: float, bulge: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples at which the pieces of a drive end, and the integral of the drive up to each."""
    ends, sums, rows = [0], [0.0], np.zeros((1, 1, 1))
    while ends[-1] < len(drive) - 1:
        end, lift, ramp, curvature = parabolic_piece(drive, rows, ends[-1], bend, bulge)
        length = end - ends[-1]
        sums.append(sums[-1] + length * (lift + 0.5 * ramp * length - curvature * length**2 / 12.0))
        ends.append(end)
    return np.array(ends), np.array(sums)


@pytest.mark.parametrize("bend", [1e-3, 0.3])
@pytest.mark.parametrize("bulge", [SAMPLES, MEANS])
def test_pieces_of_a_curved_drive_keep_its_integral(bulge: float, bend: float) -> None:
    """The speed settles exponentially; long pieces with straight lines used to lose 16 times as much volume."""
    time = np.arange(60.0)
    half = 0.5 if bulge == MEANS else 0.0
    grown = -40.0 * np.exp(-time / 8.0)  # the antiderivative of the speed
    speed = 5.0 * np.exp(-time / 8.0) if half == 0.0 else np.diff(-40.0 * np.exp(-(np.arange(61.0) - half) / 8.0))
    ends, sums = volumes(speed, bend, bulge)
    inside = ends[(ends > 0) & (ends < 59)]  # the slope is unknown at the ends of a log
    held, wanted = np.interp(inside, ends, sums), grown[inside]
    curved = np.abs((held - held[0]) - (wanted - wanted[0])).max()
    straight = np.abs(np.diff(np.interp(inside, *volumes(speed, bend, STRAIGHT))) - np.diff(wanted)).max()
    assert curved < 1e-3
    assert straight > 5.0 * curved


def test_a_piece_of_a_curve_ends_one_sample_before_a_corner() -> None:
    step = np.where(np.arange(30) < 12, 0.0, 1.0)
    ends, sums = volumes(step, 1e-3, SAMPLES)
    assert ends.tolist() == [0, 10, 11, 12, 13, 29]
    assert sums[-1] == pytest.approx(np.sum(0.5 * (step[1:] + step[:-1])))


def test_a_step_ends_with_its_piece_or_leaves_enough_for_another_step() -> None:
    assert step_within_piece(3.0, 3.0, 20.0, 0.1) == 3.0
    assert step_within_piece(2.0, 3.0, 20.0, 0.1) == 1.5
    assert step_within_piece(1.0, 3.0, 20.0, 0.1) == 1.0
    assert step_within_piece(50.0, 99.0, 20.0, 0.1) == 20.0
    assert step_within_piece(3.0, 0.0, 20.0, 0.1) == 0.1


def test_the_smaller_the_error_the_longer_the_next_step() -> None:
    factors = [step_growth(error) for error in (0.0, 1e-3, 0.02, 0.1, 0.3, 0.8)]
    assert factors == [4.0, 2.0, 1.6, 1.25, 1.0, 0.9]
