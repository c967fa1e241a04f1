"""An offset of motor speed that slopes do not show: one that looks like a pressure offset, and one on a tight rig.

Leakage under a pressure offset equals a pump flow in the other direction. Only other effects of chamber pressure, such
as make-up flow, distinguish the two.

A surplus of pumped oil leaks off at a pressure of its own, which is large if leakage is small. The plain form then ends
in another minimum. The flow lost between pump and piston determines the offset without it.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.pump_ripple import with_ripple
from estimation.fits.hypothesis_search.lost_flow import lost_flow
from estimation.fits.hypothesis_search.pump_ripple_fits import LEAST_OFFSET, OFFSET_WORTH, RippleFits, is_sure
from estimation.fits.hypothesis_search.wide_log import widened_log
from plant.eha.model import EhaParameters

DETERMINED_DEVIATIONS = 4.0
"""Deviations from which the lost flow determines an offset of speed [dimensionless]; judged: pieces of a log are not
independent, and a fit with the offset decides."""

MOST_SHARE = 0.03
"""Largest offset found in this way, over the rated speed [fraction]; judged: converters and tachometers have 0.1 to 2
%. A slow loop with hardly any pressure gave 12 %."""


def speed_offset_instead(
    log: GreyBoxLog,
    fitted: Callable[[GreyBoxLog], Sequence[GreyBoxFit]],
    found: Mapping[str, tuple[float, float]],
    displacement: float,
    cost: float,
) -> float:
    """Return the offset of the logged speed, if it explains a log better than a pressure offset does.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.
    fitted : callable
        ``fitted(log)``: its fits by every plain form that counts.
    found : Mapping[str, tuple of float]
        Value and deviation of the explanation, by parameter [SI].
    displacement : float
        Displacement of the pump [m^3/rad].
    cost : float
        Cost that a plain fit must stay below [dimensionless].

    Returns
    -------
    float
        Offset of speed [rad/s]; zero if no pressure offset was found, or the speed offset explains less.
    """
    if "pressure_offset" not in found:
        return 0.0
    offset = -found["leakage_coefficient"][0] * found["pressure_offset"][0] / displacement
    if abs(offset) < LEAST_OFFSET:
        return 0.0
    return offset if min(fit.cost for fit in fitted(with_ripple(log, (), offset))) < cost else 0.0


def offset_by_lost_flow(log: GreyBoxLog, parameters: EhaParameters) -> float:
    """Return the offset of the logged speed from the flow lost between pump and piston.

    Least squares over pieces of the log, with leakage, flow bias, compression and another delivery as further unknowns.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.

    Returns
    -------
    float
        First guess [rad/s]; zero if the log does not determine it.
    """
    flow = lost_flow(widened_log(log, parameters))
    rise, swept = np.diff(flow.ends) / flow.time, np.diff(flow.positions) / flow.time
    columns = np.column_stack([flow.pressure, flow.sign, rise, swept, np.full_like(rise, parameters.pump_displacement)])
    there = np.isfinite(columns).all(axis=1) & np.isfinite(flow.lost)
    sizes = np.max(np.abs(columns[there]), axis=0, initial=0.0)
    if np.count_nonzero(there) <= len(sizes) or not np.all(sizes > 0.0):
        return 0.0
    columns, lost = columns[there] / sizes, flow.lost[there]
    known = np.linalg.pinv(columns.T @ columns, hermitian=True)
    found = known @ (columns.T @ lost)
    left = lost - columns @ found
    spread = (float(left @ left) / (len(left) - len(sizes)) * float(known[-1, -1])) ** 0.5
    offset = float(found[-1] / sizes[-1])
    told = abs(found[-1]) > DETERMINED_DEVIATIONS * spread and abs(offset) < MOST_SHARE * parameters.rated_speed
    return offset if told else 0.0


def confirms_offset(found: RippleFits, largest: float, parameters: EhaParameters) -> bool:
    """Return whether fits with an offset from lost flow leave nothing to explain for other effects or another offset.

    Parameters
    ----------
    found : RippleFits
        The fits.
    largest : float
        As in `with_pump_ripple` [dimensionless].
    """
    small = abs(found.log.speed_offset) < MOST_SHARE * parameters.rated_speed
    return small and is_sure(found, largest) and found.best.speed_offset.gain < OFFSET_WORTH
