"""`with_pump_correction(means, log, ...)`: block means whose straight lines pump as much oil as the samples do.

See decisions 343 and 430.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.fits.greybox.block_averages import block_means
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.pump_ripple import delivering_speed
from estimation.models.flow import FLOW_FORM
from plant.components.valves import pumped_flow
from plant.eha.model import EhaParameters


def with_pump_correction(means: GreyBoxLog, log: GreyBoxLog, p: EhaParameters) -> GreyBoxLog:
    """Return means whose positions are corrected for the oil that straight lines between them pump too much.

    The flow form moves the motor on a straight line between means. A curved speed, ``w'' = -(2 pi f)^2 w``, pumps up to
    ``T^2 / 12`` of its acceleration more. The averaging also rounds off the pump's dead zone (errata E8). Pumped and
    swept oil nearly cancel, so the relative error of the compressed oil is far larger: with means over 0.6 ms of a
    chirp up to 23 Hz, bulk modulus was 0.09 % low, 3.2 deviations. The samples of the log say how much was pumped. The
    difference over the piston area, added to position, sweeps the same volume. The rig file's flow bias serves until a
    fit has found another, see `with_pump_correction_at`.

    Parameters
    ----------
    means : GreyBoxLog
        The log, averaged by `estimation.fits.greybox.block_averages.averaged_log`.
    log : GreyBoxLog
        The log before averaging.

    Returns
    -------
    GreyBoxLog
        The means; unchanged if the log was not averaged.
    """
    if means is log:
        return means
    sampled = log.drives[:, FLOW_FORM.drives.index("motor_speed_rad_s")], log.sample_time
    return _with_corrected_positions(replace(means, sampled=sampled), sampled, p, ((1.0, p.flow_bias),))


def with_pump_correction_at(means: GreyBoxLog, p: EhaParameters, values: Mapping[str, float]) -> GreyBoxLog:
    """Return means whose positions are corrected for the flow bias of a first fit, in place of the rig file's.

    A worn pump may have seven times the bias. The end of its dead zone depends on the bias, and a volume error there
    stays until it has leaked off. In one log at 10 kHz it put leakage 5.8 deviations low.

    Parameters
    ----------
    means : GreyBoxLog
        The log, as `with_pump_correction` returns it.
    values : Mapping[str, float]
        Parameters of a first fit [SI].

    Returns
    -------
    GreyBoxLog
        The same log if it was not averaged.
    """
    if means.sampled is None:
        return means
    return _with_corrected_positions(means, means.sampled, p, ((1.0, values["flow_bias"]), (-1.0, p.flow_bias)))


def _with_corrected_positions(
    means: GreyBoxLog, samples: tuple[Array, float], p: EhaParameters, biases: Sequence[tuple[float, float]]
) -> GreyBoxLog:
    """Return means with positions corrected for what lines pump too much, summed over flow biases by factors."""
    sampled, sample_time = samples
    block = round(means.sample_time / sample_time)
    speed, position = (FLOW_FORM.drives.index(name) for name in FLOW_FORM.drives)
    every = block * np.arange(len(means.drives))
    # with the same ripple and offset as the means
    turned = delivering_speed(sampled, means.teeth, means.speed_offset, sample_time)
    lines = np.interp(np.arange(len(sampled)), every, means.drives[:, speed])
    drives = means.drives.copy()
    for factor, bias in biases:
        wanted = block_means(_pumped_volume(turned, sample_time, p, bias)[block // 2 + 1 :], block)
        excess = _pumped_volume(lines, sample_time, p, bias)[every[1:]] - wanted
        drives[1:, position] += factor * excess / p.piston_area
    return replace(means, drives=drives)


def _pumped_volume(speed: Array, sample_time: float, p: EhaParameters, flow_bias: float) -> Array:
    """Return the oil pumped since the first sample [m^3]."""
    flow = np.asarray(pumped_flow(speed, p.pump_displacement, flow_bias))
    return np.concatenate([[0.0], np.cumsum(0.5 * (flow[1:] + flow[:-1])) * sample_time])
