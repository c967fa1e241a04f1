"""First guess of when air enters the oil within a log, for the search that fits it.

What the pump delivers and the piston does not sweep leaks, or goes into the oil as its pressure rises. A regression of
that loss, with oil that gives way to pressure as bubbles do from some time on, is solved for many times at once.
"""

from typing import NamedTuple

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.lost_flow import EDGE, PIECES, lost_flow
from plant.arrays import Array


class Entry(NamedTuple):
    """Air that enters the oil within a log.

    Parameters
    ----------
    onset : float
        When it does [fraction of the log].
    share : float
        How much it explains of what oil without it leaves of the lost flow [fraction].
    """

    onset: float
    share: float


NO_ENTRY = Entry(0.5, 0.0)


def likeliest_entry(log: GreyBoxLog) -> Entry:
    """Return the most likely time at which air enters.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    Entry
        `NO_ENTRY` where pressure is missing or still, or no oil becomes softer.
    """
    lost, others, squeezed = _averaged(log)
    pieces = len(lost)
    if pieces < PIECES // 2:
        return NO_ENTRY
    splits = np.arange(round(EDGE * pieces), pieces - round(EDGE * pieces) + 1)
    basis, _ = np.linalg.qr(others)
    left = lost - basis @ (basis.T @ lost)
    # sums over all pieces after each time: with what is left, with the basis, and with itself
    columns = np.column_stack([left, basis, squeezed]) * squeezed[:, None]
    after = np.cumsum(columns[::-1], axis=0)[::-1][splits]
    across, along, size = after[:, 0], after[:, 1:-1], after[:, -1]
    own = size - np.sum(along * along, axis=1)
    told = (across > 0.0) & (own > EDGE * EDGE * size)
    explained = np.where(told, across * across / np.where(told, own, 1.0), 0.0)
    best = int(np.argmax(explained))
    whole = max(float(left @ left), float(np.finfo(float).tiny))
    share = float(explained[best]) / whole
    return Entry(float(splits[best]) / pieces, share) if share > 0.0 else NO_ENTRY


def _averaged(log: GreyBoxLog) -> tuple[Array, Array, Array]:
    """Return the flow that is lost, what it goes with in any case, and with bubbles, piece by piece.

    In any case that is pressure, the speed's sign and the rise of pressure; bubbles shrink by what the inverse of the
    loaded chamber's pressure loses. Each is of its own size.
    """
    flow = lost_flow(log)
    rig, at_ends = flow.rig, flow.ends
    middle = 0.5 * (flow.positions[1:] + flow.positions[:-1])
    volume = 1.0 + np.sign(flow.pressure) * rig["piston_area"] * middle / rig["chamber_volume"]
    bubbles = np.sign(at_ends) * np.abs(at_ends) / (rig["accumulator_pressure"] + np.abs(at_ends))
    rise, squeezed = volume * np.diff(at_ends) / flow.time, volume * np.diff(bubbles) / flow.time
    there = np.isfinite(flow.pressure) & np.isfinite(rise)
    others = np.column_stack([flow.pressure, flow.sign, rise])[there]
    squeezed = squeezed[there]
    return flow.lost[there], others / _largest(others), squeezed / _largest(squeezed)


def _largest(columns: Array) -> Array:
    return np.maximum(np.max(np.abs(columns), axis=0, initial=0.0), float(np.finfo(float).tiny))
