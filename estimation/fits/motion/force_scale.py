"""Test whether a log without pressure determines the scale of forces: leave its optimum and search again."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimation.fits.greybox.descent import Point, descend_together
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from plant.arrays import Array

SCALES = (0.8, 1.25)
"""Factors on all forces from which the optimum is searched again [dimensionless]. Without pressure, pressures, friction
and stiffness may grow together with little effect on position: a search can end anywhere along such a valley, and the
curvature at its end does not show it."""

STIFFNESS_SCALES = (0.93, 1.07)
"""The same for bulk modulus alone [dimensionless]. With frequent stick-slip the cost is rough: local minima lie a few
percent apart, and the curvature in one does not show the next."""

MOST_RESCALINGS = 3
"""Most often that an optimum is replaced by a better one found in this way."""

LEAST_FALL = 5.0
"""Fall of the cost from which a better optimum is left in its turn [dimensionless]."""

ELSEWHERE = 0.005
"""Relative difference in bulk modulus from which the same, in a short log [fraction]. In longer logs the two optima
must disagree: if they are nearer, the same places are searched again, which takes 1 s and changes little."""

SHORT = 4.0
"""Length up to which a log is short [s]: any improvement of its fit counts, since searches take little time."""

ALMOST, NEARBY = 1e-3, 0.3
"""Relative difference in bulk modulus, and the same over its deviation, up to which a nearby optimum counts as the
known one and is not refined [fraction]."""

FAR_AWAY = 0.1
"""The same from which an optimum is another one, however exactly it is found [fraction]."""

LARGEST_DISAGREEMENT = 0.05
"""Relative difference in bulk modulus of two optima that explain a log, above which neither is believed [fraction]."""

GROWING = (
    "bulk_modulus",
    "friction_quadratic",
    "friction_linear",
    "friction_coulomb",
    "bristle_stiffness",
    "bristle_damping",
)
"""Parameters that grow with the scale of forces."""

FALLING = ("leakage_coefficient", "makeup_conductance", "case_leakage")
"""Parameters that fall as forces grow, so that flows stay the same."""


@dataclass(frozen=True)
class Way:
    """Options of a descent from a start.

    Parameters
    ----------
    near : FreedProblem
        The problem with larger noise, for the approach.
    nearing : int
        Evaluations of the model on it.
    near_enough : float
        Cost that a further step must promise there [dimensionless].
    finishing : int
        Evaluations of the model on the problem itself.
    enough : float
        Cost that a further step must promise there [dimensionless].
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    explained : float
        Cost up to which an optimum explains the log [dimensionless].
    """

    near: FreedProblem
    nearing: int
    near_enough: float
    finishing: int
    enough: float
    bounds: tuple[Array, Array]
    explained: float


def optimum_on_other_scales(problem: FreedProblem, best: Point, way: Way) -> tuple[Point, list[float]]:
    """Search for optima with forces or stiffness on another scale, until some disagree.

    Parameters
    ----------
    problem : FreedProblem
        The problem, with the unknowns of the motion form.
    best : Point
        Its best known optimum.
    way : Way
        Options of the descents.

    Returns
    -------
    tuple of Point and list of float
        The best optimum, and the bulk moduli of all others that explain the log [Pa].
    """
    found, moduli = [best], list[float]()
    far = ELSEWHERE if is_short(problem.log) else np.log(1.0 + LARGEST_DISAGREEMENT)
    for _ in range(MOST_RESCALINGS):
        for moved in _rescaled_starts(problem.model.values(best.theta)):
            found += _downhill_optima(problem, best, moved, way)
            if disagree([bulk_modulus(problem, one) for one in found if one.cost < way.explained or one is best]):
                break
        lowest = min(found, key=lambda point: point.cost)
        moved = abs(np.log(bulk_modulus(problem, lowest) / bulk_modulus(problem, best)))
        over, best = lowest.cost > best.cost - LEAST_FALL, lowest
        moduli = [bulk_modulus(problem, one) for one in found if one is not best and one.cost < way.explained]
        if over or moved < far or disagree([bulk_modulus(problem, best), *moduli]):
            break
    return best, moduli


def is_short(log: GreyBoxLog) -> bool:
    """Return whether a log lasts no longer than `SHORT`."""
    return len(log.measured) * log.sample_time <= SHORT


def disagree(moduli: Sequence[float]) -> bool:
    """Return whether bulk moduli are too far apart to be believed.

    Parameters
    ----------
    moduli : sequence of float
        The bulk moduli [Pa].

    Returns
    -------
    bool
        Whether the largest exceeds the smallest by more than `LARGEST_DISAGREEMENT`.
    """
    return max(moduli) > (1.0 + LARGEST_DISAGREEMENT) * min(moduli)


def bulk_modulus(problem: FreedProblem, point: Point) -> float:
    """Return the bulk modulus of a point [Pa]."""
    return problem.model.values(point.theta)["bulk_modulus"]


def deviation(problem: FreedProblem, point: Point) -> float:
    """Return the relative standard deviation of bulk modulus at a point if residuals are white [fraction]."""
    place = problem.model.unknowns.index("bulk_modulus")
    return float(np.sqrt(np.linalg.pinv(point.gram, hermitian=True)[place, place]))


def _rescaled_starts(values: Mapping[str, float]) -> Iterator[list[dict[str, float]]]:
    """Yield new starts from an optimum: all forces on another scale, then another stiffness alone."""
    scaled: list[dict[str, float]] = []
    for factor in SCALES:
        growing = {name: values[name] * factor for name in GROWING}
        scaled.append(growing | {name: values[name] / factor for name in FALLING})
    yield scaled
    yield [{"bulk_modulus": values["bulk_modulus"] * factor} for factor in STIFFNESS_SCALES]


def _downhill_optima(problem: FreedProblem, best: Point, moved: Sequence[Mapping[str, float]], way: Way) -> list[Point]:
    """Return the optima downhill from changed starts; searched side by side."""
    values = problem.model.values(best.theta)
    starts = [np.clip(problem.model.theta({**values, **some}), *way.bounds) for some in moved]
    near = descend_together(way.near.at_each, starts, way.nearing, way.bounds, way.near_enough)
    starts = [one.theta for one in near]
    found = descend_together(problem.at_each, starts, way.finishing, way.bounds, way.enough, wanted=way.explained)
    alike, here = max(ALMOST, NEARBY * deviation(problem, best)), np.log(bulk_modulus(problem, best))
    apart = [abs(np.log(bulk_modulus(problem, one)) - here) for one in found]
    close = [i for i in range(len(found)) if found[i].cost < way.explained and alike < apart[i] < FAR_AWAY]
    starts, enough = [found[i].theta for i in close], way.near_enough
    ends = descend_together(problem.at_each, starts, way.finishing, way.bounds, enough)
    for i, one in zip(close, ends, strict=True):
        found[i] = one
    return found
