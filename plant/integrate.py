"""Fixed-step schemes, compiled from a plant's readable functions.

``ros2`` is a two-stage, second-order, L-stable Rosenbrock method with the analytic Jacobian; ``rk4`` the classical
explicit one; a plant may bring a step of its own (the lumped plant's closed-form implicit one). Scipy's solvers, as
the reference, stand in `plant.reference_solver`.
"""

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import cache
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.expression import ONE, ZERO, Expression, jacobian, symbol
from plant.compiled.functions import Scalar
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import statements, symbols_in
from plant.eha import GAMMA, EhaParameters

State: TypeAlias = tuple[Scalar, ...]
Derivative: TypeAlias = Callable[[Any, Scalar, Any], State]
"""``derivative(state, speed, parameters)``."""

StepFunction: TypeAlias = Callable[[Any, tuple[Scalar, Scalar], Any, Scalar], State]
"""``step(state, (speed at start, speed at end), parameters, step size)``."""

Trajectory: TypeAlias = Callable[
    [NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float, int], NDArray[np.float64]
]
"""``run(initial state, speed, parameter rows, sample time, substeps) -> states, shape (n, states)``."""

PARAMETER_NAMES = tuple(field.name for field in fields(EhaParameters))
"""Order of the columns of a parameter row."""


def parameter_symbols(parameter_class: type[EhaParameters] = EhaParameters) -> SimpleNamespace:
    """Return a namespace with one symbol for each parameter of the actuator.

    Parameters
    ----------
    parameter_class : type
        `EhaParameters`, or a class that adds to it.

    Returns
    -------
    namespace
        Symbols by parameter name.
    """
    return SimpleNamespace(**{field.name: symbol(field.name) for field in fields(parameter_class)})


def parameter_row(parameters: EhaParameters) -> NDArray[np.float64]:
    """Return the parameters as an array, in the order of their fields, which begins with `PARAMETER_NAMES`.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator.

    Returns
    -------
    ndarray, shape (parameters,)
        Their values in SI.
    """
    return np.array([getattr(parameters, field.name) for field in fields(parameters)], dtype=np.float64)


def solve_linear(matrix: Sequence[Sequence[Scalar]], right: Sequence[Scalar]) -> list[Scalar]:
    """Solve a small linear system by elimination without pivoting, in expressions or floats.

    Parameters
    ----------
    matrix : sequence of sequence of Expression, shape (n, n)
        Diagonally dominant for small steps; structural zeros cost nothing [any unit].
    right : sequence of Expression, shape (n,)
        Right-hand side [any unit].

    Returns
    -------
    list of Expression
        The solution.

    Examples
    --------
    >>> solve_linear([[2.0, 0.0], [1.0, 4.0]], [2.0, 9.0])
    [1.0, 2.0]
    """
    a = [list(row) for row in matrix]
    b = list(right)
    n = len(b)
    for pivot in range(n):
        for row in range(pivot + 1, n):
            factor = a[row][pivot] / a[pivot][pivot]
            for column in range(pivot + 1, n):
                a[row][column] = a[row][column] - factor * a[pivot][column]
            b[row] = b[row] - factor * b[pivot]
    for row in reversed(range(n)):
        for column in range(row + 1, n):
            b[row] = b[row] - a[row][column] * b[column]
        b[row] = b[row] / a[row][row]
    return b


def ros2_step(derivative: Derivative) -> StepFunction:
    """Build the ROS2 step of a derivative (Verwer et al. 1999, SIAM J. Sci. Comput. 20, 1456, equation 2.1).

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``; it is differentiated, so the step takes symbols only.

    Returns
    -------
    callable
        ``step(state, speeds, parameters, h)``.
    """

    def step(state: State, speeds: tuple[Scalar, Scalar], p: object, h: Scalar) -> State:
        start, end = speeds
        rates = derivative(state, start, p)
        slopes = jacobian(rates, [*state, start])
        drift = [GAMMA * row[-1] * (end - start) for row in slopes]
        matrix = [
            [(ONE if i == j else ZERO) - GAMMA * h * slopes[i][j] for j in range(len(state))] for i in range(len(state))
        ]
        k1 = solve_linear(matrix, [f + d for f, d in zip(rates, drift, strict=True)])
        inner = tuple(x + h * k for x, k in zip(state, k1, strict=True))
        later = derivative(inner, end, p)
        k2 = solve_linear(matrix, [f - 2.0 * k - d for f, k, d in zip(later, k1, drift, strict=True)])
        return tuple(x + h * (1.5 * a + 0.5 * b) for x, a, b in zip(state, k1, k2, strict=True))

    return step


def rk4_step(derivative: Derivative) -> StepFunction:
    """Build the classical fourth-order Runge-Kutta step of a derivative.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``.

    Returns
    -------
    callable
        ``step(state, speeds, parameters, h)``.
    """

    def step(state: State, speeds: tuple[Scalar, Scalar], p: object, h: Scalar) -> State:
        start, end = speeds
        middle = 0.5 * (start + end)

        def moved(rates: State, fraction: float) -> State:
            return tuple(x + fraction * h * k for x, k in zip(state, rates, strict=True))

        k1 = derivative(state, start, p)
        k2 = derivative(moved(k1, 0.5), middle, p)
        k3 = derivative(moved(k2, 0.5), middle, p)
        k4 = derivative(moved(k3, 1.0), end, p)
        mean = tuple((a + 2.0 * b + 2.0 * c + d) / 6.0 for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        return moved(mean, 1.0)

    return step


_TRAJECTORY = '''"""Generated: trajectory of the {name} plant."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(initial, speed, parameters, sample_time, substeps):
    n = speed.shape[0]
    last_row = parameters.shape[0] - 1
    states = np.empty((n, {width}))
    {unpack} = {initial}
    h = sample_time / substeps
    for k in range(n):
{store}
        if k == n - 1:
            break
        row = min(k, last_row)
{load}
        slope = (speed[k + 1] - speed[k]) / substeps
        for j in range(substeps):
            u_start = speed[k] + j * slope
            u_end = u_start + slope
{step}
    return states
'''


@cache
def compile_trajectory(
    name: str, step: StepFunction, width: int, parameter_class: type[EhaParameters] = EhaParameters
) -> Trajectory:
    """Generate the kernel that runs a step function along a drive.

    Parameters
    ----------
    name : str
        What the kernel is, for its file's name.
    step : callable
        ``step(state, speeds, parameters, h)``, written for symbols.
    width : int
        Count of states.
    parameter_class : type
        What the parameter rows hold, field by field.

    Returns
    -------
    callable
        ``run(initial (states,), speed (n,), parameter rows (1 or n, parameters), sample time [s], substeps)``, which
        returns the states at the samples, shape (n, states).
    """
    state = tuple(symbol(f"x{i}") for i in range(width))
    speeds = (symbol("u_start"), symbol("u_end"))
    result: list[Expression] = list(step(state, speeds, parameter_symbols(parameter_class), symbol("h")))
    outputs = {f"x{i}": value for i, value in enumerate(result)}
    used = symbols_in(result)
    columns = [(i, field.name) for i, field in enumerate(fields(parameter_class)) if field.name in used]
    source = _TRAJECTORY.format(
        name=name,
        width=width,
        unpack=", ".join(f"x{i}" for i in range(width)),
        initial=", ".join(f"initial[{i}]" for i in range(width)),
        store="\n".join(f"        states[k, {i}] = x{i}" for i in range(width)),
        load="\n".join(f"        {parameter} = parameters[row, {i}]" for i, parameter in columns),
        step=statements(outputs, " " * 12),
    )
    return load_kernel(name, source).run
