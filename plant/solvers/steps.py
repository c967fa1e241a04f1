"""Steps of fixed length for any plant: schemes from its readable rates, and the parameters that these read.

``ros2`` is a two-stage, second-order, L-stable Rosenbrock method with the analytic Jacobian; ``sdirk2`` is the implicit
method of the same order, for rates that become stiff within a step; ``rk4`` is the classical explicit method; a plant
may have its own step (the lumped plant's closed-form implicit one). Parameters are any frozen dataclass whose fields
are numbers: a row holds them in the fields' order.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import Field, fields
from functools import cache
from types import SimpleNamespace
from typing import Any, ClassVar, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.expression import ONE, ZERO, jacobian, symbol
from plant.compiled.functions import Scalar
from plant.errors import HydrostateError

State: TypeAlias = tuple[Scalar, ...]
RateDriven: TypeAlias = Callable[[Any, Scalar, Scalar, Any], State]
"""``derivative(state, drive, rate of the drive, parameters)``."""

Derivative: TypeAlias = Callable[[Any, Scalar, Any], State]
"""``derivative(state, speed, parameters)``."""

StepFunction: TypeAlias = Callable[[Any, tuple[Scalar, Scalar], Any, Scalar], State]
"""``step(state, (speed at start, speed at end), parameters, step size)``."""

GAMMA = 1.0 - 0.5**0.5
"""Diagonal coefficient of two-stage, second-order, L-stable schemes: ROS2, and SDIRK2 (Alexander 1977, theorem 5)."""

NEWTON_ITERATIONS = 2
"""Newton iterations per stage of SDIRK2 [count]. A check valve's flow is close to two straight lines, and the first
iteration finds the right line. A third changes nothing: on eleven rigs at most 0.01 deviations of a log's noise."""


class Parameters(Protocol):
    """Parameters of a plant: a frozen dataclass whose fields are numbers."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


_TAKEN = re.compile(r"[A-Za-z]_?\d+(_\d+)?|theta\d+|h|j|share|drive|rise|pace|u_start|u_end|u_rise|error")
"""Names that kernels use for their own numbers."""


@cache
def parameter_names(parameter_class: type[Parameters]) -> tuple[str, ...]:
    """Return the order of the columns of a parameter row.

    Raises
    ------
    HydrostateError
        If a field has a name that kernels use for their own numbers.
    """
    names = tuple(field.name for field in fields(parameter_class))
    taken = [name for name in names if _TAKEN.fullmatch(name)]
    if taken:
        raise HydrostateError(f"{parameter_class.__name__} must not call a parameter {taken[0]!r}: use a longer name")
    return names


def parameter_symbols(parameter_class: type[Parameters]) -> SimpleNamespace:
    """Return a namespace with one symbol for each parameter of a plant.

    Returns
    -------
    namespace
        Symbols by parameter name.
    """
    return SimpleNamespace(**{name: symbol(name) for name in parameter_names(parameter_class)})


def parameter_row(
    parameters: Parameters | SimpleNamespace, parameter_class: type[Parameters] | None = None
) -> NDArray[np.float64]:
    """Return parameters as an array, in the order of `parameter_names`.

    Parameters
    ----------
    parameters : dataclass
        The parameters; if a class is given, any object with its fields' names.
    parameter_class : type, optional
        Class whose fields are used; by default the class of the parameters.

    Returns
    -------
    ndarray, shape (parameters,)
        Their values in SI; infinite if a value is not known.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Spring:
    ...     mass: float = 2.0
    ...     stiffness: float = 50.0
    >>> parameter_row(Spring(stiffness=80.0)).tolist()
    [2.0, 80.0]
    """
    whose: Any = parameter_class or type(parameters)
    values = (getattr(parameters, name) for name in parameter_names(whose))
    return np.array([np.inf if value is None else value for value in values], dtype=np.float64)


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


def _implicit_matrix(slopes: list[list[Scalar]], h: Scalar) -> list[list[Scalar]]:
    """Return ``I - h J`` from one row of slopes for each state; the slopes by non-states stand last and are ignored."""
    states = range(len(slopes))
    return [[(ONE if i == j else ZERO) - h * slopes[i][j] for j in states] for i in states]


@cache
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
        matrix = _implicit_matrix(slopes, GAMMA * h)
        k1 = solve_linear(matrix, [f + d for f, d in zip(rates, drift, strict=True)])
        inner = tuple(x + h * k for x, k in zip(state, k1, strict=True))
        later = derivative(inner, end, p)
        k2 = solve_linear(matrix, [f - 2.0 * k - d for f, k, d in zip(later, k1, drift, strict=True)])
        return tuple(x + h * (1.5 * a + 0.5 * b) for x, a, b in zip(state, k1, k2, strict=True))

    return step


@cache
def sdirk2_step(derivative: Derivative) -> StepFunction:
    """Build the two-stage, second-order, stiffly accurate implicit step of a derivative (Alexander 1977, theorem 5).

    If a valve opens within a step, ROS2 computes its flow from the slopes of the shut valve, and overshoots far to the
    other side. Here each stage solves its equation, with the slopes at its end.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``; it is differentiated, so the step takes symbols only.

    Returns
    -------
    callable
        ``step(state, speeds, parameters, h)``; its derivatives are those of the result of Newton's iterations.
    """

    def step(state: State, speeds: tuple[Scalar, Scalar], p: object, h: Scalar) -> State:
        start, end = speeds
        inner = _newton_solution(derivative, state, state, start + GAMMA * (end - start), p, GAMMA * h)
        rates = [(y - x) / (GAMMA * h) for x, y in zip(state, inner, strict=True)]
        base = tuple(x + (1.0 - GAMMA) * h * rate for x, rate in zip(state, rates, strict=True))
        guess = tuple(x + h * rate for x, rate in zip(state, rates, strict=True))
        return _newton_solution(derivative, base, guess, end, p, GAMMA * h)

    return step


def _newton_solution(derivative: Derivative, base: State, guess: State, speed: Scalar, p: object, h: Scalar) -> State:
    """Return the solution of ``x = base + h f(x)`` by Newton's iterations from a guess."""
    x = guess
    for _ in range(NEWTON_ITERATIONS):
        rates = derivative(x, speed, p)
        slopes = jacobian(rates, x)
        left = [start + h * rate - y for start, rate, y in zip(base, rates, x, strict=True)]
        x = tuple(y + d for y, d in zip(x, solve_linear(_implicit_matrix(slopes, h), left), strict=True))
    return x


@cache
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


def rate_driven_step(derivative: RateDriven) -> StepFunction:
    """Build the classical Runge-Kutta step of rates that depend on the rate of their drive, linear over a step.

    Parameters
    ----------
    derivative : callable
        As ``derivative(state, drive, rate of the drive, parameters)``.
    """

    def step(state: State, drives: tuple[Scalar, Scalar], p: object, h: Scalar) -> State:
        rise = (drives[1] - drives[0]) / h

        def rates(x: State, drive: Scalar, q: object) -> State:
            return derivative(x, drive, rise, q)

        return rk4_step(rates)(state, drives, p, h)

    return step
