"""The generated source computes what the model function computes."""

import math
from dataclasses import asdict
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.compiled.expression import constant, symbol
from plant.compiled.functions import absolute, arctan, cos, exp, maximum, minimum, sign, sin, sqrt, tanh, where
from plant.compiled.source import lines_source, symbols_in
from plant.eha.model import EhaParameters, lumped_step, reduced_derivative
from plant.solvers.steps import GAMMA, StepFunction, parameter_row, ros2_step
from plant.solvers.trajectory import compile_trajectory
from tests.kernels import computed

STEP = 1e-4
SPEEDS = (100.0, 104.0)
SLIDING = (0.01, 0.035, 6e5)
STUCK = (0.01, 0.0, 1e5)
RELIEVED = (0.01, -0.02, -3.6e6)


def emitted(step: StepFunction, state: tuple[float, ...], name: str, parameters: EhaParameters) -> NDArray[np.float64]:
    run = compile_trajectory(name, step, len(state), EhaParameters)
    return run(np.array(state), np.array(SPEEDS), parameter_row(parameters)[None], STEP, 1)[1]


def rosenbrock(state: tuple[float, ...], parameters: EhaParameters) -> NDArray[np.float64]:
    """Return the result of one ROS2 step by linear algebra, with a Jacobian from central differences."""
    start, end = SPEEDS
    x = np.array(state)
    size = 1e-6 * np.array([1e-2, 1e-2, 1.0])

    def f(y: NDArray[np.float64], speed: float) -> NDArray[np.float64]:
        return np.array(reduced_derivative(tuple(y), speed, parameters), dtype=np.float64)

    J = np.column_stack([(f(x + e, start) - f(x - e, start)) / (2.0 * e.sum()) for e in np.diag(size)])
    drift = GAMMA * (end - start) * (f(x, start + 1.0) - f(x, start))
    W = np.eye(len(x)) - GAMMA * STEP * J
    k1 = np.linalg.solve(W, f(x, start) + drift)
    k2 = np.linalg.solve(W, f(x + STEP * k1, end) - 2.0 * k1 - drift)
    return x + STEP * (1.5 * k1 + 0.5 * k2)


@pytest.mark.parametrize("state", [SLIDING, STUCK, RELIEVED], ids=["sliding", "stuck", "relieved"])
@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_the_emitted_lumped_step_computes_the_same_as_the_model_function(
    condition: Condition, state: tuple[float, float, float]
) -> None:
    parameters = parameters_for(condition)
    direct = np.array(lumped_step(state, SPEEDS, parameters, STEP), dtype=np.float64)
    np.testing.assert_allclose(emitted(lumped_step, state, "lumped", parameters), direct, rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_the_emitted_reduced_step_agrees_with_ros2_by_linear_algebra(condition: Condition) -> None:
    parameters = parameters_for(condition)
    state = (0.01, 0.03, 0.5)
    got = emitted(ros2_step(reduced_derivative), state, "reduced_once", parameters)
    wanted = rosenbrock(state, parameters)
    np.testing.assert_allclose(got - state, wanted - state, rtol=1e-6, atol=0.0)


def test_every_supported_function_is_written_in_the_source() -> None:
    x, y = symbol("x"), symbol("y")
    outputs = {
        "a": sqrt(absolute(x)) + exp(y) - tanh(x * y) / 3.0,
        "b": where(x <= y, maximum(x, 0.5), minimum(y, -0.5)) * sign(x),
        "c": where(x >= y, where(x < 1.0, x, y), constant(-2.0)),
        "d": sin(x) * cos(y) + arctan(x - y),
    }
    for values in ((0.7, -1.2), (-0.3, 0.4), (2.0, 2.0)):
        u, v = values
        scope = SimpleNamespace(**computed(outputs, x=u, y=v))
        assert scope.a == pytest.approx(math.sqrt(abs(u)) + math.exp(v) - math.tanh(u * v) / 3.0, rel=1e-15)
        assert scope.b == (max(u, 0.5) if u <= v else min(v, -0.5)) * math.copysign(1.0, u)
        assert scope.d == pytest.approx(math.sin(u) * math.cos(v) + math.atan(u - v), rel=1e-15)
        assert scope.c == ((u if u < 1.0 else v) if u >= v else -2.0)


def test_outputs_may_have_the_names_of_inputs() -> None:
    x, y = symbol("x"), symbol("y")
    assert computed({"x": y, "y": x}, x=3.0, y=5.0) == {"x": 5.0, "y": 3.0}


def test_a_common_sub_expression_is_computed_once() -> None:
    x = symbol("x")
    assert lines_source("lines", {"a": tanh(x) + 1.0, "b": tanh(x) * 2.0}).count("tanh") == 1


def test_the_lumped_step_reads_only_the_parameters_that_it_uses() -> None:
    names = SimpleNamespace(**{name: symbol(name) for name in asdict(EhaParameters())})
    state = (symbol("x0"), symbol("x1"), symbol("x2"))
    used = symbols_in(lumped_step(state, (symbol("a"), symbol("b")), names, symbol("h")))
    assert {"piston_area", "relief_pressure", "friction_linear"} <= used
    assert used.isdisjoint({"stroke", "motor_speed_limit", "motor_speed_per_volt"})
