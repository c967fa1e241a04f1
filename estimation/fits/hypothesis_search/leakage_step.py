"""First guess of a step of leakage within a log, for the search that fits it.

What the pump delivers and the piston does not sweep leaks, or goes into the oil as its pressure rises. A regression of
that loss on pressure, with one leakage before a time and another after, is solved for many times at once.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.lost_flow import EDGE, PIECES, lost_flow
from plant.arrays import Array

FIRST_WIDTH = 0.02
"""Length of the step with which a search begins [fraction of the log]: four pieces."""


class Step(NamedTuple):
    """A step of leakage.

    Parameters
    ----------
    first : Mapping[str, float]
        Leakage after it, and `leakage_before`, `step_at` and `step_width` of the wide form: first guesses [SI].
    share : float
        How much it explains of what one leakage leaves of the lost flow [fraction].
    """

    first: Mapping[str, float]
    share: float


NO_STEP = Step({}, 0.0)


def likeliest_step(log: GreyBoxLog) -> Step:
    """Return the most likely time of a step of leakage, and its size.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    Step
        `NO_STEP` where pressure is missing or still.
    """
    lost, along, others = _averaged(log)
    pieces = len(lost)
    splits = np.arange(round(EDGE * pieces), pieces - round(EDGE * pieces) + 1)
    if pieces < PIECES // 2:
        return NO_STEP
    columns = np.column_stack([along, others, lost])
    whole = columns.T @ columns
    early = np.cumsum(columns * along[:, None], axis=0)[splits - 1]  # products with pressure before a step
    late = whole[0] - early
    gram = np.zeros((len(splits), 4, 4))
    gram[:, 0, 0], gram[:, 1, 1] = early[:, 0], late[:, 0]
    gram[:, 0, 2:] = gram[:, 2:, 0] = early[:, 1:-1]
    gram[:, 1, 2:] = gram[:, 2:, 1] = late[:, 1:-1]
    gram[:, 2:, 2:] = whole[1:-1, 1:-1]
    right = np.column_stack([early[:, -1], late[:, -1], np.broadcast_to(whole[1:-1, -1], (len(splits), 2))])
    solved = np.einsum("sij,sj->si", np.linalg.pinv(gram, hermitian=True), right)
    explained = np.where(np.all(solved[:, :2] > 0.0, axis=1), np.einsum("si,si->s", right, solved), -np.inf)
    best = int(np.argmax(explained))
    if not np.isfinite(explained[best]):
        return NO_STEP
    before, after = map(float, solved[best, :2])
    first = {"leakage_coefficient": after, "leakage_before": before / after - 1.0}
    first |= {"step_at": float(splits[best]) / pieces, "step_width": FIRST_WIDTH}
    alike = float(whole[:-1, -1] @ np.linalg.pinv(whole[:-1, :-1], hermitian=True) @ whole[:-1, -1])
    left = float(whole[-1, -1])
    return Step(first, (float(explained[best]) - alike) / max(left - alike, float(np.finfo(float).tiny)))


def _averaged(log: GreyBoxLog) -> tuple[Array, Array, Array]:
    """Return the flow that is lost, the differential pressure, and what the loss goes with besides, piece by piece.

    That is the flow bias, with the speed's sign, and the rise of pressure; each of its own size.
    """
    flow = lost_flow(log)
    rise = np.diff(flow.ends) / flow.time
    there = np.isfinite(flow.pressure) & np.isfinite(rise)
    steepest = max(float(np.max(np.abs(rise[there]), initial=0.0)), 1.0)
    return flow.lost[there], flow.pressure[there], np.column_stack([flow.sign, rise / steepest])[there]
