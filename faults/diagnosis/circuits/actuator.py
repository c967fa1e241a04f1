"""A healthy actuator and its nine conditions, as points in the coordinates of fitted circuits."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters, circuit_of, longest_stroke
from plant.eha.model import EhaParameters
from plant.eha.steady_state import steady_state

MOST_VOLUME = 2.0
"""Ratio to a rig file's volume that its stroke may require [dimensionless]: as far as volumes are searched. Beyond it,
stroke or unit is wrong, and no circuit fits."""


@dataclass(frozen=True, eq=False)
class Actuator:
    """A healthy actuator and its nine conditions as points.

    Parameters
    ----------
    circuit : CircuitParameters
        The healthy circuit.
    rated : float
        Its velocity at rated speed [m/s].
    conditions : ndarray, shape (9, 7)
        Coordinates of the nine nominal circuits, in the order of `CONDITIONS`.
    load_doubt : float
        Standard deviation of the constant force on its rod, if it was found from a log [N]; 0 if the rig file states
        it.
    """

    circuit: CircuitParameters
    rated: float
    conditions: Array
    load_doubt: float = 0.0


@lru_cache(maxsize=8)
def actuator_of(parameters: EhaParameters) -> Actuator:
    """Return the actuator of a rig with its nine conditions; cached for the next log.

    Parameters
    ----------
    parameters : EhaParameters
        The healthy actuator.

    Raises
    ------
    RigError
        If no circuit fits around it.
    """
    parameters = with_room_for_stroke(parameters)
    rated = steady_state(parameters.rated_speed, parameters)[0]
    points = [coordinates_of(parameters_for(condition, parameters), rated) for condition in CONDITIONS.values()]
    circuit = circuit_of(parameters)
    if parameters.stroke is None:
        circuit = replace(circuit, stroke=float(longest_stroke(circuit)))
    return Actuator(circuit, rated, np.array(points))


def with_room_for_stroke(p: EhaParameters) -> EhaParameters:
    """Return an actuator whose chambers have room for its stroke: a stroke is measured, a volume is estimated.

    Returns
    -------
    EhaParameters
        With the least volume that its stroke requires, if the file states less; unchanged if no error of a volume can
        explain it.
    """
    wanted = (p.stroke or 0.0) / float(longest_stroke(p))
    return replace(p, chamber_volume=wanted * p.chamber_volume) if 1.0 < wanted < MOST_VOLUME else p
