"""Grey-box models: physics with unknown parameters, predicted over a whole log together with exact sensitivities.

The model's step is traced once; its derivatives by state and unknown parameters are written beside it, so one pass over
the log gives the prediction and its whole Jacobian. `estimation.greybox_fit` finds the unknowns.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.expression import ONE, Expression, as_expression, jacobian, symbol, unary
from plant.compiled.functions import Scalar
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import statements
from plant.integrate import PARAMETER_NAMES, parameter_symbols, ros2_step

Array = NDArray[np.float64]
Prediction: TypeAlias = Callable[[Array, Array, Array, Array, float, NDArray[np.int64], int], tuple[Array, Array]]
"""``run(theta (unknowns,), drives (n, channels), measured (n, outputs), parameter row, sample time [s], steps (n,) up
to each sample, samples a block)``, which returns what the prediction exceeds the measured by, a mean over those samples
of each block that are present, shape (blocks, outputs), and its derivatives by theta, (blocks, outputs, unknowns)."""


@dataclass(frozen=True)
class GreyBoxModel:
    """A model whose unknown parameters are fitted to a log.

    Unknowns are fitted as logarithms: they stay positive, and a start that is wrong by a factor is as near as one that
    is wrong by its inverse. One that may be negative is fitted as it is, in units of a typical size.

    Parameters
    ----------
    name : str
        Name, for the kernel's file.
    drives : tuple of str
        Channels that drive the model; linear between samples.
    outputs : tuple of str
        Channels that are fitted.
    unknowns : tuple of str
        Parameters that are fitted.
    initial : callable
        ``initial(parameters)``: the state before the first sample, in SI.
    rates : callable
        ``rates(state, drives, parameters, share)`` in SI a second, where drives holds each channel's value at start and
        end of a step, then the step's length [s], and share is how far into the step [fraction].
    observe : callable
        ``observe(state)``: the predicted outputs in SI.
    linear : tuple of (str, float)
        The unknowns that may be negative, each with a typical size in SI.
    """

    name: str
    drives: tuple[str, ...]
    outputs: tuple[str, ...]
    unknowns: tuple[str, ...]
    initial: Callable[[Any], tuple[Scalar, ...]]
    rates: Callable[[Any, Any, Any, Scalar], tuple[Scalar, ...]]
    observe: Callable[[Any], tuple[Scalar, ...]]
    linear: tuple[tuple[str, float], ...] = ()

    def theta(self, values: Mapping[str, float]) -> Array:
        """Return the fitted coordinates of the unknowns.

        Parameters
        ----------
        values : Mapping[str, float]
            The unknowns in SI.

        Returns
        -------
        ndarray, shape (unknowns,)
            Logarithms, or multiples of the typical size [dimensionless].
        """
        sizes = dict(self.linear)
        return np.array(
            [values[name] / sizes[name] if name in sizes else np.log(values[name]) for name in self.unknowns]
        )

    def values(self, theta: Array) -> Mapping[str, float]:
        """Return the unknowns from their fitted coordinates.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Logarithms, or multiples of the typical size [dimensionless].

        Returns
        -------
        Mapping[str, float]
            The unknowns in SI.
        """
        sizes = dict(self.linear)
        return {
            name: float(t * sizes[name] if name in sizes else np.exp(t))
            for name, t in zip(self.unknowns, theta, strict=True)
        }


_KERNEL = '''"""Generated: prediction of the {name} model and its sensitivities."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={{"reassoc", "contract", "nsz"}})
def run(theta, drives, measured, parameters, sample_time, substeps, block):
    n = drives.shape[0]
    blocks = (n + block - 1) // block
    excess = np.zeros((blocks, {outputs}))
    slopes = np.zeros((blocks, {outputs}, {unknowns}))
    present = np.zeros({outputs})
    share = 0.0
{load}
{begin}
    for k in range(n):
        if k > 0:
            h = sample_time / substeps[k]
            for j in range(substeps[k]):
                f_start = j / substeps[k]
                f_end = (j + 1.0) / substeps[k]
{between}
{step}
        b = k // block
{observe}
        if (k + 1) % block == 0 or k == n - 1:
            for i in range({outputs}):
                if present[i] > 1.0:
                    excess[b, i] /= present[i]
                    slopes[b, i] /= present[i]
                present[i] = 0.0
    return excess, slopes
'''


@cache
def compile_prediction(model: GreyBoxModel) -> Prediction:
    """Generate the kernel that predicts a log and differentiates the prediction.

    Parameters
    ----------
    model : GreyBoxModel
        The model; it is stepped by ROS2, second order and L-stable.

    Returns
    -------
    callable
        See `Prediction`.
    """
    theta = [symbol(f"theta{i}") for i in range(len(model.unknowns))]
    sizes = dict(model.linear)
    fitted = {
        name: t * sizes[name] if name in sizes else unary("exp", t)
        for name, t in zip(model.unknowns, theta, strict=True)
    }
    p = SimpleNamespace(**{**vars(parameter_symbols()), **fitted})
    start = [as_expression(value) for value in model.initial(p)]
    state = [symbol(f"x{i}") for i in range(len(start))]
    moved = _step(model, state, p)
    outputs = [as_expression(value) for value in model.observe(tuple(state))]
    source = _KERNEL.format(
        name=model.name,
        outputs=len(outputs),
        unknowns=len(theta),
        load="\n".join(
            [f"    {name} = parameters[{i}]" for i, name in enumerate(PARAMETER_NAMES)]
            + [f"    theta{i} = theta[{i}]" for i in range(len(theta))]
        ),
        begin=statements(_named(start) | _sensitivities(start, [], theta), "    "),
        between="\n".join(
            f"                {end}{i} = drives[k - 1, {i}] + f_{when} * (drives[k, {i}] - drives[k - 1, {i}])"
            for i in range(len(model.drives))
            for end, when in (("a", "start"), ("b", "end"))
        ),
        step=statements(_named(moved) | _sensitivities(moved, state, theta), " " * 16),
        observe=_observation(outputs, state, theta),
    )
    return load_kernel(f"fit_{model.name}", source).run


def _step(model: GreyBoxModel, state: Sequence[Expression], p: SimpleNamespace) -> list[Expression]:
    """Return the state after one step, with the share of the step that has passed as the scheme's input."""
    drives = (*((symbol(f"a{i}"), symbol(f"b{i}")) for i in range(len(model.drives))), symbol("h"))

    def rates(now: Any, share: Scalar, parameters: Any) -> tuple[Scalar, ...]:
        return tuple(as_expression(rate) for rate in model.rates(now, drives, parameters, share))

    return [as_expression(value) for value in ros2_step(rates)(tuple(state), (symbol("share"), ONE), p, symbol("h"))]


def _named(values: Sequence[Expression]) -> dict[str, Expression]:
    return {f"x{i}": value for i, value in enumerate(values)}


def _sensitivities(
    values: Sequence[Expression], state: Sequence[Expression], theta: Sequence[Expression]
) -> dict[str, Expression]:
    """Return the chain rule ``S' = F S + G`` for every value and unknown."""
    by_state, by_theta = jacobian(values, state), jacobian(values, theta)
    outputs: dict[str, Expression] = {}
    for i in range(len(values)):
        for j in range(len(theta)):
            total = by_theta[i][j]
            for m in range(len(state)):
                total = total + by_state[i][m] * symbol(f"s{m}_{j}")
            outputs[f"s{i}_{j}"] = total
    return outputs


def _observation(outputs: Sequence[Expression], state: Sequence[Expression], theta: Sequence[Expression]) -> str:
    slopes = _sensitivities(outputs, state, theta)
    named = {f"y{i}": output for i, output in enumerate(outputs)} | {f"d{name}": s for name, s in slopes.items()}
    lines = [statements(named, " " * 8)]
    for i in range(len(outputs)):
        lines += [
            f"        if measured[k, {i}] == measured[k, {i}]:",
            f"            present[{i}] += 1.0",
            f"            excess[b, {i}] += y{i} - measured[k, {i}]",
            *(f"            slopes[b, {i}, {j}] += ds{i}_{j}" for j in range(len(theta))),
        ]
    return "\n".join(lines)
