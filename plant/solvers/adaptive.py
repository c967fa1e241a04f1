"""Runs in steps of controlled error: short ones at corners, long ones where all is quiet; many runs side by side."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from plant.arrays import Array
from plant.solvers.adaptive_kernel import compile_adaptive
from plant.solvers.steps import Derivative, Parameters

LANES = 8
"""Trajectories side by side in one kernel, as many as a vector register of 512 bits holds."""

TOLERANCE = 2e-6
"""Error of a step, root mean square over the states relative to their sizes; whole runs stay within 1e-4 by it."""

SMOOTH = 10.0
"""Multiple of the tolerance by which a drive may leave the parabola that one step follows, relative to its size:
what it leaves swings about that parabola, and next to nothing of it remains over a step."""

STRAIGHT, SAMPLES, MEANS = 0.0, 1.0 / 12.0, 1.0 / 8.0
"""By how much straight lines through a drive's samples exceed its mean over a sample time, over its second difference
[dimensionless], by Taylor's series: where the drive is those lines, where the samples lie on a curve, and where each is
the mean of a curve over the sample time about it."""


@dataclass(frozen=True)
class ErrorControl:
    """Functions of a plant that error-controlled steps need.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``.
    scales : callable
        ``scales(parameter row)``: the size of each state that errors are relative to [its SI unit]. Of several runs
        side by side the first one's hold.
    drive_scale : callable
        ``drive_scale(parameter row)``: the size of the drive [its SI unit].
    shortest : callable
        ``shortest(parameter rows)``: step [s] that is taken whatever its error.
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
    """Run a plant along a drive in steps of controlled error, for one or many sets of parameters side by side.

    The steps are common to up to `LANES` trajectories: as short as the hardest of them asks.

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
        By how much steps may smooth the drive, relative to its size [dimensionless]; `SMOOTH` times the
        tolerance if not given.
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
    """Yield what `controlled_run` returns, up to `LANES` runs at a time, which takes less memory.

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
        By how much steps may smooth the drive [dimensionless].
    longest : float
        Longest step [s].
    bulge : float
        `STRAIGHT`, `SAMPLES` or `MEANS`: what the drive does between samples [dimensionless].

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
