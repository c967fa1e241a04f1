"""`explained_bound`, `ratio_doubt`: how well bulk modulus is known if the log determines the volume of the chambers.

A piston at rest determines only volume over bulk modulus. A piston that travels changes its chambers by a share that
depends on their volume, so the log determines both. A common scale of all flows and chamber volumes then leaves bulk
modulus unchanged, and the uncertainty of displacement over area counts only as far as the log leaves it open.

A piston that hardly travels tells the volume by a few parts in a thousand of the flows: see `unlikely_volume`.
"""

import math
from collections.abc import Mapping, Sequence

from estimation.finding import NORMAL_95
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypotheses import VOLUME
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.notes import RigCode
from plant.notes import Note

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


def unlikely_volume(strange: Explanation, plain: GreyBoxFit, written: float) -> tuple[Note, ...]:
    """Return a note on another volume that gains more than chance, though the rig file makes it too unlikely.

    Parameters
    ----------
    strange : Explanation
        The explanation that is not believed.
    plain : GreyBoxFit
        The plain form's fit, with the rig file's volume.
    written : float
        That volume [m^3].

    Returns
    -------
    tuple of Note
        Empty if the explanation has no volume of its own.
    """
    if not determines_volume(strange):
        return ()
    volume, std = strange.values[VOLUME.free[0]]
    moved = strange.values["bulk_modulus"][0] / plain.values["bulk_modulus"] - 1.0
    told = RigCode.VOLUME_UNLIKELY.note(
        percent=100.0 * volume / written, half_width=100.0 * NORMAL_95 * std / written, modulus_percent=100.0 * moved
    )
    return (told,)


def unlikely_volume_doubt(remarks: Sequence[Note]) -> float:
    """Return the deviation of bulk modulus with which its interval reaches the value at an unlikely volume.

    Parameters
    ----------
    remarks : sequence of Note
        What a log leaves undecided, see `unlikely_volume`.

    Returns
    -------
    float
        Relative; 0 if no volume is in doubt [fraction].

    Examples
    --------
    >>> note = RigCode.VOLUME_UNLIKELY.note(percent=57.0, half_width=16.0, modulus_percent=-44.0)
    >>> round(unlikely_volume_doubt([note]), 2), unlikely_volume_doubt([])
    (0.3, 0.0)
    """
    moved = [
        math.log1p(0.01 * float(one.data["modulus_percent"])) for one in remarks if one.code == RigCode.VOLUME_UNLIKELY
    ]
    return max(map(abs, moved), default=0.0) / NORMAL_95
