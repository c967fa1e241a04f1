"""Stiff solvers of scipy and SUNDIALS on a compiled model with its analytic Jacobian: the peers of our kernels.

Finite-difference Jacobians across ``sign(v)`` give grossly wrong runs from rest, so none are used. To avoid missing a
corner of the drive, a solver stops at each corner or takes no step longer than ten samples.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from itertools import pairwise
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.compiled_model import compiled_model
from plant.arrays import Array
from plant.compiled.native.load import NativeKernel
from plant.errors import HydrostateError
from plant.solvers.steps import Derivative, Parameters, parameter_row

Method: TypeAlias = Literal["LSODA", "Radau", "BDF", "odeint", "CVODE"]
"""Scipy's three stiff methods of ``solve_ivp``, its ``odeint`` (LSODA without the overhead), SUNDIALS' CVODE."""

CORNER_BEND = 1e-2
"""Bend of the drive, relative to its largest value, at which a solver may stop."""


@dataclass(frozen=True)
class _Problem:
    """A run for a stiff solver; during one piece of the drive, the line of that piece extends without limit."""

    kernel: NativeKernel
    initial: Array
    speed: Array
    row: Array
    sample_time: float
    relative: float
    absolute: Array
    longest: float
    corners: tuple[int, ...]
    piece: NDArray[np.int64]

    @cached_property
    def rates(self) -> "OfTime":
        return self._as_function_of_time(self.kernel.rates_at, len(self.initial))

    @cached_property
    def slopes(self) -> "OfTime":
        return self._as_function_of_time(self.kernel.slopes_at, len(self.initial), len(self.initial))

    def _as_function_of_time(self, entry: Any, *shape: int) -> "OfTime":
        """Return rates or slopes as a function of time and state, at the cost of a call and two small copies."""
        at, state, result = np.empty(1), np.empty(len(self.initial)), np.empty(shape)
        call = entry.prepared_call(at, state, self.speed, self.piece, self.sample_time, self.row, result)

        def of_time(t: float, x: Array) -> Array:
            at[0] = t
            state[:] = x
            call()
            return result.copy()

        return of_time


OfTime: TypeAlias = Callable[[float, Array], Array]


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
        Motor speed at the samples [rad/s], linearly interpolated.
    parameters : dataclass
        The plant's parameters, as the derivative reads them.
    sample_time : float
        Seconds between samples [s].
    scale : ndarray, shape (states,)
        Typical change of each state [SI]; the absolute tolerance is the relative one times this.
    relative_tolerance : float
        Local error, relative [dimensionless].
    method : {"LSODA", "Radau", "BDF", "odeint", "CVODE"}
        Which solver; CVODE needs the package scikit-sundae.
    stop_at_corners : bool
        Whether the solver stops and restarts at sharp corners of the drive, instead of only taking short steps.

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
    bends = np.abs(np.diff(speed, 2)) > CORNER_BEND * np.max(np.abs(speed))
    problem = _Problem(
        compiled_model(derivative, len(initial), type(parameters)),
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
"""``solve(times, state at the first)``: returns the states at the times."""


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

    def solve(times: Array, state: Array) -> Array:
        solution = solve_ivp(
            problem.rates,
            (float(times[0]), float(times[-1])),
            state,
            method=method,
            t_eval=times,
            jac=problem.slopes,
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

    odeint: Any = integrate.odeint  # the stubs do not accept an array of tolerances
    times = problem.sample_time * np.arange(len(problem.speed))
    states, notes = odeint(
        problem.rates,
        problem.initial,
        times,
        Dfun=problem.slopes,
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

    def fill_rates(t: float, state: Array, result: Array) -> None:
        result[:] = problem.rates(t, state)

    def fill_slopes(t: float, state: Array, known: Array, result: Array) -> None:  # noqa: ARG001  CVODE passes them
        result[:] = problem.slopes(t, state)

    solver = cvode.CVODE(
        fill_rates,
        jacfn=fill_slopes,
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
"""Maximum steps between two samples before a solver gives up."""
