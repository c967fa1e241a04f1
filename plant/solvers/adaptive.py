"""Runs in error-controlled steps: short at corners and long in quiet intervals; many runs side by side."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from plant.arrays import Array
from plant.solvers.adaptive_kernel import compile_adaptive
from plant.solvers.steps import Derivative, Parameters

LANES = 8
"""Number of trajectories side by side in one kernel, as many as fit in a 512-bit vector register."""

TOLERANCE = 2e-6
"""Error of a step, root mean square over the states relative to their sizes; it keeps whole runs within 1e-4."""

SMOOTH = 10.0
"""Multiple of the tolerance by which a drive may deviate from the parabola that one step follows, relative to its size:
the deviation oscillates about the parabola, and its effect over a step almost vanishes."""

STRAIGHT, SAMPLES, MEANS = 0.0, 1.0 / 12.0, 1.0 / 8.0
"""Excess of straight lines through a drive's samples over its mean over a sample time, divided by its second difference
[dimensionless], by Taylor's series. The first holds if the drive is those lines, the second if the samples lie on a
curve, the third if each sample is the mean of a curve over the sample time around it."""


@dataclass(frozen=True)
class ErrorControl:
    """Functions of a plant for error-controlled steps.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``.
    scales : callable
        ``scales(parameter row)``: the size of each state, to which errors are relative [its SI unit]. For several runs
        side by side, the sizes of the first run hold.
    drive_scale : callable
        ``drive_scale(parameter row)``: the size of the drive [its SI unit].
    shortest : callable
        ``shortest(parameter rows)``: the step [s] that is accepted whatever its error.
    """

    derivative: Derivative
    scales: Callable[[Array], Array]
    drive_scale: Callable[[Array], float]
    shortest: Callable[[Array], float]


def controlled_run(
    name: str,
    control: ErrorControl,
    starts: Array,
    speed: Array,
    parameters: Array,
    sample_time: float,
    parameter_class: type[Parameters],
    *,
    tolerance: float = TOLERANCE,
    drive_tolerance: float | None = None,
    longest: float = np.inf,
) -> Array:
    """Run a plant along a drive in error-controlled steps, for one or many sets of parameters side by side.

    Up to `LANES` trajectories share the same steps, which are as short as the most demanding trajectory requires.

    Parameters
    ----------
    starts : ndarray, shape (runs, states)
        Initial states in SI.
    speed : ndarray, shape (n,)
        Drive at the samples [its SI unit], linear between.
    parameters : ndarray, shape (1 or n, runs, parameters)
        Parameter rows, each of which holds until the next sample.
    sample_time : float
        Seconds between samples [s].
    tolerance : float
        Error of a step relative to the states' sizes [dimensionless].
    drive_tolerance : float, optional
        Amount by which steps may smooth the drive, relative to its size [dimensionless]; `SMOOTH` times the tolerance
        if not given.
    longest : float
        Longest step [s].

    Returns
    -------
    ndarray, shape (runs, n, states)
        States at the samples.
    """
    found = [
        *controlled_groups(
            name,
            control,
            starts,
            speed,
            parameters,
            sample_time,
            parameter_class,
            tolerance=tolerance,
            drive_tolerance=drive_tolerance,
            longest=longest,
        )
    ]
    return np.moveaxis(found[0] if len(found) == 1 else np.concatenate(found, axis=2), 2, 0)


def controlled_groups(
    name: str,
    control: ErrorControl,
    starts: Array,
    speed: Array,
    parameters: Array,
    sample_time: float,
    parameter_class: type[Parameters],
    *,
    tolerance: float = TOLERANCE,
    drive_tolerance: float | None = None,
    longest: float = np.inf,
    bulge: float = STRAIGHT,
) -> Iterator[Array]:
    """Yield the result of `controlled_run`, up to `LANES` runs at a time, which takes less memory.

    Parameters
    ----------
    starts : ndarray, shape (runs, states)
        Initial states in SI.
    speed : ndarray, shape (n,)
        Drive at the samples [its SI unit].
    parameters : ndarray, shape (1 or n, runs, parameters)
        Parameter rows.
    sample_time : float
        Seconds between samples [s].
    tolerance : float
        Error of a step [dimensionless].
    drive_tolerance : float, optional
        Amount by which steps may smooth the drive [dimensionless].
    longest : float
        Longest step [s].
    bulge : float
        `STRAIGHT`, `SAMPLES` or `MEANS`: the course of the drive between samples [dimensionless].

    Yields
    ------
    ndarray, shape (n, states, some runs)
        States at the samples, as they lie in memory.
    """
    runs, width = starts.shape
    bend = SMOOTH * tolerance if drive_tolerance is None else drive_tolerance
    scales = control.scales(parameters[0, 0])
    shortest = control.shortest(parameters.reshape(-1, parameters.shape[2])) / sample_time
    for first in range(0, runs, LANES):
        block = list(range(first, min(first + LANES, runs)))
        lanes = 1 if len(block) == 1 else LANES
        filled = block + [first] * (lanes - len(block))
        states = np.empty((len(speed), width, len(block)))
        run = compile_adaptive(name, control.derivative, width, parameter_class, lanes)
        run(
            np.ascontiguousarray(starts[filled].T),
            speed,
            np.ascontiguousarray(parameters) if lanes == runs else np.take(parameters, filled, axis=1),
            sample_time,
            1.0 / (tolerance * scales),
            bend * control.drive_scale(parameters[0, 0]),
            bulge,
            min(longest / sample_time, float(len(speed))),
            min(shortest, longest / sample_time),
            states,
        )
        yield states
