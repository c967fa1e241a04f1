"""The loop that runs a user's equations along a log, with exact sensitivities, as a plain function.

`estimation.equations.kernel` pastes it into a kernel file. Its parameter ``kernel`` stands for that file's contents.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from estimation.arrays import Array


class EquationsKernel(Protocol):
    """Interface of a model's compiled kernel.

    A point is a tuple with one row for each state: the state, and its derivatives by the unknowns.

    Attributes
    ----------
    UNKNOWNS, OUTPUTS : int
        Numbers of unknowns and outputs.
    settle, begin : callable
        From unknowns and known numbers: the values that are constant over all steps, and the point at the first sample.
    step : callable
        ``step(point, fixed, before, after, start, end, h)``: the point ``h`` [s] later, while the inputs go from one
        fraction of the interval between samples to another [fraction].
    observe : callable
        ``observe(point, fixed, after, shown)``: fill in the outputs, and their derivatives.
    """

    UNKNOWNS: int
    OUTPUTS: int
    settle: Callable[[Array, Array], Any]
    begin: Callable[[Array, Array], Any]
    step: Callable[[Any, Any, Array, Array, float, float, float], Any]
    observe: Callable[[Any, Any, Array, Array], None]


def run(
    kernel: EquationsKernel,
    values: Array,
    known: Array,
    inputs: Array,
    sample_time: float,
    substeps: int,
    predicted: Array,
    slopes: Array,
) -> None:
    """Fill in the equations' prediction at every sample.

    Parameters
    ----------
    values : ndarray, shape (unknowns,)
        Fitted parameters, then fitted initial states [each its unit].
    known : ndarray, shape (known,)
        Known parameters, then known initial states [each its unit]; at least one number.
    inputs : ndarray, shape (n, inputs)
        Inputs at the samples [their units].
    sample_time : float
        Seconds between samples [s].
    substeps : int
        Steps between samples.
    predicted : ndarray, shape (outputs, n)
        Output for the predicted outputs.
    slopes : ndarray, shape (slopes, samples, unknowns)
        Output for their derivatives, or empty.
    """
    shown = np.zeros((kernel.OUTPUTS, 1 + kernel.UNKNOWNS))
    fixed, point = kernel.settle(values, known), kernel.begin(values, known)
    h = sample_time / substeps
    for k in range(inputs.shape[0]):
        if k > 0:
            for j in range(substeps):
                start, end = j / substeps, (j + 1.0) / substeps
                point = kernel.step(point, fixed, inputs[k - 1], inputs[k], start, end, h)
        kernel.observe(point, fixed, inputs[k], shown)
        for i in range(kernel.OUTPUTS):
            predicted[i, k] = shown[i, 0]
            if slopes.size > 0:
                slopes[i, k] = shown[i, 1:]
