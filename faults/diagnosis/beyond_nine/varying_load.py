"""`varying_load(blocks, parameters)`: a force on the rod that changes over the log, or friction that does.

No circuit follows a log whose load a sea or an air stream makes, nor one whose rod grips at times, and nothing about
its oil is wrong. The force balance of the sliding piston tells the two apart: friction turns round with the piston, a
load does not.
"""

import numpy as np

from faults.diagnosis.beyond_nine.force_balance import sliding_balance
from faults.diagnosis.circuits.blocks import Blocks
from faults.notes import AgainstCode
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.notes import Note

SPACING = 0.4
"""Time between the knots of the force [s]; judged: it follows oscillations up to one hertz."""

FEWEST_A_KNOT = 5.0
"""Least number of blocks with a sliding piston per knot [count]."""

LEAST_EXPLAINED = 0.7
"""Share of what friction, inertia, spring and constant load leave that a varying load must explain [fraction];
judged."""

MOST_LEFT_RATIO = 0.5
"""What a course of the one must leave, at most, over what a course of the other leaves [dimensionless]; judged."""

LEAST_FORCE_SHARE = 0.05
"""Share of the pressure's force from which what varies matters, both root mean square [fraction], as a constant load
does."""

LEAST_OPPOSING_SHARE = 0.95
"""Least share of the force left over by the usual friction that must oppose the motion, as a sum of squares [fraction].
A load that changes by itself also drives the piston; eight logs with six bursts of friction give at least 0.997."""

LEAST_EACH_WAY = 0.02
"""Least share of it in each direction of motion [fraction]; judged. In one direction alone it may be a load."""

ROUNDS = 20
"""Rounds of reweighted least squares [count]; judged."""


def varying_load(blocks: Blocks, p: EhaParameters) -> Note | None:
    """Return a note on a load, or on friction, that changes over the log.

    Parameters
    ----------
    blocks : Blocks
        The log, which no circuit follows.
    p : EhaParameters
        The actuator, as its rig file has it.

    Returns
    -------
    Note or None
        None without pressure, and where no such cause explains the force balance. While a piston slides one way, load
        and friction look alike; friction is told where all that is unusual holds the piston back, both ways, and
        friction or load where it does so one way.
    """
    balance = sliding_balance(blocks, p)
    if balance is None:
        return None
    time = np.flatnonzero(balance.use) * blocks.block * blocks.sample_time
    knots = np.arange(time[0], time[-1] + SPACING, SPACING)
    if len(knots) < 3 or len(time) < FEWEST_A_KNOT * len(knots):
        return None
    course = np.maximum(1.0 - np.abs(time[:, None] - knots) / SPACING, 0.0)
    way = balance.columns[:, [3]]
    none, _ = _least_squares(balance.columns, balance.push)
    of_friction, _ = _least_squares(np.hstack([balance.columns, way * course]), balance.push)
    of_load, found = _least_squares(np.hstack([balance.columns, course]), balance.push)
    force = course @ found[balance.columns.shape[1] :]
    matters = LEAST_FORCE_SHARE * p.piston_area * float(np.sqrt(np.mean(balance.pressure**2)))
    if (
        of_load <= min((1.0 - LEAST_EXPLAINED) * none, MOST_LEFT_RATIO * of_friction)
        and float(np.std(force)) >= matters
    ):
        return AgainstCode.LOAD_VARIES.note(force_n=float(np.std(force)))
    more = way[:, 0] * _robust_residuals(balance.columns, balance.push)
    grips = np.maximum(more, 0.0) ** 2
    at_times = np.sum(grips) >= LEAST_OPPOSING_SHARE * np.sum(more**2)
    if of_friction > (1.0 - LEAST_EXPLAINED) * none or not at_times or float(np.sqrt(np.mean(grips))) < matters:
        return None
    size, at = float(np.quantile(more, 0.99)), float(time[np.argmax(more)])
    one_way = float(np.sum(grips[way[:, 0] > 0.0]) / np.sum(grips))
    if min(one_way, 1.0 - one_way) < LEAST_EACH_WAY:
        return AgainstCode.GRIPS_ONE_WAY.note(force_n=size, at_s=at)
    return AgainstCode.FRICTION_VARIES.note(force_n=size, at_s=at)


def _robust_residuals(columns: Array, push: Array) -> Array:
    """Return what columns leave of a force by least absolute values [N]: what is there at times alone is left whole."""
    weights, left = np.ones(len(push)), push
    for _ in range(ROUNDS):
        root = np.sqrt(weights)
        _, found = _least_squares(columns * root[:, None], push * root)
        left = push - columns @ found
        weights = 1.0 / np.maximum(np.abs(left), max(float(np.median(np.abs(left))), np.finfo(np.float64).tiny))
    return left


def _least_squares(columns: Array, push: Array) -> tuple[float, Array]:
    """Return the sum of squares that columns leave of a force [N^2], and their minimum-norm coefficients.

    The mean of a varying load and a constant force are the same, so the coefficients are not unique.
    """
    sizes = np.maximum(np.max(np.abs(columns), axis=0), np.finfo(np.float64).tiny)
    found = np.linalg.lstsq(columns / sizes, push)[0]
    return float(np.sum((push - columns / sizes @ found) ** 2)), found / sizes
