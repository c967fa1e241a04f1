"""`pumped_evenly(means, log, ...)`: means of a log whose straight lines pump as much oil as the log's samples do.

See decision 343.
"""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.fits.greybox.block_averages import block_means
from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import FLOW_FORM
from plant.components.valves import pumped_flow
from plant.eha.model import EhaParameters


def pumped_evenly(means: GreyBoxLog, log: GreyBoxLog, p: EhaParameters) -> GreyBoxLog:
    """Return means with positions led by what straight lines between them pump too much.

    Between means the flow form moves the motor on a straight line. A speed that bends, ``w'' = -(2 pi f)^2 w``, pumps
    up to ``T^2 / 12`` of its acceleration more, and one that passes the pump's dead zone (errata E8) is blunted there.
    Pumped and swept oil nearly cancel, so that the compressed oil is off by far more: means over 0.6 ms of a chirp up
    to 23 Hz put bulk modulus 0.09 % low, 3.2 deviations. The log's own samples tell what was pumped; a position that
    leads by as much over the piston's area sweeps it. The rig file's flow bias serves: speeds pass the corner of the
    dead zone about as fast wherever it is.

    Parameters
    ----------
    means : GreyBoxLog
        The log, averaged by `estimation.fits.greybox.block_averages.averaged`.
    log : GreyBoxLog
        The log before.
    p : EhaParameters
        The actuator.

    Returns
    -------
    GreyBoxLog
        The means; the same ones where the log was not averaged.
    """
    if means is log:
        return means
    block = round(means.sample_time / log.sample_time)
    speed, position = (FLOW_FORM.drives.index(name) for name in FLOW_FORM.drives)
    every = block * np.arange(len(means.drives))
    lines = np.interp(np.arange(len(log.drives)), every, means.drives[:, speed])
    wanted = block_means(_pumped(log.drives[:, speed], log.sample_time, p)[block // 2 + 1 :], block)
    drives = means.drives.copy()
    drives[1:, position] += (_pumped(lines, log.sample_time, p)[every[1:]] - wanted) / p.piston_area
    return replace(means, drives=drives)


def _pumped(speed: Array, sample_time: float, p: EhaParameters) -> Array:
    """Return the oil that was pumped since the first sample [m^3]."""
    flow = np.asarray(pumped_flow(speed, p.pump_displacement, p.flow_bias))
    return np.concatenate([[0.0], np.cumsum(0.5 * (flow[1:] + flow[:-1])) * sample_time])
