"""`share_at(record, parameters, values) -> float`: residual of the motion form at another model's values.

The search for the motion form's unknowns begins at the healthy actuator and a few faulty ones, and may end far from the
log. The values of another model show whether it did.
"""

from collections.abc import Mapping

import numpy as np

from estimation.fits.flow.search import LEAD_START
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.motion.fit import DAMPING_START, share_of_motion
from estimation.fits.motion.log import motion_log
from estimation.models.motion import LINEAR, MOTION_FORMS, UNKNOWNS
from plant.eha.model import EhaParameters
from plant.log.record import Record


def share_at(record: Record, parameters: EhaParameters, values: Mapping[str, float], speed_variance: float) -> float:
    """Return the residual of the motion form at given values, as a share of the motion.

    Parameters
    ----------
    record : Record
        The log, with position.
    parameters : EhaParameters
        Geometry, pump and mass are taken from it.
    values : Mapping[str, float]
        The unknowns of `estimation.models.motion.UNKNOWNS` [SI]; ``speed_lead`` and ``bristle_damping`` default to the
        first guesses of a search.
    speed_variance : float
        Measurement variance of motor speed [rad^2/s^2].

    Returns
    -------
    float
        See `estimation.fits.motion.fit.share_of_motion`; for the better structure of friction [fraction]. Infinite if
        the model diverges.
    """
    log = motion_log(record, parameters, {}, speed_variance)
    given = {"speed_lead": LEAD_START, "bristle_damping": DAMPING_START, **values}
    squares: list[float] = []
    for form in MOTION_FORMS:
        problem = FreedProblem(form, log, UNKNOWNS, LINEAR)
        (errors,) = problem.residuals_of(problem.model.theta(given), [log.parameters])
        mean = float(np.sum(errors**2)) / max(int(np.count_nonzero(errors)), 1)
        squares.append(mean if np.isfinite(mean) else float("inf"))
    return share_of_motion(min(squares), log)
