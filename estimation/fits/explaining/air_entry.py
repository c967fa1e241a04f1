"""Where air gets into the oil within a log, roughly: a start for the search that fits it.

What the pump delivers and the piston does not sweep leaks, or goes into the oil as its pressure rises. A regression of
that loss, with oil that gives way to pressure as bubbles do from some time on, is solved for many times at once.
"""

from typing import NamedTuple

import numpy as np

from estimation.fits.explaining.leakage_step import EDGE, PIECES
from estimation.fits.explaining.wide_log import usual_values
from estimation.fits.greybox.log import GreyBoxLog
from estimation.log_checks.channel_names import POSITION, SPEED
from estimation.models.wide_flow import WIDE_FLOW_FORM
from plant.arrays import Array


class Entry(NamedTuple):
    """Air that gets in.

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
    """Return when air gets in likeliest.

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
    named = {name: log.drives[:, at] for at, name in enumerate(WIDE_FLOW_FORM.drives)}
    rig = usual_values(log)
    speed, position, pressure = named[SPEED], named[POSITION], log.measured[:, 0]
    ends = np.unique(np.linspace(0, len(speed) - 1, PIECES + 1).astype(np.intp))
    count, time = np.diff(ends), log.sample_time * np.diff(ends)
    means = np.add.reduceat(np.stack([speed, pressure, np.sign(speed)])[:, : ends[-1]], ends[:-1], axis=1) / count
    lost = rig["pump_displacement"] * means[0] - rig["piston_area"] * np.diff(position[ends]) / time
    middle = 0.5 * (position[ends[1:]] + position[ends[:-1]])
    volume = 1.0 + np.sign(means[1]) * rig["piston_area"] * middle / rig["chamber_volume"]
    supply, at_ends = rig["accumulator_pressure"], pressure[ends]
    bubbles = np.sign(at_ends) * np.abs(at_ends) / (supply + np.abs(at_ends))
    rise, squeezed = volume * np.diff(at_ends) / time, volume * np.diff(bubbles) / time
    there = np.isfinite(means[1]) & np.isfinite(rise)
    others = np.column_stack([means[1], means[2], rise])[there]
    squeezed = squeezed[there]
    return lost[there], others / _largest(others), squeezed / _largest(squeezed)


def _largest(columns: Array) -> Array:
    return np.maximum(np.max(np.abs(columns), axis=0, initial=0.0), float(np.finfo(float).tiny))
