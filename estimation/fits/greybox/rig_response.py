"""Response of a fit to changes of the rig's own parameters."""

from collections.abc import Callable, Iterator

import numpy as np

from estimation.fits.greybox.deviations import Information
from estimation.fits.greybox.problem import Problem
from plant.arrays import Array
from plant.solvers.steps import parameter_names

RIG_NUDGE = 1e-3
"""Relative change of a rig parameter for the finite difference of the fit's response [fraction]."""


def rig_slopes(problem: Problem, theta: Array, response: Callable[[Array], Array]) -> Iterator[tuple[str, Array]]:
    """Yield the change of the unknowns per relative change of each uncertain parameter of the rig.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    response : callable
        From a change of the normalised residuals, shape (outputs, blocks), to the shift of the unknowns that have an
        effect.

    Yields
    ------
    name : str
        The parameter.
    slopes : ndarray, shape (felt,)
        Of the felt unknowns, in the fitted coordinates [dimensionless].
    """
    names, row = parameter_names(problem.model.parameters), problem.log.parameters
    asked = [
        name
        for name, relative in problem.log.uncertainties.items()
        if relative > 0.0 and name in names and name not in problem.model.unknowns
    ]
    nudged = [np.where(np.arange(len(row)) == names.index(name), row * (1.0 + RIG_NUDGE), row) for name in asked]
    known, *shifted = problem.residuals_of(theta, [row, *nudged])
    for name, errors in zip(asked, shifted, strict=True):
        yield name, -response(errors - known) / RIG_NUDGE


def responses_to_rig(problem: Problem, theta: Array, known_of: Information) -> Iterator[tuple[str, Array]]:
    """Yield the change of each unknown per relative change of an uncertain parameter of the rig.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    known_of : Information
        Information of the slopes there.

    Yields
    ------
    name : str
        The parameter.
    slopes : ndarray, shape (unknowns,)
        For all unknowns, zero for those without effect, in the fitted coordinates [dimensionless].
    """
    for name, slope in rig_slopes(problem, theta, known_of.response):
        whole = np.zeros(len(theta))
        whole[known_of.felt] = slope[: len(known_of.felt)]
        yield name, whole
