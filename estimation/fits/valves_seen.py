"""`valves_unseen(fit)`: make-up valves that never opened in a log, while the other side's did."""

import numpy as np

from estimation.fits.greybox_fit import GreyBoxFit
from estimation.models.completed_flow import CRACKS
from estimation.notes import RigCode
from plant.notes import Note


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
