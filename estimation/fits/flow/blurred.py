"""`sharpened(averaged_log, log, ...)`: a log of means, with the oil that its pump's dead zone let through between them.

See decision 343.
"""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.fits.greybox.averaged import block_means
from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import FLOW_FORM
from plant.components.valves import pumped_flow
from plant.eha.model import EhaParameters


def sharpened(means: GreyBoxLog, log: GreyBoxLog, p: EhaParameters) -> GreyBoxLog:
    """Return a log of means with positions that sweep what a dead zone does to the pumped flow within blocks.

    A pump delivers nothing up to the speed at which it makes up for its flow bias (errata E8). A mean of speeds on both
    sides of that corner delivers less than they do, at each turn against the motion. The fit takes this for softer oil:
    means over 0.6 ms of a chirp up to 23 Hz put bulk modulus 0.09 % low. How much it is hangs on how fast speed passes
    the corner and hardly on where that is, so that the rig file's flow bias serves.

    Parameters
    ----------
    means : GreyBoxLog
        The log, averaged over blocks by `estimation.fits.greybox.averaged.averaged`.
    log : GreyBoxLog
        The log before.
    p : EhaParameters
        The actuator.

    Returns
    -------
    GreyBoxLog
        The log of means; the same one where the log was not averaged.
    """
    if means is log:
        return means
    block = round(means.sample_time / log.sample_time)
    speed, position = (FLOW_FORM.drives.index(name) for name in FLOW_FORM.drives)
    line = np.interp(np.arange(len(log.drives)), block * np.arange(len(means.drives)), means.drives[:, speed])
    begun = block // 2 + 1
    delivered = block_means(_pumped(log.drives[:, speed], log.sample_time, p)[begun:], block)
    counted = _pumped(line, log.sample_time, p)[block : block * len(means.drives) : block]
    drives = means.drives.copy()
    drives[1:, position] -= (delivered - counted) / p.piston_area
    return replace(means, drives=drives)


def _pumped(speed: Array, sample_time: float, p: EhaParameters) -> Array:
    """Return the oil that was pumped since the first sample [m^3]."""
    flow = np.asarray(pumped_flow(speed, p.pump_displacement, p.flow_bias))
    return np.concatenate([[0.0], np.cumsum(0.5 * (flow[1:] + flow[:-1])) * sample_time])
