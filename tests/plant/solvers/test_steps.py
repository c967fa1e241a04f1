"""The schemes converge at their order, and agree with each other and with scipy's LSODA."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, make_dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from benchmarks.peers.stiff_solvers import reference_trajectory
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.arrays import Array
from plant.components.check_valve import check_valve_flow
from plant.eha.model import PARAMETER_NAMES, EhaParameters, lumped_step, reduced_derivative
from plant.eha.simulate import LUMPED, REDUCED
from plant.errors import HydrostateError
from plant.solvers.steps import (
    parameter_names,
    parameter_row,
    parameter_symbols,
    rk4_step,
    ros2_step,
    sdirk2_step,
    solve_linear,
)
from plant.solvers.trajectory import Trajectory, compile_trajectory
from tests.plant.solvers.compiled_rates import rates_and_slopes

MILLISECOND = 1e-3
EVERY_CONDITION = pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)


@pytest.fixture(scope="module")
def lumped() -> Trajectory:
    return compile_trajectory(LUMPED.name, lumped_step, 3, EhaParameters)


@pytest.fixture(scope="module")
def reduced() -> Trajectory:
    return compile_trajectory(REDUCED.name, REDUCED.step, 3, EhaParameters)


@pytest.fixture(scope="module")
def explicit() -> Trajectory:
    return compile_trajectory("reduced_rk4", rk4_step(reduced_derivative), 3, EhaParameters)


def relative_rms(found: Array, wanted: Array) -> Array:
    return np.sqrt(np.mean((found - wanted) ** 2, axis=0) / np.mean(wanted**2, axis=0))


def halving_ratios(run: Callable[[int], Array], fine: int, first: int = 4) -> Array:
    """Return the factor by which each of four halvings of the step lowers the error against a fine run."""
    wanted = run(fine)[:, 1:]
    errors = np.array([np.max(relative_rms(run(first * 2**k)[:, 1:], wanted)) for k in range(5)])
    return errors[:-1] / errors[1:]


def swaying(p: EhaParameters) -> Array:
    """Return a drive that never reverses: 4 V with a ripple, 0.3 s at 1 ms."""
    time = MILLISECOND * np.arange(301)
    return p.rated_speed * (0.8 + 0.2 * np.cos(2.0 * np.pi * 5.0 * time))


@EVERY_CONDITION
def test_the_lumped_step_is_of_second_order_on_a_smooth_stretch(lumped: Trajectory, condition: Condition) -> None:
    p = parameters_for(condition)
    row = parameter_row(p)[None]
    sliding = lumped(np.zeros(3), np.full(501, p.rated_speed), row, MILLISECOND, 40)[-1]
    ratios = halving_ratios(lambda n: lumped(sliding, swaying(p)[:101], row, MILLISECOND, n), 2_048)
    np.testing.assert_allclose(ratios, 4.0, rtol=0.08)


@EVERY_CONDITION
def test_the_lumped_step_keeps_first_order_at_least_across_stick_and_slip(
    lumped: Trajectory, condition: Condition
) -> None:
    p = parameters_for(condition)
    drive = p.rated_speed * np.sin(2.0 * np.pi * 4.0 * MILLISECOND * np.arange(301))

    def run(substeps: int) -> Array:
        return lumped(np.zeros(3), drive, parameter_row(p)[None], MILLISECOND, substeps)

    stuck = run(40)[:, 1] == 0.0
    assert np.any(stuck)
    assert not np.all(stuck)
    assert np.prod(halving_ratios(run, 4_096)) > 2.0**4


@EVERY_CONDITION
def test_ros2_is_of_second_order_and_agrees_with_rk4_at_small_steps(
    reduced: Trajectory, explicit: Trajectory, condition: Condition
) -> None:
    p = parameters_for(condition)
    row, start, drive = parameter_row(p)[None], np.array([0.0, 0.01, 0.0]), swaying(p)
    wanted = explicit(start, drive, row, MILLISECOND, 640)
    assert np.all(relative_rms(reduced(start, drive, row, MILLISECOND, 640), wanted) < 1e-6)
    coarse, fine = (relative_rms(reduced(start, drive, row, MILLISECOND, n), wanted)[1] for n in (40, 80))
    assert coarse / fine == pytest.approx(4.0, rel=0.05)


@EVERY_CONDITION
def test_ros2_agrees_with_lsoda_while_nothing_reverses(reduced: Trajectory, condition: Condition) -> None:
    p = parameters_for(condition)
    row = parameter_row(p)[None]
    sliding = reduced(np.array([0.0, 0.02, 0.0]), np.full(501, p.rated_speed), row, MILLISECOND, 80)[-1]
    size = np.array([1e-2, 1e-2, 1.0])
    wanted = reference_trajectory(reduced_derivative, sliding, swaying(p), p, MILLISECOND, scale=size)
    assert np.all(relative_rms(reduced(sliding, swaying(p), row, MILLISECOND, 80), wanted) < 1e-4)


def test_sdirk2_is_of_second_order() -> None:
    p = parameters_for(CONDITIONS["minor_friction"])
    row, start, drive = parameter_row(p)[None], np.array([0.0, 0.01, 0.0]), swaying(p)
    implicit = compile_trajectory("reduced_sdirk2", sdirk2_step(reduced_derivative), 3, EhaParameters)
    ratios = halving_ratios(lambda n: implicit(start, drive, row, MILLISECOND, n), 2_048, first=16)
    np.testing.assert_allclose(ratios, 4.0, rtol=0.08)


@dataclass(frozen=True)
class _Fed:
    """A chamber that a pump empties and fills and a check valve feeds, in units of the pumped flow [s, Pa]."""

    filled_in: float = 1e-4
    rated_drop: float = 5e4
    opening: float = 4e3


def _fed(state: Any, flow: Any, p: Any) -> Any:
    fed = check_valve_flow(-state[0], 1.0 / p.rated_drop, p.opening)
    return (p.rated_drop * (flow + fed) / p.filled_in,)


def test_an_implicit_step_follows_a_valve_that_fills_a_chamber_within_one_step() -> None:
    """ROS2 treats the valve as shut in the step in which it opens, and so adds oil that stays in the chamber."""
    drive, row = np.sin(2.0 * np.pi * 5.0 * MILLISECOND * np.arange(401)), parameter_row(_Fed())[None]

    def run(scheme: Callable[..., Any], substeps: int) -> Array:
        step = compile_trajectory(f"fed_{scheme.__name__}", scheme(_fed), 1, _Fed)
        return step(np.zeros(1), drive, row, MILLISECOND, substeps)[:, 0]

    wanted = run(ros2_step, 1_000)
    implicit, explicit = (np.max(np.abs(run(scheme, 4) - wanted)) for scheme in (sdirk2_step, ros2_step))
    assert implicit < 0.01 * explicit


def test_an_l_stable_step_settles_at_a_step_size_at_which_rk4_diverges(
    reduced: Trajectory, explicit: Trajectory
) -> None:
    p = parameters_for(CONDITIONS["major_friction"])
    row, drive = parameter_row(p)[None], np.full(1001, p.rated_speed)
    start = np.array([0.0, 0.03, 0.0])
    with np.errstate(all="ignore"):
        blown = explicit(start, drive, row, MILLISECOND, 5)
    held = reduced(start, drive, row, MILLISECOND, 5)
    assert not np.all(np.isfinite(blown))
    assert held[-1, 1] == pytest.approx(held[-2, 1], rel=1e-3)


@EVERY_CONDITION
def test_analytic_derivatives_equal_numerical_ones(condition: Condition) -> None:
    p = parameters_for(condition)
    _, slopes = rates_and_slopes(reduced_derivative, 3, EhaParameters)
    for state in ((0.1, 0.03, 1.0), (-0.1, -0.01, 3.0)):
        x = np.array(state)
        numerical = np.empty((3, 3))
        for column, size in enumerate((1e-6, 1e-7, 1e-4)):
            e = size * np.eye(3)[column]
            above, below = (np.array(reduced_derivative(tuple(x + s * e), 100.0, p)) for s in (1.0, -1.0))
            numerical[:, column] = (above - below) / (2.0 * size)
        found = slopes(x, 100.0, parameter_row(p))
        np.testing.assert_allclose(found, numerical, rtol=1e-6, atol=1e-9 * np.max(np.abs(numerical)))


@given(arrays(np.float64, (4, 4), elements=st.floats(-1.0, 1.0)), arrays(np.float64, 4, elements=st.floats(-9.0, 9.0)))
def test_elimination_solves_diagonally_dominant_systems(small: Array, right: Array) -> None:
    matrix = small + 5.0 * np.eye(4)
    found = solve_linear(matrix.tolist(), right.tolist())
    np.testing.assert_allclose(matrix @ found, right, rtol=1e-12, atol=1e-13)


def test_a_drive_is_linear_between_its_samples(lumped: Trajectory) -> None:
    p = EhaParameters()
    row = parameter_row(p)[None]
    knots = p.rated_speed * np.array([0.0, 1.0, -0.5, 0.2, 0.2, 0.9])
    coarse = lumped(np.zeros(3), knots, row, 10.0 * MILLISECOND, 100)
    dense = np.interp(0.1 * np.arange(51), np.arange(6), knots)
    fine = lumped(np.zeros(3), dense, row, MILLISECOND, 10)
    np.testing.assert_allclose(fine[::10], coarse, rtol=1e-9, atol=1e-12 * np.max(np.abs(coarse)))


def test_each_row_of_parameters_holds_until_the_next_sample(lumped: Trajectory) -> None:
    healthy, leaking = (parameters_for(CONDITIONS[name]) for name in ("normal", "major_leakage"))
    drive = np.full(200, healthy.rated_speed)
    rows = np.array([parameter_row(healthy)] * 100 + [parameter_row(leaking)] * 100)
    both = lumped(np.zeros(3), drive, rows, MILLISECOND, 10)
    before = lumped(np.zeros(3), drive, rows[:1], MILLISECOND, 10)
    after = lumped(before[100], drive[100:], rows[-1:], MILLISECOND, 10)
    np.testing.assert_array_equal(both[:101], before[:101])
    np.testing.assert_array_equal(both[100:], after)


def test_a_parameter_row_has_the_order_of_the_dataclass() -> None:
    p = EhaParameters(stroke=0.25, accumulator_gas=1e-3)
    assert dict(zip(PARAMETER_NAMES, parameter_row(p).tolist(), strict=True)) == asdict(p)
    assert {name: found.value for name, found in vars(parameter_symbols(EhaParameters)).items()} == {
        n: n for n in PARAMETER_NAMES
    }


def test_a_step_of_ros2_needs_symbols_because_it_differentiates() -> None:
    with pytest.raises(AttributeError):
        ros2_step(reduced_derivative)((0.0, 0.01, 0.0), (1.0, 1.0), EhaParameters(), 1e-4)


@pytest.mark.parametrize("name", ["h", "x1", "theta12", "u_rise"])
def test_a_parameter_name_that_kernels_use_themselves_is_refused(name: str) -> None:
    made = make_dataclass("Own", [("mass", float), (name, float)], frozen=True)
    with pytest.raises(HydrostateError, match=f"Own must not call a parameter '{name}': use a longer name"):
        parameter_names(made)
