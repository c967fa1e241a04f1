"""Resolution of the sensors: a residual below it says nothing about the actuator.

An encoder without noise repeats its counts as long as the piston repeats its strokes. Once the piston has crept by a
fraction of a count, other counts repeat, and the residual of every block changes at once. So the smallest step of each
channel is found, and the largest residual that rounding to such steps can leave is added to each block's NIS. As far
as the NIS consists of it, a block scatters at least as one of white noise does.
"""

import math

from plant.arrays import Array

SPEED, PLACE, PRESSURE = range(3)
"""Columns of the steps: motor speed, position, pressure."""

BEFORE, LEAST_STEP = range(2)
"""Rows of the steps: the last sample, and the smallest step so far, relative to the rating [fraction]."""

FINEST, COARSEST = 1e-5, 0.05
"""Steps that count, relative to the rating [fraction]: finer ones are noise, and a coarser least step is that of a set
point or of a drawn line; judged."""

WHITE = 0.45
"""Standard deviation of the log NIS of ten intervals of white noise: the root of 2/10 [dimensionless]."""


TIGHTEST = 0.15
"""Least standard deviation of any class's log NIS [dimensionless]: a residual that grows by 8 % is no fault; judged."""


def find_step(value: float, rating: float, column: int, steps: Array) -> None:
    """Compare a sample with the last one, and keep the smallest step of its channel.

    Parameters
    ----------
    value, rating : float
        Sample and reference of a channel [rad/s, m or Pa].
    column : int
        Channel, see `SPEED`.
    steps : ndarray, shape (2, 3)
        Last samples and smallest steps, by index, see `BEFORE`.
    """
    step = abs(value - steps[BEFORE, column]) / rating
    if step > FINEST and step < steps[LEAST_STEP, column]:
        steps[LEAST_STEP, column] = step
    steps[BEFORE, column] = value


def unresolved(balance: int, balances: int, steps: Array) -> float:
    """Return the largest squared residual of a balance that rounding to the smallest steps leaves.

    A value is wrong by half a step at most, the difference of two positions by a whole one.

    Parameters
    ----------
    balance, balances : int
        Which balance, of how many.
    steps : ndarray, shape (2, 3)
        Last samples and smallest steps.

    Returns
    -------
    float
        Squared residual, relative to the rating [dimensionless].
    """
    speed, place, pressure = steps[LEAST_STEP, SPEED], steps[LEAST_STEP, PLACE], steps[LEAST_STEP, PRESSURE]
    if balances == 2 and balance == 1:
        return 0.25 * pressure * pressure if pressure <= COARSEST else 0.0
    squared = place * place if place <= COARSEST else 0.0
    if speed <= COARSEST:
        squared += 0.25 * speed * speed
    return squared


def least_deviation(rounding: float, usual: float) -> float:
    """Return the least standard deviation of a class's log NIS, more by the share of rounding in its usual NIS.

    Parameters
    ----------
    rounding : float
        Squared residual by rounding, which is part of every NIS [dimensionless].
    usual : float
        Usual log NIS of the class [dimensionless].
    """
    share = min(rounding * math.exp(-usual), 1.0) if rounding > 0.0 else 0.0
    return max(WHITE * share, TIGHTEST)
