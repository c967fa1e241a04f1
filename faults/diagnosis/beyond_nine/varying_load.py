"""`varying_load(blocks, parameters)`: a force on the rod that changes over the log, as from waves or wind.

No circuit follows such a log, and nothing is wrong with its oil. The force balance of the sliding piston distinguishes
the force from varying friction: friction changes sign with direction, a load does not.
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

EXPLAINED = 0.7
"""Share of what friction, inertia, spring and constant load leave that a varying load must explain [fraction];
judged."""

BETTER = 0.5
"""Largest ratio of the residual with a varying load to that with varying friction [dimensionless]; judged."""

MATTERS = 0.05
"""Share of the pressure force from which a varying load matters, both root mean square [fraction], as for a constant
one."""


def varying_load(blocks: Blocks, p: EhaParameters) -> Note | None:
    """Return a note on a load that changes over the log.

    Parameters
    ----------
    blocks : Blocks
        The log, which no circuit follows.
    p : EhaParameters
        The actuator, as its rig file has it.

    Returns
    -------
    Note or None
        None without pressure, and if another cause leaves as little of the force balance.
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
    none, _ = _left(balance.columns, balance.push)
    of_friction, _ = _left(np.hstack([balance.columns, way * course]), balance.push)
    of_load, found = _left(np.hstack([balance.columns, course]), balance.push)
    force = course @ found[balance.columns.shape[1] :]
    size = p.piston_area * float(np.sqrt(np.mean(balance.pressure**2)))
    if of_load > min((1.0 - EXPLAINED) * none, BETTER * of_friction) or float(np.std(force)) < MATTERS * size:
        return None
    return AgainstCode.LOAD_VARIES.note(force_n=float(np.std(force)))


def _left(columns: Array, push: Array) -> tuple[float, Array]:
    """Return the sum of squares that columns leave of a force [N^2], and their minimum-norm coefficients.

    The mean of a varying load and a constant force are the same, so the coefficients are not unique.
    """
    sizes = np.maximum(np.max(np.abs(columns), axis=0), np.finfo(np.float64).tiny)
    found = np.linalg.lstsq(columns / sizes, push)[0]
    return float(np.sum((push - columns / sizes @ found) ** 2)), found / sizes
