"""`noise_shift(problem, theta, known_of)`: by how much noise of motor speed moves a fit, and what that leaves open.

The model pumps what a noisy speed is off by, and keeps it until it has leaked off. That grows with the oil's stiffness,
so that squares of the residuals are smaller for a softer oil. Where small chambers of stiff oil let the noise be felt,
bulk modulus came out a deviation too low. See decision 399.
"""

from collections.abc import Mapping

import numpy as np

from estimation.fits.greybox.deviations import NOISE_DOUBT, Information
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.side_by_side import LANES
from estimation.fits.greybox.small_pump_ripple import NOT_MOVED
from estimation.log_checks.measurement_noise import struck_variance
from plant.arrays import Array

MOVING = ("bulk_modulus", "leakage_coefficient", "case_leakage", "flow_bias", "pump_displacement")
"""Unknowns by which the oil that noise pumps is felt more or less; all are fitted as logarithms."""

NUDGE = 0.02
"""Change of their logarithms by which that is read off [dimensionless]."""

LONGEST = 30_000
"""Samples of a log's beginning on which it is read off [count]."""


def noise_shift(
    problem: Problem, theta: Array, known_of: Information
) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return the shift of the unknowns that takes back what noise of motor speed moved them by, and its variance.

    Residuals hold the answer ``a`` to the noise. At a minimum of their squares the gradient of ``E |a|^2 / 2`` is made
    up for by a shift of the unknowns. The gradient is read off drawn noise.

    Parameters
    ----------
    problem : Problem
        The problem, motor speed its first drive.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    known_of : Information
        What the slopes tell there.

    Returns
    -------
    tuple of Mapping[str, float]
        In the fitted coordinates [dimensionless], by unknown that is felt; nothing where noise of speed is not felt.
    """
    log = problem.log
    if not log.drive_std or not any(noise.walk > 0.0 for noise in log.noise) or log.course is not None:
        return NOT_MOVED
    names = [problem.model.unknowns[place] for place in known_of.felt]
    spread = min(log.drive_std[0] ** 2, struck_variance(log.drives[:, 0])) ** 0.5
    asked = problem if len(log.drives) <= LONGEST else problem.on(log.beginning(LONGEST))
    draws = spread * np.random.default_rng(0).standard_normal((len(asked.log.drives), LANES))
    draws[:, 0] = 0.0
    noisy = np.repeat(asked.log.drives[..., None], LANES, axis=-1)
    noisy[:, 0] += draws
    share = len(log.drives) / len(asked.log.drives) / (LANES - 1)

    def power(place: int, nudge: float) -> float:
        found = asked.disturbed_together(theta + nudge * (np.arange(len(theta)) == place), noisy)
        return share * float(np.sum((found[..., 1:] - found[..., :1]) ** 2))

    gradient = np.zeros(len(names))
    for i, (name, place) in enumerate(zip(names, known_of.felt.tolist(), strict=True)):
        if name in MOVING:
            gradient[i] = (power(place, NUDGE) - power(place, -NUDGE)) / (4.0 * NUDGE)
    shift = known_of.fitted_bread @ gradient
    doubt = (NOISE_DOUBT * shift) ** 2
    return dict(zip(names, shift.tolist(), strict=True)), dict(zip(names, doubt.tolist(), strict=True))
