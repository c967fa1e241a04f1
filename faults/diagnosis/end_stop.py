"""Did the piston run into a stop that no rig file names? A circuit with one is laid beside the circuit without."""

from dataclasses import replace

import numpy as np

from faults.diagnosis.circuit_runs import Blocks
from faults.diagnosis.class_fit import LASTING, Actuator, misfit
from faults.diagnosis.class_regions import ClassFits, fit_classes
from plant.arrays import Array

RESTS = 0.05
"""Least time that a piston stands at the farthest place it reached before that may be a stop [s]."""

NEAR = 2e-4
"""How near to its farthest place a piston is taken to stand there [m]: a stop yields, and an encoder has its steps."""

POOR = 0.06
"""Share of velocity or of pressure, root mean square, that a circuit must leave before a stop is looked for [fraction]:
half of what makes a log unknown."""

GAIN = 10.0
"""Log-likelihood that a stop must gain, in `LASTING` blocks that count as one [dimensionless]."""


def stopped(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> tuple[Blocks, ClassFits]:
    """Return a log with the stop that its piston ran into, and the circuits fitted with it.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fits : ClassFits
        The circuits fitted without a stop.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    tuple of Blocks and ClassFits
        As they came where the piston does not stand at its farthest place, where a circuit without a stop follows it,
        or where a stop there explains no more than friction does.
    """
    sizes = np.sqrt(np.nanmean(blocks.outputs[blocks.first :] ** 2, axis=0))
    if np.all(fits.best.scales <= POOR * sizes) or not _stands(blocks):
        return blocks, fits
    with_stop = replace(blocks, stop=blocks.reach)
    again = fit_classes(with_stop, actuator)
    gained = misfit(blocks, fits.best.fitted) - misfit(with_stop, again.best.fitted)
    return (with_stop, again) if gained > GAIN * LASTING else (blocks, fits)


def _stands(blocks: Blocks) -> bool:
    """Return whether the piston stands long enough at the farthest place that it reaches."""
    gone: Array = np.abs(np.cumsum(np.nan_to_num(blocks.velocity))) * blocks.block * blocks.sample_time
    there = gone > blocks.reach - NEAR
    return blocks.reach > 2.0 * NEAR and int(np.sum(there)) * blocks.block * blocks.sample_time > RESTS
