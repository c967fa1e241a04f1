"""If a log leaves two classes open, its severities cover the circuits of both.

If a piston moves at a fifth of its rated velocity, friction that rises with the square of velocity may fit nearly as
well as friction that does not. The best fit then says little about friction at rated velocity, though its covariance,
which knows only one minimum, is narrow.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import fit_freely
from faults.diagnosis.circuits.class_regions import ClassFits, is_stuck
from plant.arrays import Array

LEAST_PROBABILITY = 0.025
"""Least probability of a class whose circuit counts [probability]: what an interval leaves out at either end."""


class OpenCircuit(NamedTuple):
    """A circuit that a log leaves open.

    Parameters
    ----------
    coordinates : ndarray, shape (7,)
        In the order of `faults.diagnosis.circuits.circuit_runs.COORDINATES`.
    probability : float
        Probability of its class [probability].
    """

    coordinates: Array
    probability: float


def circuits_left_open(
    blocks: Blocks, fits: ClassFits, actuator: Actuator, probabilities: Mapping[str, float]
) -> list[OpenCircuit]:
    """Return the best circuit about each class that the log leaves open.

    Parameters
    ----------
    probabilities : Mapping[str, float]
        Probability of each condition [probability].

    Returns
    -------
    list of OpenCircuit
        The best one of all first, whatever the probability of its class. It is alone if the log determines the class,
        if pressure is not logged (leakage and friction then share one scale), or if the piston sticks, since friction
        is then open in any case.
    """
    nearest = list(CONDITIONS)[int(np.argmax(fits.scores))]
    found = [OpenCircuit(fits.best.coordinates, max(LEAST_PROBABILITY, probabilities[nearest]))]
    if blocks.pressure is None or is_stuck(blocks, actuator):
        return found
    for name, probability in probabilities.items():
        if name != nearest and probability >= LEAST_PROBABILITY:
            found.append(OpenCircuit(fit_freely(blocks, actuator, name).coordinates, probability))
    return found
