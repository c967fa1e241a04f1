"""`noise_shift(problem, theta, known_of)`: bias of a fit due to motor speed noise, and its variance.

The model pumps oil according to the noisy speed, and keeps the error until it has leaked off. The error in pressure
grows with the oil's stiffness, so a sum of squared residuals is smaller for softer oil. With small chambers of stiff
oil, bulk modulus came out a deviation too low. See decision 399.
"""

from collections.abc import Mapping

import numpy as np

from estimation.fits.greybox.deviations import NOISE_DOUBT, Information
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.side_by_side import LANES
from estimation.fits.greybox.small_pump_ripple import NO_SHIFTS
from estimation.log_checks.measurement_noise import noise_behind_motion
from plant.arrays import Array

MOVING = ("bulk_modulus", "leakage_coefficient", "case_leakage", "flow_bias", "pump_displacement")
"""Unknowns on which the effect of that noise depends; all are fitted as logarithms."""

NUDGE = 0.02
"""Change of their logarithms for the finite difference [dimensionless]."""

LONGEST = 30_000
"""Samples of a log's beginning that are used [count]."""


def noise_shift(
    problem: Problem, theta: Array, known_of: Information
) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return the shift of the unknowns that corrects the bias due to motor speed noise, and its variance.

    The residuals contain the response ``a`` to the noise. The gradient of ``E |a|^2 / 2``, computed with simulated
    noise, shifts the minimum of their squares.

    Parameters
    ----------
    problem : Problem
        The problem, motor speed its first drive.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    known_of : Information
        Information of the slopes there.

    Returns
    -------
    tuple of Mapping[str, float]
        In the fitted coordinates [dimensionless], by unknown; empty if noise of speed does not matter.
    """
    log = problem.log
    if not log.drive_std or not any(noise.walk > 0.0 for noise in log.noise) or log.course is not None:
        return NO_SHIFTS
    names = [problem.model.unknowns[place] for place in known_of.felt]
    spread = noise_behind_motion(log.drives[:, 0], log.drive_std[0] ** 2) ** 0.5
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
