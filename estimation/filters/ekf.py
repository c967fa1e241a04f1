"""The extended Kalman filter: analytic Jacobian, sequential scalar updates, compiled.

Equations: predict and update as in Gadsden (2011), whose notation the EHA paper follows. The measurement noise is
diagonal, so processing one channel at a time equals the joint update and needs no matrix inverse.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from estimation.engine.kalman import (
    Covariance,
    Mean,
    Outputs,
    belief_symbols,
    bounded_belief,
    bounded_mean,
    channel_projection,
    entry,
    next_state,
    predicted_outputs,
    process_noise,
    scaled_step,
    total,
)
from estimation.engine.robust import inflation
from estimation.engine.rule import Rule
from estimation.engine.runner import run_rule
from estimation.engine.spread import spread, waypoints_of
from estimation.models.model import ProcessModel
from plant.compiled.expression import ONE, ZERO, Expression, jacobian, select, symbol, unary


def ekf_predict(model: ProcessModel) -> Outputs:
    """Return the extended Kalman filter's predict step: mean through the model, ``P = F P F' + Q h``.

    Returns
    -------
    dict[str, Expression]
        New value of each mean ``z`` and covariance ``P`` symbol.
    """
    prior, P = belief_symbols(model)
    mean = next_state(model, prior)
    held = bounded_mean(model, mean)
    # a state that the model does not move is within its bounds already, from the previous update
    outputs = {f"z{i}": z if z.operation == "symbol" else held[i] for i, z in enumerate(mean)}
    after = spread(mean, prior, P) if waypoints_of(mean) else _transformed_covariance(scaled_step(model)[1], P)
    for (i, j), value in after.items():
        outputs[f"P{i}_{j}"] = value + process_noise(model, i) if i == j else value
    return outputs


def _transformed_covariance(F: Sequence[Sequence[Expression]], P: Covariance) -> Covariance:
    """Return the upper triangle of ``F P F'``, each entry summed over the row of the Jacobian with fewer terms."""
    each = range(len(F))
    FP = [[total([F[i][k] * entry(P, k, j) for k in each]) for j in each] for i in each]
    terms = [sum(slope is not ZERO for slope in row) for row in F]
    after: Covariance = {}
    for i, j in P:
        few, many = (i, j) if terms[i] < terms[j] else (j, i)
        after[i, j] = total([FP[many][k] * F[few][k] for k in each])
    return after


def ekf_update(model: ProcessModel, channels: Sequence[str], robust: str = "none") -> Outputs:
    """Return the extended Kalman filter's update by each channel in turn; a missing sample (NaN) changes nothing.

    Parameters
    ----------
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How too large innovations count, see `estimation.engine.robust`.

    Returns
    -------
    dict[str, Expression]
        New value of each mean and covariance symbol, innovations ``e`` and their variances ``s``, and of every second
        channel ``w``, one over ``s``.
    """
    prior, _ = belief_symbols(model)
    found = linearised_update(model, channels, prior, noise_symbols(channels), robust)
    return found.seen | bounded_belief(model, found.mean, found.covariance)


@dataclass(frozen=True, eq=False)
class Update:
    """A belief updated by all channels.

    Parameters
    ----------
    mean, covariance : list of Expression, dict
        The belief; the mean is not yet held to its bounds.
    seen : dict[str, Expression]
        Innovations ``e`` and their variances ``s``; of every second channel ``w``, one over ``s``.
    noise : list of Expression
        Measurement variances, inflated for outliers [SI squared].
    gains : list of (row, gain, weight, innovation)
        Effect of each channel, in its own units; weight is one over the innovation's variance, zero if the sample is
        missing.
    """

    mean: list[Expression]
    covariance: Covariance
    seen: Outputs
    noise: list[Expression]
    gains: list[tuple[list[Expression], list[Expression], Expression, Expression]]


def noise_symbols(channels: Sequence[str]) -> list[Expression]:
    """Return the symbols of measurement variances.

    Returns
    -------
    list of Expression
        ``r`` [SI squared].
    """
    return [symbol(f"r{c}") for c in range(len(channels))]


def linearised_update(
    model: ProcessModel, channels: Sequence[str], point: Mean, noise: Sequence[Expression], robust: str = "none"
) -> Update:
    """Update the prior by each channel in turn, with the model linearised at a point.

    Parameters
    ----------
    channels : sequence of str
        Measured channels, in the order of processing.
    point : sequence of Expression
        Point of linearisation, in the filter's units: the prior's mean, or a point nearer to the truth.
    noise : sequence of Expression
        Measurement variances [SI squared].
    robust : str
        How too large innovations count, see `estimation.engine.robust`.
    """
    mean, covariance = belief_symbols(model)
    seen, inflated, earlier = Outputs(), list[Expression](), None
    gains: list[tuple[list[Expression], list[Expression], Expression, Expression]] = []
    for c, row in enumerate(jacobian(predicted_outputs(model, point, channels), point)):
        unit = _unit_slope(row)
        H = [ONE if slope is unit else slope for slope in row]
        present, r = unary("present", symbol(f"y{c}")), noise[c] / unit**2
        residual = symbol(f"y{c}") / unit - _linearised_prediction(model, point, mean, channels, c) / unit
        PH, projection = channel_projection(covariance, H)
        r = r * inflation(robust, residual * residual / (projection + r))
        variance = projection + r
        inverse = 1.0 / variance if earlier is None else _second_inverse(earlier, H, r)
        if earlier is not None:
            seen[f"w{c}"] = inverse / unit**2
        earlier = _EarlierChannel(present, covariance, PH, variance) if earlier is None and robust == "none" else None
        weight, clean = select(present, inverse, ZERO), select(present, residual, ZERO)
        gain = [value * weight for value in PH]
        covariance = {(i, j): value - gain[i] * PH[j] for (i, j), value in covariance.items()}
        mean = [z + gain[i] * clean for i, z in enumerate(mean)]
        seen |= {f"e{c}": unit * residual, f"s{c}": unit**2 * variance}
        inflated.append(unit**2 * r)
        gains.append((H, gain, weight, clean))
    return Update(mean, covariance, seen, inflated, gains)


class _EarlierChannel(NamedTuple):
    """The first of two channels: whether it is present, the covariance before it, ``P H'``, and its variance."""

    present: Expression
    covariance: Covariance
    PH: Sequence[Expression]
    variance: Expression


def _second_inverse(earlier: _EarlierChannel, H: Sequence[Expression], r: Expression) -> Expression:
    """Return one over the second channel's variance, without waiting for one over the first's.

    The variances of two channels in turn have the product ``S00 S11 - S01^2``, of variances before both.
    """
    alone = channel_projection(earlier.covariance, H)[1] + r
    across = total([slope * value for slope, value in zip(H, earlier.PH, strict=True)])
    joint = earlier.variance * alone - across * across
    return select(earlier.present, earlier.variance, ONE) / select(earlier.present, joint, alone)


def _unit_slope(row: Sequence[Expression]) -> Expression:
    """Return the constant slope of a channel that observes a single state, as the unit of its update; else one."""
    seen = [slope for slope in row if slope is not ZERO]
    return seen[0] if len(seen) == 1 and seen[0].operation == "constant" else ONE


def _linearised_prediction(model: ProcessModel, point: Mean, mean: Mean, channels: Sequence[str], c: int) -> Expression:
    """Return the prediction of a channel from a mean, with the model linearised about a point."""
    predicted = predicted_outputs(model, point, channels)[c]
    row = jacobian([predicted], point)[0]
    if all(slope.operation == "constant" for slope in row):  # a linear channel
        return predicted_outputs(model, mean, channels)[c]
    return predicted + total([slope * (new - old) for slope, new, old in zip(row, mean, point, strict=True)])


EKF = Rule("ekf", ekf_predict, ekf_update)
ekf = partial(run_rule, EKF)
"""The extended Kalman filter, as a rule and as a method."""
