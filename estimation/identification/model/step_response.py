"""The step response of a linear model, with its uncertainty from the covariance."""

from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.finding import NORMAL_95
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure, sensitivities

DIFFERENCE_STEP = 1e-2
"""Step of a finite difference, in standard deviations of the coefficient [dimensionless], judged."""


@dataclass(frozen=True, eq=False)
class StepResponse:
    """Response of an output at rest to a unit step at time zero.

    Parameters
    ----------
    time : ndarray, shape (n,)
        From the step on [s].
    response : ndarray, shape (n,)
        Output [output unit per input unit].
    std : ndarray, shape (n,)
        Its standard deviation, first order in the covariance; NaN where that is not known.
    """

    time: Array
    response: Array
    std: Array

    @property
    def band95(self) -> tuple[Array, Array]:
        """Lowest and highest response of the pointwise 95 % interval, shape (n,) each [output unit per input unit]."""
        return self.response - NORMAL_95 * self.std, self.response + NORMAL_95 * self.std


def step_response(model: LinearModel, count: int) -> StepResponse:
    """Return the step response of a linear model, dead time included.

    Parameters
    ----------
    count : int
        Samples [count].

    Examples
    --------
    >>> model = LinearModel([0.0, 0.2], [1.0, -0.8], 0.01, "u", "y", delay=1, covariance=[[1e-4, 0.0], [0.0, 0.0]])
    >>> found = step_response(model, 3)
    >>> found.response.round(3).tolist(), found.std.round(4).tolist()
    ([0.0, 0.2, 0.36], [0.0, 0.01, 0.018])
    """
    step = np.ones(count)
    plain = replace(model, offset=0.0, initial_state=np.empty(0))
    response = plain.simulate(step)
    gradient = _difference_slopes(plain, step) if model.continuous else _exact_slopes(plain, step)
    with np.errstate(invalid="ignore"):
        std = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", gradient, model.covariance, gradient), 0.0))
    return StepResponse(model.sample_time * np.arange(count, dtype=np.float64), response, std)


def _exact_slopes(model: LinearModel, step: Array) -> Array:
    """Return the derivative of the response by the coefficients, shape (n, p)."""
    structure = Structure(model.free_numerator.size, model.denominator.size - 1, model.delay)
    theta = np.concatenate([model.free_numerator, model.denominator[1:], np.zeros(structure.n_initial)])
    return sensitivities(structure, theta, step)[:, : model.covariance.shape[0]]


def _difference_slopes(model: LinearModel, step: Array) -> Array:
    """Return that derivative of a model in continuous time, by central differences."""
    values = np.concatenate([model.free_numerator, model.denominator[1:]])
    stds = np.sqrt(np.diag(model.covariance))
    columns: list[Array] = []
    for place, std in enumerate(stds):
        both: list[Array] = []
        for side in (-1.0, 1.0):
            moved = values.copy()
            moved[place] += side * DIFFERENCE_STEP * std
            b, f = moved[: model.free_numerator.size], np.concatenate([[1.0], moved[model.free_numerator.size :]])
            both.append(replace(model, numerator=b, denominator=f).simulate(step) if std > 0.0 else np.zeros(step.size))
        columns.append((both[1] - both[0]) / (2.0 * DIFFERENCE_STEP * std) if std > 0.0 else np.full(step.size, std))
    return np.column_stack(columns)
