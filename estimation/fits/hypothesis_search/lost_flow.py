"""Lost flow between pump and piston, piece by piece: the input of rough searches for its cause."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.wide_log import usual_values
from estimation.log_checks.channel_names import POSITION, SPEED
from estimation.models.wide_flow import WIDE_FLOW_FORM
from plant.arrays import Array

PIECES = 200
"""Pieces of the log in which flows and pressure are averaged [count]: a time is then known to half a percent of it."""

EDGE = 0.05
"""Share of the log before and after which no change is sought [fraction]."""


class LostFlow(NamedTuple):
    """Flow that the pump delivers and the piston does not sweep, with its possible regressors.

    Parameters
    ----------
    lost : ndarray, shape (pieces,)
        Flow that is lost, on average [m^3/s].
    pressure, sign : ndarray, shape (pieces,)
        Differential pressure [Pa] and the speed's sign [dimensionless], on average.
    time : ndarray, shape (pieces,)
        Length of a piece [s].
    ends : ndarray, shape (pieces + 1,)
        Differential pressure where pieces begin and end [Pa].
    positions : ndarray, shape (pieces + 1,)
        Position there [m].
    rig : Mapping[str, float]
        The rig's own parameters [SI].
    """

    lost: Array
    pressure: Array
    sign: Array
    time: Array
    ends: Array
    positions: Array
    rig: Mapping[str, float]


def lost_flow(log: GreyBoxLog) -> LostFlow:
    """Return the lost flow of a log; missing where pressure is missing.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    LostFlow
        In at most `PIECES` pieces.
    """
    named = {name: log.drives[:, at] for at, name in enumerate(WIDE_FLOW_FORM.drives)}
    rig = usual_values(log)
    speed, position, pressure = named[SPEED], named[POSITION], log.measured[:, 0]
    ends = np.unique(np.linspace(0, len(speed) - 1, PIECES + 1).astype(np.intp))
    count, time = np.diff(ends), log.sample_time * np.diff(ends)
    means = np.add.reduceat(np.stack([speed, pressure, np.sign(speed)])[:, : ends[-1]], ends[:-1], axis=1) / count
    lost = rig["pump_displacement"] * means[0] - rig["piston_area"] * np.diff(position[ends]) / time
    return LostFlow(lost, means[1], means[2], time, pressure[ends], position[ends], rig)
