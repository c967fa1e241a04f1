"""`with_course(log, fitted, ...)`: a slow log with the uncertainty of its motor's course between samples."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.intersample_doubt import SLOW, IntersampleDoubt, turns
from estimation.fits.greybox.intersample_noise import likeliest_noise
from estimation.fits.greybox.log import GreyBoxLog
from plant.eha.model import EhaParameters

ROUNDS = 2
"""How often the uncertainty is read from a fit [count]."""

FIRST_UNCERTAINTY = 0.1
"""First guess of both parts of the uncertainty, over the largest effect that a turn of the speed could have [fraction];
judged."""

LEAST_UNCERTAINTY = 0.005
"""Least uncertainty [fraction]; judged: speed that turns suddenly is never straight between samples."""

RECURRING_FACTOR = 3.0
"""Factor on the recurring part [dimensionless]: a motor passes each turn alike, so that the error does not average out.
With 1, 17 logs of our circuit at 200 Hz have a root mean square z of 1.25, and one is 3.6 deviations low; with 3 none
is."""


def with_course(
    log: GreyBoxLog,
    fitted: Callable[[GreyBoxLog], Sequence[GreyBoxFit]],
    parameters: EhaParameters,
    *,
    always: bool = False,
) -> GreyBoxLog:
    """Return a slow log with the uncertainty of its motor's course between samples; any other log unchanged.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.
    fitted : callable
        ``fitted(log)``: its fits by every form that counts.
    parameters : EhaParameters
        The actuator.
    always : bool
        Whether a log that is not slow gets it too.

    Returns
    -------
    GreyBoxLog
        The log. One with gaps in its speed is unchanged: its kernel models the uncertainty of the gaps.
    """
    if (log.sample_time < SLOW and not always) or log.gaps.size:
        return log
    turned, staying, passing, kept, modulus = (
        turns(log),
        FIRST_UNCERTAINTY,
        FIRST_UNCERTAINTY,
        1.0,
        parameters.bulk_modulus,
    )

    def held() -> GreyBoxLog:
        rise = log.sample_time * parameters.pump_displacement * modulus / parameters.chamber_volume
        return replace(log, course=IntersampleDoubt(rise * turned, staying, RECURRING_FACTOR * passing, kept))

    for _ in range(ROUNDS):
        now = held()
        best = min(fitted(now), key=lambda fit: fit.cost)
        modulus = best.values["bulk_modulus"]
        leaking = replace(now.course or IntersampleDoubt(turned), kept=_share_kept(log, best.values, parameters))
        staying, passing, kept = likeliest_noise(FreedProblem.of(best.model, now), best.theta, leaking)
        staying, passing = max(staying, LEAST_UNCERTAINTY), max(passing, LEAST_UNCERTAINTY)
    return held()


def _share_kept(log: GreyBoxLog, values: Mapping[str, float], parameters: EhaParameters) -> float:
    """Return the share of a chamber's excess oil that leakage leaves after a sample, if make-up holds the other."""
    leaked = values["bulk_modulus"] * (values["leakage_coefficient"] + values["case_leakage"])
    return float(np.exp(-log.sample_time * leaked / (2.0 * parameters.chamber_volume)))
