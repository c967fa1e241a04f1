"""`speed_offset_instead(log, fitted, found, displacement, cost)`: an offset of speed mistaken for one of pressure.

Leakage under a pressure that reads too much is what a pump would have to deliver in the other direction. Only what else
hangs on a chamber's pressure, as make-up does, tells the two apart.
"""

from collections.abc import Callable, Mapping, Sequence

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.pump_ripple import with_ripple
from estimation.fits.hypothesis_search.pump_ripple_fits import LEAST_OFFSET


def speed_offset_instead(
    log: GreyBoxLog,
    fitted: Callable[[GreyBoxLog], Sequence[GreyBoxFit]],
    found: Mapping[str, tuple[float, float]],
    displacement: float,
    cost: float,
) -> float:
    """Return the offset of the logged speed, if it explains a log better than an offset of pressure.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.
    fitted : callable
        ``fitted(log)``: its fits by every plain form that counts.
    found : Mapping[str, tuple of float]
        Value and deviation of what explains the log, by parameter [SI].
    displacement : float
        Of the pump [m^3/rad].
    cost : float
        What a plain fit has to stay below [dimensionless].

    Returns
    -------
    float
        Offset of speed [rad/s]; zero where no pressure offset was found, and where the speed explains less.
    """
    if "pressure_offset" not in found:
        return 0.0
    offset = -found["leakage_coefficient"][0] * found["pressure_offset"][0] / displacement
    if abs(offset) < LEAST_OFFSET:
        return 0.0
    return offset if min(fit.cost for fit in fitted(with_ripple(log, (), offset))) < cost else 0.0
