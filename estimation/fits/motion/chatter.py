"""Bristles too stiff for the steps of the motion form: no search begins with one, and no fit ends with one.

Piston and bristle then chatter: each step ends on the other side of rest. That is no real motion. The cost has local
minima a few thousandths apart, and in which of them a descent ends depends on the last digit of the noise.
"""

from dataclasses import replace
from math import ceil, sqrt

import numpy as np

from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from plant.arrays import Array
from plant.solvers.steps import parameter_names

STIFFEST = 4_000.0
"""Largest natural frequency of the mass on its bristle that the model's steps follow [rad/s]: a quarter over the
shortest step."""

QUICKEST = 2_000.0
"""Largest rate at which the bristle's damping may stop the mass [1/s]: a half over the longest step."""

MOST_SHORTENED = 4
"""Largest factor by which steps are shortened where the piston reverses [dimensionless]."""


def bristle_limits(log: GreyBoxLog, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """Return the least and largest stiffness [N/m] and damping [N s/m] of a bristle that the model's steps follow.

    Parameters
    ----------
    log : GreyBoxLog
        The log; its parameters hold the mass.
    names : tuple of str
        Their names, in order.

    Returns
    -------
    dict of str to tuple of float
        By unknown.
    """
    mass = float(log.parameters[names.index("moving_mass")])
    return {"bristle_stiffness": (0.0, mass * STIFFEST**2), "bristle_damping": (0.0, mass * QUICKEST)}


def without_chatter(problem: FreedProblem, theta: Array) -> FreedProblem:
    """Return a problem with steps short enough for the bristle at a point, where the piston reverses.

    Parameters
    ----------
    theta : ndarray, shape (unknowns,)
        The point [dimensionless].

    Returns
    -------
    FreedProblem
        The same problem if its steps are short enough.
    """
    log, values = problem.log, problem.model.values(theta)
    followed_at_most = bristle_limits(log, parameter_names(problem.model.parameters))["bristle_stiffness"][1]
    times = min(ceil(sqrt(values["bristle_stiffness"] / followed_at_most)), MOST_SHORTENED)
    if times <= 1:
        return problem
    return problem.on(replace(log, steps=np.where(log.steps == np.max(log.steps), times * log.steps, log.steps)))
