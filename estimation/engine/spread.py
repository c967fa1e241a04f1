"""Propagates covariance through a step from waypoint to waypoint, if the model names waypoints.

``F P F'`` must wait for the whole Jacobian. With waypoints, the covariance of the quantities that a step computes first
can also be computed first: each waypoint is a linear combination of earlier ones, and so are its covariances with them.
The result is the same up to rounding.
"""

from collections.abc import Sequence

from estimation.engine.kalman import Covariance, total
from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import ONE, ZERO, Expression, ordered
from plant.compiled.hints import is_waypoint


def waypoints_of(outputs: Sequence[Expression]) -> list[Expression]:
    """Return the waypoints of a step, each after those on which it depends."""
    return [item for item in ordered(outputs, by_slopes=True) if is_waypoint(item)]


def spread(outputs: Sequence[Expression], inputs: Sequence[Expression], covariance: Covariance) -> Covariance:
    """Propagate a covariance through a step by way of its waypoints.

    Parameters
    ----------
    outputs : sequence of Expression
        The state one step later, in the filter's units.
    inputs : sequence of Expression
        The state before the step: symbols, in the filter's units.
    covariance : dict
        Upper triangle of the covariance before the step.

    Returns
    -------
    dict
        Upper triangle of the covariance after the step, without process noise.
    """
    n, known, units, mixed = len(inputs), list(inputs), [ONE] * len(inputs), list[dict[int, Expression]]()
    for item in waypoints_of(outputs):
        mixture = _scaled_slopes(item, known, units)
        unit = next((slope for slope in mixture.values() if slope.operation == "constant"), ONE)
        mixed.append({k: ONE if slope is unit else slope / unit for k, slope in mixture.items()})
        known.append(item)
        units.append(unit)
    mixed += [_scaled_slopes(item, known, units) for item in outputs]
    made: Covariance = {}

    def between(i: int, j: int) -> Expression:
        """Return the covariance of two quantities, with the later one resolved into its components."""
        first, last = min(i, j), max(i, j)
        if last < n:
            return covariance[first, last]
        if (first, last) not in made:
            parts = mixed[last - n].items()
            made[first, last] = total([slope * between(k, last if i == j else first) for k, slope in parts])
        return made[first, last]

    return {(i, j): between(len(known) + i, len(known) + j) for i in range(n) for j in range(i, n)}


def _scaled_slopes(item: Expression, known: Sequence[Expression], units: Sequence[Expression]) -> dict[int, Expression]:
    """Return the nonzero slopes of a quantity by the known ones, each scaled by its own unit."""
    slopes = eliminated_jacobian([item], known)[0]
    return {k: slope * unit for k, (slope, unit) in enumerate(zip(slopes, units, strict=True)) if slope is not ZERO}
