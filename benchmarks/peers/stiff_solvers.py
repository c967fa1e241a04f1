"""Stiff solvers of scipy and SUNDIALS on a compiled model with its analytic Jacobian: the peers of our kernels.

Finite-difference Jacobians across ``sign(v)`` give grossly wrong runs from rest, so none are used. A solver stops at
the drive's corners or takes no step longer than ten samples, lest it miss one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from itertools import pairwise
from types import ModuleType
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.expression import as_expression, jacobian, symbol
from plant.compiled.kernel_file import load_kernel
from plant.compiled.paste import kernel_text, pasted
from plant.compiled.source import INTRINSICS, lines_source
from plant.errors import HydrostateError
from plant.solvers.steps import Derivative, Parameters, parameter_names, parameter_row, parameter_symbols

Array: TypeAlias = NDArray[np.float64]

Method: TypeAlias = Literal["LSODA", "Radau", "BDF", "odeint", "CVODE"]
"""Scipy's ``solve_ivp`` by its three stiff methods, its ``odeint`` (LSODA without its overhead), SUNDIALS' CVODE."""

CORNER = 1e-2
"""Bend of the drive, relative to its largest value, at which a solver may be told to stop."""

Held: TypeAlias = tuple[Array, NDArray[np.int64], float, Array]
"""What a solver hands to the rates: drive at the samples, first and last sample of a piece, sample time, parameters."""


class ModelKernel(Protocol):
    """What the kernel of a model has: its rates and slopes from ``(*state, drive)`` and the parameters in memory."""

    WIDTH: int
    load: Callable[[int], Any]
    store: Callable[[Any, int], None]
    rates_of: Callable[[Any, int], Any]
    slopes_of: Callable[[Any, int], Any]


def rates(kernel: ModelKernel, state: Array, u: float, parameters: Array) -> Array:
    """Return the rates of a state."""
    result = np.empty(kernel.WIDTH)
    numbers = (*kernel.load(state.ctypes.data), u)
    kernel.store(kernel.rates_of(numbers, parameters.ctypes.data), result.ctypes.data)
    return result


def slopes(kernel: ModelKernel, state: Array, u: float, parameters: Array) -> Array:
    """Return the Jacobian of the rates by the state."""
    matrix = np.empty((kernel.WIDTH, kernel.WIDTH))
    numbers = (*kernel.load(state.ctypes.data), u)
    kernel.store(kernel.slopes_of(numbers, parameters.ctypes.data), matrix.ctypes.data)
    return matrix


def drive_at(t: float, speed: Array, piece: NDArray[np.int64], sample_time: float) -> float:
    """Return the drive at a time, the piece's line going on beyond its ends."""
    place = t / sample_time
    k = min(max(int(place), piece[0]), piece[1] - 1)
    return speed[k] + (place - k) * (speed[k + 1] - speed[k])


def rates_at(
    kernel: ModelKernel,
    t: float,
    state: Array,
    speed: Array,
    piece: NDArray[np.int64],
    sample_time: float,
    parameters: Array,
) -> Array:
    """Return the rates at a time."""
    return rates(kernel, state, drive_at(t, speed, piece, sample_time), parameters)


def slopes_at(
    kernel: ModelKernel,
    t: float,
    state: Array,
    speed: Array,
    piece: NDArray[np.int64],
    sample_time: float,
    parameters: Array,
) -> Array:
    """Return the Jacobian at a time."""
    return slopes(kernel, state, drive_at(t, speed, piece, sample_time), parameters)


def fill_rates(kernel: ModelKernel, t: float, state: Array, result: Array, held: Held) -> None:
    """Fill in the rates, as CVODE asks for them."""
    result[:] = rates_at(kernel, t, state, held[0], held[1], held[2], held[3])


def fill_slopes(kernel: ModelKernel, t: float, state: Array, known: Array, result: Array, held: Held) -> None:  # noqa: ARG001  CVODE passes them
    """Fill in the Jacobian, as CVODE asks for it; the rates are known."""
    result[:] = slopes_at(kernel, t, state, held[0], held[1], held[2], held[3])


FUNCTIONS = (rates, slopes, drive_at, rates_at, slopes_at, fill_rates, fill_slopes)


def compile_model(
    derivative: Derivative, width: int, parameter_class: type[Parameters]
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
    module = _compiled(derivative, width, parameter_class)
    return module.rates, module.slopes


@cache
def _compiled(derivative: Derivative, width: int, parameter_class: type[Parameters]) -> ModuleType:
    names = [f"x{i}" for i in range(width)]
    state = tuple(map(symbol, names))
    found = [as_expression(rate) for rate in derivative(state, symbol("u"), parameter_symbols(parameter_class))]
    by_state = jacobian(found, state)
    slots = {name: i for i, name in enumerate(parameter_names(parameter_class))}
    given = [*names, "u"]
    parts = (
        INTRINSICS,
        lines_source("rate_lines", {f"r{i}": rate for i, rate in enumerate(found)}),
        lines_source("slope_lines", {f"j{i}_{j}": by_state[i][j] for i in range(width) for j in range(width)}),
        f"load = loading({width})",
        f"rates_of = advancing({given}, {slots}, rate_lines, {width})",
        f"slopes_of = advancing({given}, {slots}, slope_lines, {width**2})",
        pasted(*FUNCTIONS, constants={"WIDTH": width}),
    )
    title = f"rates of {derivative.__name__} and their Jacobian"
    return load_kernel(f"model_{derivative.__name__}", kernel_text(title, *parts))


@dataclass(frozen=True)
class _Problem:
    """A run for a stiff solver; while it works on one piece of the drive it sees that piece's line go on forever."""

    model: ModuleType
    initial: Array
    speed: Array
    row: Array
    sample_time: float
    relative: float
    absolute: Array
    longest: float
    corners: tuple[int, ...]
    piece: NDArray[np.int64]

    @property
    def held(self) -> tuple[Array, NDArray[np.int64], float, Array]:
        return self.speed, self.piece, self.sample_time, self.row


def reference_trajectory(
    derivative: Derivative,
    initial: Array,
    speed: Array,
    parameters: Parameters,
    sample_time: float,
    *,
    scale: Array,
    relative_tolerance: float = 1e-8,
    method: Method = "LSODA",
    stop_at_corners: bool = False,
) -> Array:
    """Integrate with a stiff solver of scipy or SUNDIALS.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``.
    initial : ndarray, shape (states,)
        Initial state in SI.
    speed : ndarray, shape (n,)
        Motor speed at the samples [rad/s], linear between.
    parameters : dataclass
        The plant's parameters, as the derivative reads them.
    sample_time : float
        Seconds between samples [s].
    scale : ndarray, shape (states,)
        How much each state changes [SI]; the absolute tolerance is the relative one times this.
    relative_tolerance : float
        Local error, relative [dimensionless].
    method : {"LSODA", "Radau", "BDF", "odeint", "CVODE"}
        Which solver; CVODE needs the package scikit-sundae.
    stop_at_corners : bool
        Whether the solver stops and starts anew where the drive bends sharply, instead of taking short steps only.

    Returns
    -------
    ndarray, shape (n, states)
        States at the samples.

    Raises
    ------
    RuntimeError
        If the solver gives up.
    HydrostateError
        If CVODE is asked for and not installed.
    """
    bends = np.abs(np.diff(speed, 2)) > CORNER * np.max(np.abs(speed))
    problem = _Problem(
        _compiled(derivative, len(initial), type(parameters)),
        initial,
        np.ascontiguousarray(speed, dtype=np.float64),
        parameter_row(parameters),
        sample_time,
        relative_tolerance,
        relative_tolerance * scale,
        np.inf if stop_at_corners else 10.0 * sample_time,
        tuple((1 + np.flatnonzero(bends)).tolist()) if stop_at_corners else (),
        np.array([0, len(speed) - 1]),
    )
    if method == "odeint":
        return _by_odeint(problem)
    return _by_pieces(problem, _cvode_pieces(problem) if method == "CVODE" else _ivp_pieces(problem, method))


Pieces: TypeAlias = Callable[[Array, Array], Array]
"""``solve(times, state at the first)``: the states at the times."""


def _by_pieces(problem: _Problem, solve: Pieces) -> Array:
    states = np.empty((len(problem.speed), len(problem.initial)))
    states[0] = problem.initial
    for first, last in pairwise((0, *problem.corners, len(problem.speed) - 1)):
        problem.piece[:] = first, last
        times = np.arange(first, last + 1, dtype=np.float64) * problem.sample_time
        states[first : last + 1] = solve(times, states[first])
    return states


def _ivp_pieces(problem: _Problem, method: Literal["LSODA", "Radau", "BDF"]) -> Pieces:
    from scipy.integrate import solve_ivp

    rates, slopes, held = problem.model.rates_at, problem.model.slopes_at, problem.held

    def solve(times: Array, state: Array) -> Array:
        solution = solve_ivp(
            lambda t, x: rates(t, x, *held),
            (float(times[0]), float(times[-1])),
            state,
            method=method,
            t_eval=times,
            jac=lambda t, x: slopes(t, x, *held),
            rtol=problem.relative,
            atol=problem.absolute,
            max_step=problem.longest,
        )
        if not solution.success:
            raise RuntimeError(f"scipy's {method} stopped: {solution.message}")
        return solution.y.T

    return solve


def _by_odeint(problem: _Problem) -> Array:
    from scipy import integrate

    odeint: Any = integrate.odeint  # the stubs take no array of tolerances
    times = problem.sample_time * np.arange(len(problem.speed))
    states, notes = odeint(
        problem.model.rates_at,
        problem.initial,
        times,
        args=problem.held,
        Dfun=problem.model.slopes_at,
        rtol=problem.relative,
        atol=problem.absolute,
        tcrit=times[list(problem.corners)],
        hmax=0.0 if problem.corners or np.isinf(problem.longest) else problem.longest,
        mxstep=_MOST_STEPS,
        tfirst=True,
        full_output=True,
    )
    if notes["message"] != "Integration successful.":
        raise RuntimeError(f"scipy's odeint stopped: {notes['message']}")
    return states


def _cvode_pieces(problem: _Problem) -> Pieces:
    try:
        cvode = import_module("sksundae.cvode")
    except ModuleNotFoundError as error:
        raise HydrostateError("CVODE needs the package scikit-sundae, which is not installed") from error
    solver = cvode.CVODE(
        problem.model.fill_rates,
        jacfn=problem.model.fill_slopes,
        userdata=problem.held,
        rtol=problem.relative,
        atol=problem.absolute,
        max_num_steps=_MOST_STEPS,
        max_step=0.0 if np.isinf(problem.longest) else problem.longest,
    )

    def solve(times: Array, state: Array) -> Array:
        asked = times if len(times) > 2 else np.array([times[0], 0.5 * (times[0] + times[1]), times[1]])
        solution = solver.solve(asked, state)
        if not solution.success:
            raise RuntimeError(f"CVODE stopped: {solution.message}")
        return solution.y if len(times) > 2 else solution.y[::2]

    return solve


_MOST_STEPS = 100_000
"""Steps between two samples after which a solver gives up."""
