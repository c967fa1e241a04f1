"""`swept_evenly(log, ...)`: positions whose straight lines sweep the volume that the piston does; `with_first_fit`.

See decision 313.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from estimation.fits.flow.log import carried
from estimation.fits.flow.pumped import pumped_evenly_at
from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import FLOW_FORM
from plant.eha.model import EhaParameters

FELT = 2e-4
"""Share by which straight lines put bulk modulus off from which they count [fraction]: as much as other things that the
balance leaves out."""

MOST = 0.15
"""The same up to which a first order in it holds [fraction]; judged: samples are then 1.3 times as far apart as a
chamber takes to leak empty."""


def swept_evenly(log: GreyBoxLog, parameters: EhaParameters, values: Mapping[str, float]) -> GreyBoxLog:
    """Return a log with positions led by what a chamber leaks more between two samples than straight lines say.

    Between samples the flow form moves the piston at one velocity, and the motor on a straight line. A piston that
    speeds up by ``w`` within a sample time ``T`` sweeps its oil late, so pressure stands ``A w T beta / (12 V)`` higher
    on average, and ``A w T^2 / (12 t)`` more leaks, ``t = V / (beta L)`` being the time in which a chamber leaks empty.
    That is a position which leads by ``T^2 / (12 t)``. Left out, the motor's lead takes it up, and bulk modulus comes
    out too high by ``T^2 / (12 t^2)``.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    parameters : EhaParameters
        The actuator.
    values : Mapping[str, float]
        Bulk modulus and leakage coefficient, as a first fit has found them [SI].

    Returns
    -------
    GreyBoxLog
        The same log where that is not felt.
    """
    leaks = values["bulk_modulus"] * values["leakage_coefficient"] / parameters.chamber_volume
    off = (log.sample_time * leaks) ** 2 / 12.0
    if not FELT < off < MOST:
        return log
    position = FLOW_FORM.drives.index("position_m")
    drives = log.drives.copy()
    drives[:, position] += log.sample_time * leaks / 12.0 * np.gradient(drives[:, position])
    return replace(log, drives=drives)


def with_first_fit(
    log: GreyBoxLog, parameters: EhaParameters, values: Mapping[str, float], stiffest: float
) -> GreyBoxLog:
    """Return a log as the flow form sees it once a first fit is known: noise of speed, even positions.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    parameters : EhaParameters
        The actuator.
    values : Mapping[str, float]
        What the first fit has found [SI].
    stiffest : float
        As of `carried` [Pa].
    """
    log = pumped_evenly_at(log, parameters, values)
    return swept_evenly(carried(log, parameters, values, stiffest), parameters, values)
