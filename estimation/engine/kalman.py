"""The algebra of filters, as expressions: a model's scaled step, prediction and update of mean and covariance.

Structural zeros and ones of the Jacobian are eliminated, symmetric covariances are stored once, and measurements are
processed one channel at a time, so no matrix is inverted and no absolute jitter is needed. `estimation.engine.kernels`
compiles a filter from a rule, alone or in lanes; a new rule needs no kernel of its own.
"""

from collections.abc import Sequence
from typing import TypeAlias

from estimation.models.model import OPENING, ProcessModel, StateVariable
from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import ZERO, Expression, as_expression, symbol
from plant.compiled.functions import exp, log, where
from plant.solvers.steps import parameter_symbols

Covariance: TypeAlias = dict[tuple[int, int], Expression]
"""Upper triangle: ``P[i, j]`` with i <= j."""

Mean: TypeAlias = Sequence[Expression]
Outputs: TypeAlias = dict[str, Expression]
"""New values by the name of the symbol that they replace, and any further results of a rule by name."""


def entry(P: Covariance, i: int, j: int) -> Expression:
    """Return an element of a symmetric matrix.

    Parameters
    ----------
    P : dict
        Its upper triangle.
    """
    return P[min(i, j), max(i, j)]


def total(terms: Sequence[Expression]) -> Expression:
    """Return the sum of terms, in the given order."""
    return sum(terms, ZERO)


def belief_symbols(model: ProcessModel) -> tuple[list[Expression], Covariance]:
    """Return the symbols of a belief.

    Returns
    -------
    tuple of (list of Expression, dict)
        Mean ``z`` in the filter's units, and upper triangle of the covariance ``P``.
    """
    n = model.width
    return [symbol(f"z{i}") for i in range(n)], {(i, j): symbol(f"P{i}_{j}") for i in range(n) for j in range(i, n)}


def belief_names(width: int) -> tuple[str, ...]:
    """Return the names of a belief's symbols: the mean's, then the upper triangle's, row by row."""
    return (*(f"z{i}" for i in range(width)), *(f"P{i}_{j}" for i in range(width) for j in range(i, width)))


def to_physical(model: ProcessModel, mean: Sequence[Expression]) -> tuple[Expression, ...]:
    """Return a state in SI.

    Parameters
    ----------
    mean : sequence of Expression
        The state in the filter's units.
    """
    return tuple(
        state.scale * (exp(z) if state.logarithmic else z) for z, state in zip(mean, model.states, strict=True)
    )


def drive_symbols(model: ProcessModel) -> list[tuple[Expression, Expression]]:
    """Return each drive's value at the start and end of a sub-step, interpolated between samples ``a`` and ``b``."""
    pairs: list[tuple[Expression, Expression]] = []
    for i in range(len(model.drives)):
        slope = (symbol(f"b{i}") - symbol(f"a{i}")) * symbol("share")
        start = symbol(f"a{i}") + symbol("j") * slope
        pairs.append((start, start + slope))
    return pairs


def next_state(model: ProcessModel, mean: Sequence[Expression]) -> list[Expression]:
    """Advance a state by one step of the model, both in the filter's units.

    Returns
    -------
    list of Expression
        The state one step later; a state that the step leaves unchanged is the same node.
    """
    physical = to_physical(model, mean)
    pairs = drive_symbols(model)
    drives = pairs if len(model.drives) > 1 else pairs[0]
    stepped = model.step(physical, drives, parameter_symbols(model.parameters), symbol("h"))
    result: list[Expression] = []
    for z, old, new, state in zip(mean, physical, stepped, model.states, strict=True):
        result.append(z if new is old else _over_scale(z, old, as_expression(new), state))
    return result


def _over_scale(z: Expression, old: Expression, new: Expression, state: StateVariable) -> Expression:
    """Return a state after a step, in the filter's units; the step's increment is scaled before it is added."""
    if state.logarithmic:
        return log(new / state.scale)
    added = [term for term in new.arguments if term is not old] if new.operation == "+" else []
    return z + added[0] / state.scale if len(added) == 1 else new / state.scale


def predicted_outputs(model: ProcessModel, mean: Sequence[Expression], channels: Sequence[str]) -> list[Expression]:
    """Return the model's prediction of each channel.

    Parameters
    ----------
    mean : sequence of Expression
        The state in the filter's units.

    Returns
    -------
    list of Expression
        Predictions in SI.
    """
    predicted = model.observe(to_physical(model, mean), parameter_symbols(model.parameters))
    return [as_expression(predicted[channel]) for channel in channels]


def bounded_mean(model: ProcessModel, mean: Sequence[Expression]) -> list[Expression]:
    """Hold the mean to its physical bounds; NaN stays NaN, so that a diverged filter shows.

    Parameters
    ----------
    mean : sequence of Expression
        The state in the filter's units.
    """
    held: list[Expression] = []
    for z, state in zip(mean, model.states, strict=True):
        lower, upper = state.scaled_bounds
        low = z if lower == -float("inf") else where(z < lower, lower, z)
        held.append(low if upper == float("inf") else where(low > upper, upper, low))
    return held


def channel_projection(covariance: Covariance, H: Sequence[Expression]) -> tuple[list[Expression], Expression]:
    """Return the projection of a covariance on a channel: cross-covariance and variance.

    Parameters
    ----------
    covariance : dict
        Upper triangle.
    H : sequence of Expression
        The channel's slopes by the states.

    Returns
    -------
    tuple of (list of Expression, Expression)
        Covariance of each state with it, ``P H'``, and its variance, ``H P H'``.
    """
    n = len(H)
    PH = [total([entry(covariance, i, j) * H[j] for j in range(n)]) for i in range(n)]
    return PH, total([H[i] * PH[i] for i in range(n)])


def corrected_belief(
    mean: Mean, covariance: Covariance, PH: Sequence[Expression], step: Expression, loss: Expression
) -> tuple[list[Expression], Covariance]:
    """Correct a belief by a channel.

    Parameters
    ----------
    mean : sequence of Expression
        The state in the filter's units.
    covariance : dict
        Upper triangle.
    PH : sequence of Expression
        Covariance of each state with the channel.
    step, loss : Expression
        Factor of the mean's move along ``P H'``, and factor of the covariance's reduction along its square.

    Returns
    -------
    tuple of (list of Expression, dict)
        Mean ``z + P H' step`` and covariance ``P - P H' H P loss``.
    """
    moved_on = [z + PH[i] * step for i, z in enumerate(mean)]
    return moved_on, {(i, j): value - PH[i] * PH[j] * loss for (i, j), value in covariance.items()}


def bounded_belief(model: ProcessModel, mean: Sequence[Expression], covariance: Covariance) -> Outputs:
    """Return a belief by the names of its symbols, with the mean held to its bounds.

    Parameters
    ----------
    mean : sequence of Expression
        The state in the filter's units.
    covariance : dict
        Upper triangle.
    """
    held = {f"z{i}": z for i, z in enumerate(bounded_mean(model, mean))}
    return held | {f"P{i}_{j}": value for (i, j), value in covariance.items()}


def scaled_step(model: ProcessModel) -> tuple[list[Expression], list[list[Expression]]]:
    """Trace the model's step in the filter's units.

    Returns
    -------
    tuple of (list of Expression, list of list of Expression)
        The state one step later, and its Jacobian by the state.
    """
    mean, _ = belief_symbols(model)
    stepped = next_state(model, mean)
    return stepped, eliminated_jacobian(stepped, mean)


def process_noise(model: ProcessModel, i: int) -> Expression:
    """Return the variance that one step adds to a state.

    Returns
    -------
    Expression
        Density times step, plus the step's share of the variance that a gap in the log adds.
    """
    variance = symbol(f"q{i}") * symbol("h")
    opening = OPENING + model.states[i].name
    if opening not in model.drives:
        return variance
    return variance + symbol(f"b{model.drives.index(opening)}") * symbol("share")
