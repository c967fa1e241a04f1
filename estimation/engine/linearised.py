"""One step of a model with its analytic Jacobian, compiled, for filters that work on arrays."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from typing import TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.engine.kalman import bounded_mean, scaled_step
from estimation.engine.parts import function_source
from estimation.models.model import ProcessModel
from plant.compiled.expression import ZERO, Expression
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text

Fill: TypeAlias = Callable[[Array, Array, Array, Array, float, float, float, Array, Array], None]
"""``fill(mean, start, end, parameters, h, j, share, moved, slopes)``: compute the new mean and its Jacobian."""


def step(mean: Array, start: Array, end: Array, parameters: Array, h: float, *, fill: Fill) -> tuple[Array, Array]:
    """Return the mean one step later and the Jacobian, in the filter's units.

    Parameters
    ----------
    mean : ndarray, shape (n,)
        Belief before the step [scaled].
    start, end : ndarray, shape (drives,)
        Drives at both ends of the step [SI].
    parameters : ndarray, shape (parameters,)
        Parameter row [SI].
    h : float
        Step [s].

    Returns
    -------
    tuple of ndarray
        Shapes (n,) and (n, n) [scaled].
    """
    moved, slopes = np.zeros(mean.shape[0]), np.zeros((mean.shape[0], mean.shape[0]))
    fill(mean, start, end, parameters, h, 0.0, 1.0, moved, slopes)
    return moved, slopes


@cache
def compile_step(model: ProcessModel) -> NativeKernel:
    """Generate one step of a model with its analytic Jacobian, for filters that work on arrays.

    Returns
    -------
    NativeKernel
        ``step(mean (n,), drives at start (d,), drives at end (d,), parameter row, h)``, which returns the new mean and
        the Jacobian, both in the filter's units.
    """
    n = model.width
    mean, F = scaled_step(model)
    outputs: Mapping[str, Expression] = {f"m{i}": z for i, z in enumerate(bounded_mean(model, mean))} | {
        f"f{i}_{k}": F[i][k] for i in range(n) for k in range(n) if F[i][k] is not ZERO
    }
    reads = {f"z{i}": f"mean[{i}]" for i in range(n)}
    reads |= {
        f"{x}{i}": f"{array}[{i}]" for i in range(len(model.drives)) for x, array in (("a", "start"), ("b", "end"))
    }
    reads |= {field.name: f"parameters[{i}]" for i, field in enumerate(fields(model.parameters))}
    writes = {
        name: f"moved[{name[1:]}]" if name[0] == "m" else f"slopes[{name[1:].replace('_', ', ')}]" for name in outputs
    }
    arguments = "mean, start, end, parameters, h, j, share, moved, slopes"
    parts = (function_source("fill", arguments, reads, outputs, writes), functions_text(step))
    title = f"one step of the {model.name} form, and its Jacobian, in scaled units"
    return load_native(f"step_{model.name}", kernel_text(title, *parts), {"step": signature_of(step)})
