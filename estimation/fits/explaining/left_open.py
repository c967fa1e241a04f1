"""`valves_unseen(fit)`, `wear_open(deviation)`: what a fit leaves open that would pass for a sound actuator."""

import numpy as np

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.models.completed_flow import CRACKS
from estimation.notes import RigCode
from plant.notes import Note

OPEN_DELIVERY = 0.1
"""Standard deviation of the logarithm of the pump's delivery from which a worn pump is not excluded
[dimensionless]: one that delivers 80 % lies within two of it."""


def valves_unseen(fit: GreyBoxFit) -> tuple[Note, ...]:
    """Return a note for a make-up valve of which a log says nothing, the other one being felt.

    With a valve that never opens a log has the same likelihood whatever the valve is. In sound actuators that are
    driven to and fro both are felt.

    Parameters
    ----------
    fit : GreyBoxFit
        A fit of the flow form; one without valves that crack tells nothing.

    Returns
    -------
    tuple of Note
        One at most.
    """
    unseen = [side for side, name in zip("AB", CRACKS, strict=True) if np.isinf(fit.std.get(name, 0.0))]
    return (RigCode.MAKEUP_UNSEEN.note(side=unseen[0]),) if len(unseen) == 1 else ()


def wear_open(deviation: float) -> tuple[Note, ...]:
    """Return a note where a log does not tell a worn pump from leakage.

    Parameters
    ----------
    deviation : float
        Of the logarithm of what the pump delivers, beside all that is fitted [dimensionless].

    Returns
    -------
    tuple of Note
        One at most.
    """
    return (RigCode.WEAR_NOT_EXCLUDED.note(percent=200.0 * deviation),) if deviation > OPEN_DELIVERY else ()
