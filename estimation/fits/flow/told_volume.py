"""`bound_told`, `ratio_doubt`: how well bulk modulus is known where the log tells the volume of the chambers.

Volume over bulk modulus is all that a piston at rest tells. One that travels changes its chambers by a share that hangs
on their volume, so that the log tells both. Then a scale of all flows alike, with chambers that grow along, leaves bulk
modulus as it is, and what is not known of displacement over area is open as far as the log leaves it.
"""

import math
from collections.abc import Mapping

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypotheses import VOLUME
from estimation.fits.hypothesis_search.explanation import Explanation

RATIO = ("pump_displacement", "piston_area")
"""Entries whose ratio scales all flows: bulk modulus answers to either alike, the other way round."""


def is_told(strange: Explanation | None) -> bool:
    """Return whether an explanation of a log tells the volume of the chambers."""
    return strange is not None and VOLUME.name in strange.names


def bound_told(strange: Explanation, plain: GreyBoxFit) -> float:
    """Return the relative Cramér-Rao bound of bulk modulus under an explanation.

    Parameters
    ----------
    strange : Explanation
        What explains the log.
    plain : GreyBoxFit
        The plain form's fit, with the rig file's volume.

    Returns
    -------
    float
        Where the explanation tells the volume, at most that with a known volume: a log that tells more is no less
        observable for it [fraction].
    """
    bound, known = (one.std["bulk_modulus"] / one.values["bulk_modulus"] for one in (strange.fit, plain))
    return min(bound, known) if is_told(strange) else bound


def ratio_doubt(strange: Explanation, uncertainties: Mapping[str, float]) -> float:
    """Return the deviation of bulk modulus from displacement over area, as far as the log leaves it open.

    Parameters
    ----------
    strange : Explanation
        What explains the log.
    uncertainties : Mapping[str, float]
        Relative standard deviation of the actuator's parameters [fraction].

    Returns
    -------
    float
        Relative; none where the volume is not told, whose total interval holds all of it [fraction].
    """
    slopes = [strange.fit.rig_slopes[name]["bulk_modulus"] for name in RATIO if name in strange.fit.rig_slopes]
    if not is_told(strange) or not slopes:
        return 0.0
    response = max(map(abs, slopes)) / strange.fit.values["bulk_modulus"]
    doubt = math.hypot(*(uncertainties.get(name, 0.0) for name in RATIO))
    return response * min(strange.delivery_open.deviation or 0.0, doubt)
