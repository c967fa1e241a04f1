"""One step of a model with its analytic Jacobian, compiled, for filters that work on arrays."""

from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from types import ModuleType

from estimation.algebra import bounded, scaled_step
from estimation.model import ProcessModel
from plant.compiled.expression import ZERO, Expression
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import statements

_LINEARISED = '''"""Generated: one step of the {name} form, and its Jacobian, in scaled units."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def step(mean, start, end, parameters, h):
    moved = np.zeros({width})
    slopes = np.zeros(({width}, {width}))
    j, share = 0.0, 1.0
{load}
{body}
{store}
    return moved, slopes
'''


@cache
def compile_step(model: ProcessModel) -> ModuleType:
    """Generate one step of a model with its analytic Jacobian, for filters that work on arrays.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    ModuleType
        ``step(mean (n,), drives at start (d,), drives at end (d,), parameter row, h)``, which returns the new mean and
        the Jacobian, both in the filter's units.
    """
    n = model.width
    mean, F = scaled_step(model)
    outputs: Mapping[str, Expression] = {f"m{i}": z for i, z in enumerate(bounded(model, mean))} | {
        f"f{i}_{k}": F[i][k] for i in range(n) for k in range(n) if F[i][k] is not ZERO
    }
    load = [f"    z{i} = mean[{i}]" for i in range(n)]
    load += [
        f"    {x}{i} = {array}[{i}]" for i in range(len(model.drives)) for x, array in (("a", "start"), ("b", "end"))
    ]
    load += [f"    {field.name} = parameters[{i}]" for i, field in enumerate(fields(model.parameters))]
    store = [f"    moved[{name[1:]}] = {name}" for name in outputs if name[0] == "m"]
    store += [f"    slopes[{name[1:].replace('_', ', ')}] = {name}" for name in outputs if name[0] == "f"]
    source = _LINEARISED.format(
        name=model.name,
        width=n,
        load="\n".join(load),
        body=statements(outputs, " " * 4),
        store="\n".join(store),
    )
    return load_kernel(f"step_{model.name}", source)
