"""A model's rates and their analytic Jacobian, compiled for third-party stiff solvers."""

from collections.abc import Callable
from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.compiled.expression import as_expression, jacobian, symbol
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.compiled.source import lines_source
from plant.solvers.steps import Derivative, Parameters, parameter_names, parameter_symbols


class ModelKernel(Protocol):
    """Functions of a model's kernel: its rates and slopes from ``(*state, drive)`` and the parameters in memory."""

    load: Callable[[int], Any]
    store: Callable[[Any, int], None]
    rates_of: Callable[[Any, int], Any]
    slopes_of: Callable[[Any, int], Any]


def rates(kernel: ModelKernel, state: Array, u: float, parameters: Array, result: Array) -> None:
    """Write the rates of a state into a result array.

    Parameters
    ----------
    state, result : ndarray, shape (states,)
        State, and array for its rates [SI].
    parameters : ndarray, shape (parameters,)
        Parameter row [SI].
    """
    numbers = (*kernel.load(state.ctypes.data), u)
    kernel.store(kernel.rates_of(numbers, parameters.ctypes.data), result.ctypes.data)


def slopes(kernel: ModelKernel, state: Array, u: float, parameters: Array, result: Array) -> None:
    """Write the Jacobian of the rates with respect to the state into a result array.

    Parameters
    ----------
    state : ndarray, shape (states,)
        State [SI].
    parameters : ndarray, shape (parameters,)
        Parameter row [SI].
    result : ndarray, shape (states, states)
        Array for the Jacobian [SI].
    """
    numbers = (*kernel.load(state.ctypes.data), u)
    kernel.store(kernel.slopes_of(numbers, parameters.ctypes.data), result.ctypes.data)


def drive_at(t: float, speed: Array, piece: NDArray[np.int64], sample_time: float) -> float:
    """Return the drive at a time; the line of the piece extends beyond its ends."""
    place = t / sample_time
    k = min(max(int(place), piece[0]), piece[1] - 1)
    return speed[k] + (place - k) * (speed[k + 1] - speed[k])


def rates_at(
    kernel: ModelKernel,
    at: Array,
    state: Array,
    speed: Array,
    piece: NDArray[np.int64],
    sample_time: float,
    parameters: Array,
    result: Array,
) -> None:
    """Write the rates at a time into a result array.

    Parameters
    ----------
    at : ndarray, shape (1,)
        Time [s].
    state : ndarray, shape (states,)
        State [SI].
    speed : ndarray, shape (samples,)
        Drive [rad/s].
    piece : ndarray of int, shape (2,)
        First and last sample of a piece.
    parameters : ndarray, shape (parameters,)
        Parameter row [SI].
    result : ndarray, shape (states,)
        Array for the rates [SI].
    """
    rates(kernel, state, drive_at(at[0], speed, piece, sample_time), parameters, result)


def slopes_at(
    kernel: ModelKernel,
    at: Array,
    state: Array,
    speed: Array,
    piece: NDArray[np.int64],
    sample_time: float,
    parameters: Array,
    result: Array,
) -> None:
    """Write the Jacobian at a time into a result array.

    Parameters
    ----------
    at : ndarray, shape (1,)
        Time [s].
    state : ndarray, shape (states,)
        State [SI].
    speed : ndarray, shape (samples,)
        Drive [rad/s].
    piece : ndarray of int, shape (2,)
        First and last sample of a piece.
    parameters : ndarray, shape (parameters,)
        Parameter row [SI].
    result : ndarray, shape (states, states)
        Array for the Jacobian [SI].
    """
    slopes(kernel, state, drive_at(at[0], speed, piece, sample_time), parameters, result)


ENTRIES = (rates, slopes, rates_at, slopes_at)


@cache
def compiled_model(derivative: Derivative, width: int, parameter_class: type[Parameters]) -> NativeKernel:
    """Return the kernel of a derivative: `rates`, `slopes`, and both at a time.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``.
    width : int
        Number of states.
    parameter_class : type
        Class that defines the fields of a parameter row.
    """
    names = [f"x{i}" for i in range(width)]
    state = tuple(map(symbol, names))
    found = [as_expression(rate) for rate in derivative(state, symbol("u"), parameter_symbols(parameter_class))]
    by_state = jacobian(found, state)
    slots = {name: i for i, name in enumerate(parameter_names(parameter_class))}
    given = [*names, "u"]
    parts = (
        lines_source("rate_lines", {f"r{i}": rate for i, rate in enumerate(found)}),
        lines_source("slope_lines", {f"j{i}_{j}": by_state[i][j] for i in range(width) for j in range(width)}),
        f"load = loading({width})",
        f"rates_of = advancing({given}, {slots}, rate_lines, {width})",
        f"slopes_of = advancing({given}, {slots}, slope_lines, {width**2})",
        functions_text(drive_at, *ENTRIES),
    )
    title = f"rates of {derivative.__name__} and their Jacobian"
    entries = {one.__name__: signature_of(one, states=width) for one in ENTRIES}
    return load_native(f"model_{derivative.__name__}", kernel_text(title, *parts), entries)
