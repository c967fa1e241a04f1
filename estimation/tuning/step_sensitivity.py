"""Exact sensitivities of a run to parameters: the differentiated step function carries them along as states."""

from collections.abc import Sequence
from typing import Any

from plant.compiled.expression import ZERO, Expression, jacobian
from plant.compiled.functions import Scalar
from plant.solvers.steps import StepFunction


def sensitivity_step(step: StepFunction, width: int, names: Sequence[str]) -> StepFunction:
    """Return a step whose state is the plant's state and its derivatives by some parameters, one after the other.

    The derivatives are those of the discrete run, not of the continuous equations, so a least-squares fit's Jacobian is
    exact.

    Parameters
    ----------
    step : callable
        ``step(state, drives, parameters, h)``, see `plant.solvers.steps.StepFunction`.

    Returns
    -------
    callable
        A step on ``width * (1 + len(names))`` states: the plant's, then their derivatives by each parameter.
    """

    def carried(state: Sequence[Scalar], drives: tuple[Scalar, Scalar], p: Any, h: Scalar) -> tuple[Scalar, ...]:
        own = tuple(state[:width])
        new = step(own, drives, p, h)
        by_state = jacobian(new, own)
        by_parameter = jacobian(new, [getattr(p, name) for name in names])
        result: list[Expression] = list(new)
        for j in range(len(names)):
            along = state[width * (j + 1) : width * (j + 2)]
            for i in range(width):
                total = by_parameter[i][j]
                for slope, direction in zip(by_state[i], along, strict=True):
                    total = total if slope is ZERO else total + slope * direction
                result.append(total)
        return tuple(result)

    return carried
