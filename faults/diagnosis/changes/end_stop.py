"""Did the piston run into a stop that no rig file states? A circuit with one is compared with the circuit without."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import LASTING, misfit
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes

LEAST_REST = 0.05
"""Least time that a piston rests at its farthest place for that to be a possible stop [s]."""

NEAR_DISTANCE = 2e-4
"""Distance from its farthest place within which a piston rests there [m]: a stop yields, and an encoder has steps."""

POOR_RESIDUAL = 0.06
"""Share of velocity or of pressure, root mean square, that a circuit must leave before a stop is looked for [fraction]:
half of the limit for an unknown log."""

GAIN = 10.0
"""Log-likelihood that a stop must gain, in `LASTING` blocks that count as one [dimensionless]."""


def with_end_stop(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> tuple[Blocks, ClassFits]:
    """Return a log with the stop that its piston ran into, and the circuits fitted with it.

    Parameters
    ----------
    fits : ClassFits
        The circuits fitted without a stop.

    Returns
    -------
    tuple of Blocks and ClassFits
        Unchanged if the piston does not rest at its farthest place, if a circuit without a stop follows it, or if a
        stop there explains no more than friction does. Otherwise samples at the stop are missing: the compliance of the
        stop would be taken for friction.
    """
    if np.all(fits.best.scales <= POOR_RESIDUAL * blocks.rms) or not _rests_at_end(blocks):
        return blocks, fits
    with_stop = replace(blocks, stop=blocks.reach)
    again = fit_classes(with_stop, actuator)
    gained = misfit(blocks, fits.best.fitted) - misfit(with_stop, again.best.fitted)
    if gained <= GAIN * LASTING:
        return blocks, fits
    there = _blocks_at_farthest(blocks)
    pressure = None if blocks.pressure is None else np.where(there, np.nan, blocks.pressure)
    free = replace(with_stop, velocity=np.where(there, np.nan, blocks.velocity), pressure=pressure)
    return free, fit_classes(free, actuator, start=again.best.coordinates)


def _rests_at_end(blocks: Blocks) -> bool:
    """Return whether the piston rests long enough at its farthest place."""
    there = _blocks_at_farthest(blocks)
    return blocks.reach > 2.0 * NEAR_DISTANCE and int(np.sum(there)) * blocks.block * blocks.sample_time > LEAST_REST


def _blocks_at_farthest(blocks: Blocks) -> NDArray[np.bool_]:
    """Return in which blocks the piston is at its farthest place."""
    gone = np.abs(np.cumsum(np.nan_to_num(blocks.velocity))) * blocks.block * blocks.sample_time
    return gone > blocks.reach - NEAR_DISTANCE
