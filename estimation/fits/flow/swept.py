"""`with_sweep_correction(log, ...)`: positions whose straight lines sweep what the piston sweeps; `with_first_fit`.

See decision 313.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from estimation.fits.flow.log import with_random_walk
from estimation.fits.flow.pumped import with_pump_correction_at
from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import FLOW_FORM
from plant.eha.model import EhaParameters

LEAST_SWEEP_ERROR = 2e-4
"""Relative error of bulk modulus due to straight lines, from which they are corrected [fraction]: as large as other
effects that the balance omits."""

MOST_SWEEP_ERROR = 0.15
"""The same up to which the first-order correction holds [fraction]; judged: the sample time is then 1.3 times the time
in which a chamber leaks empty."""


def with_sweep_correction(log: GreyBoxLog, parameters: EhaParameters, values: Mapping[str, float]) -> GreyBoxLog:
    """Return a log whose positions are corrected for what a chamber leaks between samples beyond the straight lines.

    Between samples the flow form moves the piston at constant velocity, and the motor on a straight line. A piston that
    speeds up by ``w`` within a sample time ``T`` sweeps its oil late. So the mean pressure is ``A w T beta / (12 V)``
    higher, and ``A w T^2 / (12 t)`` more oil leaks, where ``t = V / (beta L)`` is the time in which a chamber leaks
    empty. A position that leads by ``T^2 / (12 t)`` has the same effect. Without the correction the motor's lead
    absorbs it, and bulk modulus is too high by ``T^2 / (12 t^2)``.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    values : Mapping[str, float]
        Bulk modulus and leakage coefficient of a first fit [SI].

    Returns
    -------
    GreyBoxLog
        The same log if the effect does not matter.
    """
    leaks = values["bulk_modulus"] * values["leakage_coefficient"] / parameters.chamber_volume
    off = (log.sample_time * leaks) ** 2 / 12.0
    if not LEAST_SWEEP_ERROR < off < MOST_SWEEP_ERROR:
        return log
    position = FLOW_FORM.drives.index("position_m")
    drives = log.drives.copy()
    drives[:, position] += log.sample_time * leaks / 12.0 * np.gradient(drives[:, position])
    return replace(log, drives=drives)


def with_first_fit(
    log: GreyBoxLog, parameters: EhaParameters, values: Mapping[str, float], stiffest: float
) -> GreyBoxLog:
    """Return a log as the flow form sees it once a first fit is known: with noise of speed and corrected positions.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    values : Mapping[str, float]
        Parameters of the first fit [SI].
    stiffest : float
        As in `with_random_walk` [Pa].
    """
    log = with_pump_correction_at(log, parameters, values)
    return with_sweep_correction(with_random_walk(log, parameters, values, stiffest), parameters, values)
