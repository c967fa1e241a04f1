"""`valves_unseen(fit)`, `wear_open(promise)`: what a fit leaves open that would pass for a sound actuator."""

import numpy as np

from estimation.fits.explaining.promises import Promise
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.models.completed_flow import CRACKS
from estimation.notes import RigCode
from plant.notes import Note

OPEN_DELIVERY = 0.1
"""How far the logarithm of the pump's delivery may lie below that of a sound one, within two deviations, from which a
worn pump is not excluded [dimensionless]: the probability of one that delivers less than 90 % is then 2 % or more."""

LEAST_WORN = 0.03
"""How far it must likeliest lie below for a worn pump not to be excluded where two deviations exclude a sound one
[dimensionless]: slopes promise too little of a pump that is far from sound. None of 88 sound training logs at one speed
promised as much without being open already."""


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


def wear_open(delivery: Promise) -> tuple[Note, ...]:
    """Return a note where a log does not tell a worn pump from leakage or from a flow bias.

    Parameters
    ----------
    delivery : Promise
        What a delivery of its own promises beside all that is fitted.

    Returns
    -------
    tuple of Note
        One at most.
    """
    width = 2.0 * delivery.deviation
    less = width - delivery.size
    sound = delivery.size >= -max(width, LEAST_WORN)
    if sound and not less > OPEN_DELIVERY:
        return ()
    return (RigCode.WEAR_NOT_EXCLUDED.note(percent=100.0 * less, half_width=100.0 * width),)
