"""Trajectories of the piezo-stack actuator: one, or several side by side (equations 1 to 22)."""

from collections.abc import Iterator, Sequence

import numpy as np

from plant.arrays import Array
from plant.piezo_stack.model import STATES, StackValues, at_bias, stack_step
from plant.piezo_stack.parameters import LONGEST_STEP, PiezoStackParameters
from plant.runs import require_finite, steps_a_sample
from plant.solvers.fixed_step_kernel import compile_fixed_step
from plant.solvers.steps import parameter_row

NAME = "piezo-stack"
"""Name of the plant on the command line and in metadata."""

LANES = 8
"""Number of actuators that run side by side."""


def stack_row(parameters: StackValues) -> Array:
    """Return the parameters as an array, in the order of their fields (errata P17).

    Parameters
    ----------
    parameters : PiezoStackParameters or namespace
        The actuator. A namespace with the same names may hold values that no actuator has, such as a negative leakage.

    Returns
    -------
    ndarray, shape (parameters,)
        Parameter values in SI.
    """
    return parameter_row(parameters, PiezoStackParameters)


def run_stack(
    parameters: StackValues, voltage: Array, sample_time: float, *, longest_step: float = LONGEST_STEP
) -> Array:
    """Return the states of a run from rest at the bias pressure, by classical Runge-Kutta steps (equations 1 to 22).

    Parameters
    ----------
    parameters : PiezoStackParameters or namespace
        The actuator. A namespace with the same names may hold values that no actuator has, such as a negative leakage.
    voltage : ndarray, shape (n,)
        Drive at the samples [V], linearly interpolated.
    sample_time : float
        Seconds between samples [s].
    longest_step : float
        Longest step [s].

    Returns
    -------
    ndarray, shape (n, 19)
        States at the samples, as named in `plant.piezo_stack.model.STATES`.

    Raises
    ------
    HydrostateError
        If the state stops being finite.
    """
    (states,) = run_stacks([parameters], voltage, sample_time, longest_step=longest_step)
    require_finite(states, sample_time, NAME)
    return states


def run_stacks(
    parameters: Sequence[StackValues], voltages: Array, sample_time: float, *, longest_step: float = LONGEST_STEP
) -> Iterator[Array]:
    """Run several actuators from rest at their bias, eight side by side; results match `run_stack` to the last bit.

    Parameters
    ----------
    parameters : sequence of PiezoStackParameters or namespace
        The actuators, as in `run_stack`.
    voltages : ndarray, shape (n,) or (n, actuators)
        Drive at the samples [V], one for all actuators or one for each.
    sample_time : float
        Seconds between samples [s].
    longest_step : float
        Longest step [s].

    Yields
    ------
    ndarray, shape (n, 19)
        States of each actuator; not finite where a run stopped being so.
    """
    drives = np.broadcast_to(voltages.reshape(len(voltages), -1), (len(voltages), len(parameters)))
    for first in range(0, len(parameters), LANES):
        some = parameters[first : first + LANES]
        drive = drives[:, first : first + LANES]
        starts = np.column_stack([at_bias(p, float(u)) for p, u in zip(some, drive[0], strict=True)])
        rows = np.array([stack_row(p) for p in some])
        states = run_rows(rows, starts, drive, sample_time, longest_step=longest_step)
        yield from (states[:, :, lane] for lane in range(len(some)))


def run_rows(
    rows: Array, starts: Array, voltages: Array, sample_time: float, *, longest_step: float = LONGEST_STEP
) -> Array:
    """Run actuators given as parameter rows, eight side by side; a single actuator has its own kernel.

    Parameters
    ----------
    rows : ndarray, shape (actuators, parameters)
        Parameter rows, as `stack_row` returns them.
    starts : ndarray, shape (19, actuators)
        Initial states.
    voltages : ndarray, shape (n, actuators)
        Drive at the samples [V], linearly interpolated.
    sample_time : float
        Seconds between samples [s].
    longest_step : float
        Longest step [s].

    Returns
    -------
    ndarray, shape (n, 19, actuators)
        States at the samples; not finite from where a run failed.
    """
    count = len(rows)
    lanes = LANES if count > 1 else 1
    run = compile_fixed_step("piezo_stack", stack_step, len(STATES), PiezoStackParameters, lanes)
    states = np.empty((len(voltages), len(STATES), count))
    substeps = steps_a_sample(sample_time, longest_step)
    for first in range(0, count, lanes):
        lane = np.minimum(np.arange(first, first + lanes), count - 1)  # spare lanes get copies of the last run
        initial, drive = (np.ascontiguousarray(values[:, lane], dtype=np.float64) for values in (starts, voltages))
        part = states if count <= lanes else np.empty((len(voltages), len(STATES), min(lanes, count - first)))
        run(initial, drive, rows[lane], sample_time, substeps, part)
        if part is not states:
            states[:, :, first : first + lanes] = part
    return states
