"""Whether a log without pressure holds the scale of forces, by leaving its optimum and looking for it anew."""

from dataclasses import dataclass

import numpy as np

from estimation.fits.descent import Point, descend_together
from estimation.fits.freed_problem import FreedProblem
from plant.arrays import Array

SCALES = (0.8, 1.25)
"""Factors on all forces with which an optimum is left and looked for anew. Where no pressure is logged, pressures,
friction and stiffness may grow together and move little that position shows: a search can end anywhere along such a
valley, and the curvature where it ends does not say so [dimensionless]."""

RESCALED = 3
"""How often at most an optimum is left for a better one that was found so."""

BETTER = 5.0
"""Fall of the cost from which another optimum takes the place of the best [dimensionless]."""

GROWING = (
    "bulk_modulus",
    "friction_quadratic",
    "friction_linear",
    "friction_coulomb",
    "bristle_stiffness",
    "bristle_damping",
)
"""What grows with the scale of forces."""

FALLING = ("leakage_coefficient", "makeup_conductance", "case_leakage")
"""What falls as forces grow, so that flows stay."""


@dataclass(frozen=True)
class Way:
    """How a search comes down from a start.

    Parameters
    ----------
    near : FreedProblem
        The problem on which a start is brought near, its noise made larger.
    nearing : int
        Evaluations of the model there.
    near_enough : float
        Cost that a further step must promise there [dimensionless].
    finishing : int
        Evaluations of the model on the problem itself.
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    """

    near: FreedProblem
    nearing: int
    near_enough: float
    finishing: int
    bounds: tuple[Array, Array]


def rescaled(problem: FreedProblem, best: Point, way: Way) -> tuple[Point, list[Point]]:
    """Look for optima with forces on another scale.

    Parameters
    ----------
    problem : FreedProblem
        The problem, with the unknowns of the motion form.
    best : Point
        Its optimum, as far as it is known.
    way : Way
        How a search comes down.

    Returns
    -------
    tuple of Point and list of Point
        The best optimum, and all others that were found.
    """
    others: list[Point] = []
    for _ in range(RESCALED):
        ends = _ended(problem, best, way)
        lowest = min(ends, key=lambda point: point.cost)
        if lowest.cost > best.cost - BETTER:
            return best, [*others, *ends]
        others, best = [*others, best, *(end for end in ends if end is not lowest)], lowest
    return best, others


def _ended(problem: FreedProblem, best: Point, way: Way) -> list[Point]:
    """Return the optima downhill from another's, all forces multiplied by each of `SCALES`; searched side by side."""
    starts: list[Array] = []
    for factor in SCALES:
        values = dict(problem.model.values(best.theta))
        values |= {name: values[name] * factor for name in GROWING}
        values |= {name: values[name] / factor for name in FALLING}
        starts.append(np.clip(problem.model.theta(values), *way.bounds))
    near = descend_together(way.near.at_each, starts, way.nearing, way.bounds, way.near_enough)
    return descend_together(problem.at_each, [one.theta for one in near], way.finishing, way.bounds)
