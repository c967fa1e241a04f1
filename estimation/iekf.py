"""The iterated extended Kalman filter: the update linearised again at its own result, compiled.

Source: Bell and Cathey (1993), the iterated update as Gauss-Newton: with the prediction z, its covariance P and the
point x_i reached so far, where ``h`` has the Jacobian ``H_i``::

    x_{i+1} = z + P H_i' (H_i P H_i' + R)^-1 (y - h(x_i) - H_i (z - x_i))

A fixed count of passes is unrolled. Nothing is linearised again but the observation: the step of the model is short,
and is left as the extended Kalman filter has it.

Every model of `estimation.eha` observes linearly in its states, and there the first pass is the last: on those the
filter *is* the extended Kalman filter, to the last bit. It differs where ``observe`` bends or a measured state is
logarithmic.
"""

from collections.abc import Sequence
from functools import cache, partial

from estimation.algebra import (
    Covariance,
    Outputs,
    Rule,
    belief_symbols,
    bounded,
    entry,
    inflation,
    observed,
    predict_expressions,
    total,
    update_expressions,
)
from estimation.compiled import run_rule
from estimation.filter import FilterProblem, Trace
from estimation.model import ProcessModel
from estimation.settings import chosen_settings
from estimation.sigma_points import is_affine
from plant.compiled.expression import ONE, ZERO, Expression, jacobian, select, symbol, unary

PASSES = 4
"""Linearisations a sample: Gauss-Newton squares its error at each, near the end."""


def iterated_update(model: ProcessModel, channels: Sequence[str], robust: str = "none") -> Outputs:
    """Return the iterated update by all channels; a missing sample (NaN) changes nothing.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How innovations that are too large count, see `estimation.algebra.inflation`; judged in the first pass.

    Returns
    -------
    dict[str, Expression]
        New value of each mean and covariance symbol, innovations ``e`` and their variances ``s`` of the first pass.
    """
    at, _ = belief_symbols(model)
    if all(is_affine(value, at) for value in observed(model, at, channels)):
        return update_expressions(model, channels, robust)
    noise = [symbol(f"r{c}") for c in range(len(channels))]
    mean, covariance, outputs, noise = _pass(model, channels, at, noise, robust)
    for _ in range(PASSES - 1):
        mean, covariance, _, _ = _pass(model, channels, bounded(model, mean), noise, "none")
    outputs |= {f"z{i}": z for i, z in enumerate(bounded(model, mean))}
    return outputs | {f"P{i}_{j}": value for (i, j), value in covariance.items()}


def _pass(
    model: ProcessModel, channels: Sequence[str], point: Sequence[Expression], noise: Sequence[Expression], robust: str
) -> tuple[list[Expression], Covariance, Outputs, list[Expression]]:
    """Update the prior by all channels, linearised at a point; return the noise variances as inflated, too."""
    prior, covariance = belief_symbols(model)
    n, mean, outputs = model.width, list(prior), Outputs()
    predicted = observed(model, point, channels)
    rows = jacobian(predicted, point)
    inflated: list[Expression] = []
    for c, H in enumerate(rows):
        y = symbol(f"y{c}")
        present = unary("present", y)
        residual = y - (predicted[c] + total([H[i] * (mean[i] - point[i]) for i in range(n)]))
        PH = [total([entry(covariance, i, j) * H[j] for j in range(n)]) for i in range(n)]
        spread = total([H[i] * PH[i] for i in range(n)])
        r = noise[c] * inflation(robust, residual * residual / (spread + noise[c]))
        variance = spread + r
        weight = select(present, ONE / variance, ZERO)
        step = weight * select(present, residual, ZERO)
        covariance = {(i, j): value - PH[i] * PH[j] * weight for (i, j), value in covariance.items()}
        mean = [z + PH[i] * step for i, z in enumerate(mean)]
        outputs |= {f"e{c}": residual, f"s{c}": variance}
        inflated.append(r)
    return mean, covariance, outputs, inflated


@cache
def iekf_rule(robust: str) -> Rule:
    """Return the iterated extended Kalman filter with outliers counting as wanted.

    Parameters
    ----------
    robust : str
        See `estimation.algebra.inflation`.

    Returns
    -------
    Rule
        The filter.
    """
    name = "iekf" if robust == "none" else f"iekf_{robust.replace('-', '_')}"
    return Rule(name, predict_expressions, partial(iterated_update, robust=robust))


def iekf(problem: FilterProblem) -> Trace:
    """Run the compiled iterated extended Kalman filter.

    Parameters
    ----------
    problem : FilterProblem
        The task.

    Returns
    -------
    Trace
        Its result.

    Raises
    ------
    HydrostateError
        If the user set something.
    """
    chosen_settings(problem, "iekf", {})
    return run_rule(iekf_rule(problem.robust), problem)
