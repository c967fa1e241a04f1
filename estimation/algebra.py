"""The algebra of filters, as expressions: a model's scaled step, prediction and update of mean and covariance.

Structural zeros and ones of the Jacobian vanish, symmetric covariances are stored once, and measurements are processed
one channel at a time, so no matrix is inverted and no absolute jitter is needed. `estimation.kernels` makes a compiled
filter of a `Rule`, alone or in lanes; a new rule needs no kernel of its own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from estimation.model import OPENING, ProcessModel
from estimation.robust import inflation
from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import ONE, ZERO, Expression, as_expression, jacobian, select, symbol, unary
from plant.compiled.functions import exp, log, where
from plant.integrate import parameter_symbols

Covariance: TypeAlias = dict[tuple[int, int], Expression]
"""Upper triangle: ``P[i, j]`` with i <= j."""

Mean: TypeAlias = Sequence[Expression]
Outputs: TypeAlias = dict[str, Expression]
"""New values by the name of the symbol that they replace, and whatever else a rule returns by name."""


@dataclass(frozen=True)
class Rule:
    """A filter, as its two halves.

    Parameters
    ----------
    name : str
        Name, for the kernel's file.
    predict : callable
        ``predict(model)``: new ``z`` and ``P`` after one step of the model.
    update : callable
        ``update(model, channels)``: new ``z`` and ``P``, and innovation ``e`` and its variance ``s`` of every channel.
    settings : tuple of str
        Names of numbers that the user sets; they are symbols in both halves.
    memory : tuple of str
        Names of what else the filter carries from sample to sample for each channel, zero at first; the channel's
        number is added to the name.
    """

    name: str
    predict: Callable[[ProcessModel], Outputs]
    update: Callable[[ProcessModel, Sequence[str]], Outputs]
    settings: tuple[str, ...] = ()
    memory: tuple[str, ...] = ()


def entry(P: Covariance, i: int, j: int) -> Expression:
    """Return an element of a symmetric matrix.

    Parameters
    ----------
    P : dict
        Its upper triangle.
    i, j : int
        Row and column.

    Returns
    -------
    Expression
        The element.
    """
    return P[min(i, j), max(i, j)]


def total(terms: Sequence[Expression]) -> Expression:
    """Return the sum of terms, in their order.

    Parameters
    ----------
    terms : sequence of Expression
        What to add.

    Returns
    -------
    Expression
        The sum.
    """
    return sum(terms, ZERO)


def belief_symbols(model: ProcessModel) -> tuple[list[Expression], Covariance]:
    """Return the symbols of a belief.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    tuple of (list of Expression, dict)
        Mean ``z`` in the filter's units, and upper triangle of the covariance ``P``.
    """
    n = model.width
    return [symbol(f"z{i}") for i in range(n)], {(i, j): symbol(f"P{i}_{j}") for i in range(n) for j in range(i, n)}


def belief_names(width: int) -> tuple[str, ...]:
    """Return the names of a belief's symbols: the mean's, then the upper triangle's, row by row.

    Parameters
    ----------
    width : int
        Count of states.

    Returns
    -------
    tuple of str
        Names.
    """
    return (*(f"z{i}" for i in range(width)), *(f"P{i}_{j}" for i in range(width) for j in range(i, width)))


def to_physical(model: ProcessModel, mean: Sequence[Expression]) -> tuple[Expression, ...]:
    """Return a state in SI.

    Parameters
    ----------
    model : ProcessModel
        The model.
    mean : sequence of Expression
        The state in the filter's units.

    Returns
    -------
    tuple of Expression
        The state in SI.
    """
    return tuple(
        state.scale * (exp(z) if state.logarithmic else z) for z, state in zip(mean, model.states, strict=True)
    )


def drive_symbols(model: ProcessModel) -> list[tuple[Expression, Expression]]:
    """Return each drive's value at the start and the end of a sub-step, linear between the samples ``a`` and ``b``.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    list of pairs of Expression
        One pair a drive.
    """
    pairs: list[tuple[Expression, Expression]] = []
    for i in range(len(model.drives)):
        slope = (symbol(f"b{i}") - symbol(f"a{i}")) * symbol("share")
        start = symbol(f"a{i}") + symbol("j") * slope
        pairs.append((start, start + slope))
    return pairs


def moved(model: ProcessModel, mean: Sequence[Expression]) -> list[Expression]:
    """Advance a state by one step of the model, both in the filter's units.

    Parameters
    ----------
    model : ProcessModel
        The model.
    mean : sequence of Expression
        The state.

    Returns
    -------
    list of Expression
        The state one step later; one that the step hands through is the same node.
    """
    physical = to_physical(model, mean)
    pairs = drive_symbols(model)
    drives = pairs if len(model.drives) > 1 else pairs[0]
    stepped = model.step(physical, drives, parameter_symbols(model.parameters), symbol("h"))
    result: list[Expression] = []
    for z, old, new, state in zip(mean, physical, stepped, model.states, strict=True):
        scaled = as_expression(new) / state.scale
        result.append(z if new is old else log(scaled) if state.logarithmic else scaled)
    return result


def observed(model: ProcessModel, mean: Sequence[Expression], channels: Sequence[str]) -> list[Expression]:
    """Return what the model predicts of each channel.

    Parameters
    ----------
    model : ProcessModel
        The model.
    mean : sequence of Expression
        The state in the filter's units.
    channels : sequence of str
        Measured channels.

    Returns
    -------
    list of Expression
        Predictions in SI.
    """
    predicted = model.observe(to_physical(model, mean), parameter_symbols(model.parameters))
    return [as_expression(predicted[channel]) for channel in channels]


def bounded(model: ProcessModel, mean: Sequence[Expression]) -> list[Expression]:
    """Hold the mean to its physical bounds; what is not a number stays so, for a diverged filter must show.

    Parameters
    ----------
    model : ProcessModel
        The model.
    mean : sequence of Expression
        The state in the filter's units.

    Returns
    -------
    list of Expression
        The state within its bounds.
    """
    held: list[Expression] = []
    for z, state in zip(mean, model.states, strict=True):
        lower, upper = state.scaled_bounds
        low = z if lower == -float("inf") else where(z < lower, lower, z)
        held.append(low if upper == float("inf") else where(low > upper, upper, low))
    return held


def scaled_step(model: ProcessModel) -> tuple[list[Expression], list[list[Expression]]]:
    """Trace the model's step in the filter's units.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    tuple of (list of Expression, list of list of Expression)
        The state one step later, and its Jacobian by the state.
    """
    mean, _ = belief_symbols(model)
    stepped = moved(model, mean)
    return stepped, eliminated_jacobian(stepped, mean)


def process_noise(model: ProcessModel, i: int) -> Expression:
    """Return the variance that one step adds to a state.

    Parameters
    ----------
    model : ProcessModel
        The model.
    i : int
        Index of the state.

    Returns
    -------
    Expression
        Density times step, and the step's share of what a gap in the log opens.
    """
    variance = symbol(f"q{i}") * symbol("h")
    opening = OPENING + model.states[i].name
    if opening not in model.drives:
        return variance
    return variance + symbol(f"b{model.drives.index(opening)}") * symbol("share")


def predict_expressions(model: ProcessModel) -> Outputs:
    """Return the extended Kalman filter's predict step: mean through the model, ``P = F P F' + Q h``.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    dict[str, Expression]
        New value of each mean ``z`` and covariance ``P`` symbol.
    """
    n = model.width
    _, P = belief_symbols(model)
    mean, F = scaled_step(model)
    FP = [[total([F[i][k] * entry(P, k, j) for k in range(n)]) for j in range(n)] for i in range(n)]
    held = bounded(model, mean)
    # what has not moved is within its bounds: the update before saw to that
    outputs = {f"z{i}": z if z.operation == "symbol" else held[i] for i, z in enumerate(mean)}
    for i in range(n):
        for j in range(i, n):
            spread = total([FP[i][k] * F[j][k] for k in range(n)])
            outputs[f"P{i}_{j}"] = spread + process_noise(model, i) if i == j else spread
    return outputs


def update_expressions(model: ProcessModel, channels: Sequence[str], robust: str = "none") -> Outputs:
    """Return the extended Kalman filter's update by each channel in turn; a missing sample (NaN) changes nothing.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How innovations that are too large count, see `estimation.robust`.

    Returns
    -------
    dict[str, Expression]
        New value of each mean and covariance symbol, innovations ``e`` and their variances ``s``.
    """
    prior, covariance = belief_symbols(model)
    n, mean, outputs = model.width, prior, Outputs()
    for c, row in enumerate(jacobian(observed(model, prior, channels), prior)):
        unit = _unit(row)
        H = [ONE if slope is unit else slope for slope in row]
        present, noise = unary("present", symbol(f"y{c}")), symbol(f"r{c}") / unit**2
        residual = symbol(f"y{c}") / unit - _linearised(model, prior, mean, channels, c) / unit
        PH = [total([entry(covariance, i, j) * H[j] for j in range(n)]) for i in range(n)]
        spread = total([H[i] * PH[i] for i in range(n)])
        variance = spread + noise * inflation(robust, residual * residual / (spread + noise))
        weight, clean = select(present, 1.0 / variance, ZERO), select(present, residual, ZERO)
        gain = [value * weight for value in PH]
        covariance = {(i, j): value - gain[i] * PH[j] for (i, j), value in covariance.items()}
        mean = [z + gain[i] * clean for i, z in enumerate(mean)]
        outputs[f"e{c}"], outputs[f"s{c}"] = unit * residual, unit**2 * variance
    outputs |= {f"z{i}": z for i, z in enumerate(bounded(model, mean))}
    return outputs | {f"P{i}_{j}": value for (i, j), value in covariance.items()}


def _unit(row: Sequence[Expression]) -> Expression:
    """Return what a channel shows of one unit of a state, if it shows that state alone; an update then counts in it."""
    seen = [slope for slope in row if slope is not ZERO]
    return seen[0] if len(seen) == 1 and seen[0].operation == "constant" else ONE


def _linearised(model: ProcessModel, prior: Mean, mean: Mean, channels: Sequence[str], c: int) -> Expression:
    """Return what the model, linearised about the prior, predicts of a channel from another mean."""
    predicted = observed(model, prior, channels)[c]
    row = jacobian([predicted], prior)[0]
    if all(slope.operation == "constant" for slope in row):  # it is linear
        return observed(model, mean, channels)[c]
    return predicted + total([slope * (new - old) for slope, new, old in zip(row, mean, prior, strict=True)])


EKF = Rule("ekf", predict_expressions, update_expressions)
"""The extended Kalman filter."""
