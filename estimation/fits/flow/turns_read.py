"""`with_turns_read(log, parameters)`: a slow log whose pumped volume in each turn is read from the samples after it.

A command comes at an unknown time between two samples. A first-order motor lacks a share of its change of speed at the
next sample, and the same fraction of that share one sample later. So the samples after a turn determine when the
command came, and how much oil the pump delivered beyond the straight lines.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.fits.greybox.intersample_doubt import OWN_NOISE, SLOW
from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import FLOW_FORM
from plant.eha.model import EhaParameters

MOST_DEPARTURE = 0.05
"""Share of its whole change by which a turn may depart from that of a first-order motor [fraction]; judged."""

LEAST_LACKING = 3.0
"""What a motor still lacks one sample later, in deviations [dimensionless]. In a log so slow that nothing is left by
then, no sample tells when the command came."""

SETTLING = 8
"""Samples after a turn over which it is followed [count]."""


def with_turns_read(log: GreyBoxLog, parameters: EhaParameters) -> GreyBoxLog:
    """Return a slow log with the volume of its turns read from later samples; unchanged if these do not determine it.

    The volume is subtracted from position: a smaller swept volume compresses the oil as much. Added to the motor speed
    at the samples, half of it would come a sample too late.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    """
    if log.sample_time < SLOW or log.gaps.size:
        return log
    speed, position = (FLOW_FORM.drives.index(name) for name in ("motor_speed_rad_s", "position_m"))
    beside = turn_beyond_line(log.drives[:, speed], log.sample_time, log.drive_std[0])
    if not np.any(beside):
        return log
    drives = log.drives.copy()
    drives[:, position] -= parameters.pump_displacement / parameters.piston_area * np.cumsum(beside)
    return replace(log, drives=drives)


def turn_beyond_line(speed: Array, sample_time: float, noise: float) -> Array:
    """Return by how much the motor turns further up to each sample than the straight line from the one before.

    With lag ``l``, a command comes ``-l ln(R)`` before a sample at which the motor lacks the share ``R`` of its change.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Motor speed at the samples [rad/s].
    sample_time : float
        Between them [s].
    noise : float
        Standard deviation of the sensor's noise [rad/s].

    Returns
    -------
    ndarray, shape (n,)
        0 where it is not known [rad].

    Examples
    --------
    A lag of half a sample, and a command 0.3 samples after the first one:

    >>> speed = np.array([0.0] * 4 + [float(100.0 - 100.0 * np.exp(-2.0 * (k + 0.7))) for k in range(5)] + [100.0] * 4)
    >>> beside = turn_beyond_line(speed, 1.0, 1e-3)
    >>> bool(abs(np.trapezoid(speed[:9]) + beside[:9].sum() - 100.0 * (4.7 - 0.5)) < 0.01)
    True
    """
    rise, loud = np.diff(speed, prepend=speed[0]), OWN_NOISE * 2.0**0.5 * noise
    turns = [k for k in np.flatnonzero(np.abs(rise) > 2.0 * loud).tolist() if _is_start_of_turn(rise, k, loud)]
    beside, left = np.zeros_like(speed), _speed_share_lacking(rise, turns, loud)
    if left == 0.0:
        return beside
    lag = -sample_time / np.log(left)
    for k in turns:
        whole = rise[k] + rise[k + 1] / (1.0 - left)
        if whole * rise[k] <= 0.0 or abs(rise[k + 2] - left * rise[k + 1]) > loud + MOST_DEPARTURE * abs(whole):
            continue  # another command followed
        short = float(np.clip(1.0 - rise[k] / whole, left, 1.0))
        beside[k] += whole * (-lag * (np.log(short) + 1.0 - short) - 0.5 * sample_time * (1.0 - short))
        for j in range(k + 1, min(len(speed), k + SETTLING)):
            if abs(rise[j] - whole * short * (1.0 - left)) > loud + MOST_DEPARTURE * abs(whole) * short:
                break
            beside[j] += whole * short * (0.5 * sample_time * (1.0 + left) - lag * (1.0 - left))
            short *= left
    return beside


def _is_start_of_turn(rise: Array, k: int, loud: float) -> bool:
    """Return whether a steady motor starts to turn before sample ``k``, and is followed for three more samples."""
    return 1 <= k < len(rise) - 3 and abs(rise[k - 1]) < loud


def _speed_share_lacking(rise: Array, turns: Iterable[int], loud: float) -> float:
    """Return the fraction of its missing speed that a motor still lacks one sample later; 0 if unknown.

    A turn counts if the missing speed falls by the same fraction twice.
    """
    power = product = 0.0
    for k in turns:
        first, second, third = rise[k + 1 : k + 4].tolist()
        if abs(second) < abs(first) and abs(third * first - second**2) <= (loud + MOST_DEPARTURE * abs(first)) * abs(
            first
        ):
            power, product = power + first**2, product + first * second
    deviation = loud / OWN_NOISE
    return product / power if product > LEAST_LACKING * deviation * power**0.5 else 0.0
