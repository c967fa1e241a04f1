"""A motor speed that its logger repeated between slow samples, distinguished from a motor that was driven in steps.

Both look alike. The compression of the oil from sample to sample shows the difference: pump and piston explain it
better with the speed as logged, or with straight lines between samples.
"""

import numpy as np

from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from plant.arrays import Array
from plant.log.record import Record

SURE_GAIN = 10.0
"""Gain in log-likelihood by which straight lines must explain the pressure better [dimensionless]: odds of 20,000. If
the logger repeats other channels too, a loss of up to as much is accepted."""


def is_repeated_by_logger(record: Record, *, others: bool) -> bool:
    """Return whether a speed that changes only in some rows was repeated by its logger, not held by the motor.

    Parameters
    ----------
    record : Record
        The log, with its motor speed held; values that other channels only repeat are missing.
    others : bool
        Whether there are such channels.

    Returns
    -------
    bool
        False unless pressure and position show it.
    """
    if PRESSURE not in record or POSITION not in record:
        return False
    speed, position, pressure = (record[name] for name in (SPEED, POSITION, PRESSURE))
    rows, fresh = np.arange(len(record)), np.append(True, np.diff(speed) != 0.0)
    line = np.interp(rows, rows[fresh], speed[fresh])
    at = np.flatnonzero(fresh & np.isfinite(position) & np.isfinite(pressure))
    span, mean = np.diff(at), 0.5 * (pressure[at[1:]] + pressure[at[:-1]])
    known, rise = np.column_stack([np.diff(position[at]), mean * span, span]), np.diff(pressure[at])
    if len(rise) <= 2 * known.shape[1]:
        return False
    turned = (np.append(0.0, np.cumsum(one)) for one in (speed[:-1], 0.5 * (line[:-1] + line[1:])))
    as_logged, on_lines = (_rise_residual(known, np.diff(one[at]), rise) for one in turned)
    if min(as_logged, on_lines) <= 0.0:
        return False
    return 0.5 * len(rise) * float(np.log(as_logged / on_lines)) > (-SURE_GAIN if others else SURE_GAIN)


def _rise_residual(known: Array, turned: Array, rise: Array) -> float:
    """Return the residual of the pressure's rise after pump, piston and leakage, a sum of squares [Pa squared]."""
    # all that the pump turns, less its flow bias
    pumped = np.column_stack([known, turned, np.sign(turned) * known[:, -1]])
    pumped /= np.maximum(np.max(np.abs(pumped), axis=0), np.finfo(np.float64).tiny)
    return float(np.sum((rise - pumped @ np.linalg.lstsq(pumped, rise)[0]) ** 2))
