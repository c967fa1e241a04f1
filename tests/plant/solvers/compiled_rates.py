"""A derivative and its Jacobian from the kernel of the benchmarks, as plain functions."""

from collections.abc import Callable

import numpy as np

from benchmarks.peers.compiled_model import compiled_model
from plant.arrays import Array
from plant.solvers.steps import Derivative, Parameters

Rates = Callable[[Array, float, Array], Array]


def rates_and_slopes(derivative: Derivative, width: int, parameter_class: type[Parameters]) -> tuple[Rates, Rates]:
    kernel = compiled_model(derivative, width, parameter_class)

    def rates(state: Array, u: float, parameters: Array) -> Array:
        result = np.empty(width)
        kernel.rates(state, u, parameters, result)
        return result

    def slopes(state: Array, u: float, parameters: Array) -> Array:
        result = np.empty((width, width))
        kernel.slopes(state, u, parameters, result)
        return result

    return rates, slopes
