"""`explained_bound`, `ratio_doubt`: how well bulk modulus is known if the log determines the volume of the chambers.

A piston at rest determines only volume over bulk modulus. A piston that travels changes its chambers by a share that
depends on their volume, so the log determines both. A common scale of all flows and chamber volumes then leaves bulk
modulus unchanged, and the uncertainty of displacement over area counts only as far as the log leaves it open.
"""

import math
from collections.abc import Mapping

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypotheses import VOLUME
from estimation.fits.hypothesis_search.explanation import Explanation

RATIO_ENTRIES = ("pump_displacement", "piston_area")
"""Entries whose ratio scales all flows: bulk modulus responds to both alike, in opposite directions."""


def determines_volume(strange: Explanation | None) -> bool:
    """Return whether an explanation of a log determines the volume of the chambers."""
    return strange is not None and VOLUME.name in strange.names


def explained_bound(strange: Explanation, plain: GreyBoxFit) -> float:
    """Return the relative Cramér-Rao bound of bulk modulus under an explanation.

    Parameters
    ----------
    strange : Explanation
        The explanation of the log.
    plain : GreyBoxFit
        The plain form's fit, with the rig file's volume.

    Returns
    -------
    float
        If the explanation determines the volume, at most the bound at a known volume, since a log with more information
        is no less observable [fraction].
    """
    bound, known = (one.std["bulk_modulus"] / one.values["bulk_modulus"] for one in (strange.fit, plain))
    return min(bound, known) if determines_volume(strange) else bound


def ratio_doubt(strange: Explanation, uncertainties: Mapping[str, float]) -> float:
    """Return the deviation of bulk modulus due to displacement over area, as far as the log leaves the ratio open.

    Parameters
    ----------
    strange : Explanation
        The explanation of the log.
    uncertainties : Mapping[str, float]
        Relative standard deviation of the actuator's parameters [fraction].

    Returns
    -------
    float
        Relative; 0 if the volume is not determined, since the total interval then includes all of it [fraction].
    """
    slopes = [strange.fit.rig_slopes[name]["bulk_modulus"] for name in RATIO_ENTRIES if name in strange.fit.rig_slopes]
    if not determines_volume(strange) or not slopes:
        return 0.0
    response = max(map(abs, slopes)) / strange.fit.values["bulk_modulus"]
    doubt = math.hypot(*(uncertainties.get(name, 0.0) for name in RATIO_ENTRIES))
    return response * min(strange.delivery_open.deviation or 0.0, doubt)
