"""Scipy's stiff solvers on a compiled model with its analytic Jacobian: the peer of the fixed-step kernels.

Finite-difference Jacobians across ``sign(v)`` give grossly wrong runs from rest, so none are used.
"""

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.expression import ZERO, jacobian, symbol
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import statements
from plant.eha import EhaParameters
from plant.integrate import Derivative, parameter_row, parameter_symbols

Array: TypeAlias = NDArray[np.float64]

Method: TypeAlias = Literal["LSODA", "Radau", "BDF"]

_MODEL = '''"""Generated: rates of {name} and their Jacobian."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def rates(state, u, parameters):
    result = np.empty({width})
{load}
{rate_body}
{rate_store}
    return result


@numba.njit(cache=True, nogil=True, error_model="numpy")
def slopes(state, u, parameters):
    matrix = np.zeros(({width}, {width}))
{load}
{slope_body}
{slope_store}
    return matrix
'''


@cache
def compile_model(
    derivative: Derivative, width: int, parameter_class: type[EhaParameters]
) -> tuple[Callable[[Array, float, Array], Array], Callable[[Array, float, Array], Array]]:
    """Generate a derivative and its analytic Jacobian by the state.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``.
    width : int
        Count of states.
    parameter_class : type
        What a parameter row holds, field by field.

    Returns
    -------
    tuple of callable
        ``rates(state (states,), speed [rad/s], parameter row)``, shape (states,), and ``slopes`` of the same, shape
        (states, states).
    """
    state = tuple(symbol(f"x{i}") for i in range(width))
    found = derivative(state, symbol("u"), parameter_symbols(parameter_class))
    rows = jacobian(found, state)
    rates = {f"r{i}": rate for i, rate in enumerate(found)}
    slopes = {f"j{i}_{j}": rows[i][j] for i in range(width) for j in range(width) if rows[i][j] is not ZERO}
    load = [f"    x{i} = state[{i}]" for i in range(width)]
    load += [f"    {field.name} = parameters[{i}]" for i, field in enumerate(fields(parameter_class))]
    source = _MODEL.format(
        name=derivative.__name__,
        width=width,
        load="\n".join(load),
        rate_body=statements(rates, " " * 4),
        rate_store="\n".join(f"    result[{name[1:]}] = {name}" for name in rates),
        slope_body=statements(slopes, " " * 4),
        slope_store="\n".join(f"    matrix[{name[1:].replace('_', ', ')}] = {name}" for name in slopes),
    )
    module = load_kernel(f"model_{derivative.__name__}", source)
    return module.rates, module.slopes


def reference_trajectory(
    derivative: Derivative,
    initial: Array,
    speed: Array,
    parameters: EhaParameters,
    sample_time: float,
    *,
    scale: Array,
    relative_tolerance: float = 1e-8,
    method: Method = "LSODA",
) -> Array:
    """Integrate with one of scipy's stiff solvers.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``.
    initial : ndarray, shape (states,)
        Initial state in SI.
    speed : ndarray, shape (n,)
        Motor speed at the samples [rad/s], linear between.
    parameters : EhaParameters
        The actuator, of the class that the derivative reads.
    sample_time : float
        Seconds between samples [s].
    scale : ndarray, shape (states,)
        How much each state changes [SI]; the absolute tolerance is the relative one times this.
    relative_tolerance : float
        Local error, relative [dimensionless].
    method : {"LSODA", "Radau", "BDF"}
        Which solver.

    Returns
    -------
    ndarray, shape (n, states)
        States at the samples.

    Raises
    ------
    RuntimeError
        If the solver gives up.
    """
    from scipy.integrate import solve_ivp

    rates, slopes = compile_model(derivative, len(initial), type(parameters))
    row = parameter_row(parameters)
    last = len(speed) - 2

    def speed_at(t: float) -> float:
        place = t / sample_time
        k = min(int(place), last)
        return float(speed[k] + (place - k) * (speed[k + 1] - speed[k]))

    solution = solve_ivp(
        lambda t, x: rates(x, speed_at(t), row),
        (0.0, sample_time * (len(speed) - 1)),
        initial,
        method=method,
        t_eval=sample_time * np.arange(len(speed)),
        jac=lambda t, x: slopes(x, speed_at(t), row),
        rtol=relative_tolerance,
        atol=relative_tolerance * scale,
        max_step=10.0 * sample_time,
    )
    if not solution.success:
        raise RuntimeError(f"scipy's {method} stopped: {solution.message}")
    return solution.y.T
