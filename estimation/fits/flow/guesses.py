"""`guesses_about(around, model, p)`: guesses of the flow form's unknowns. The search begins at the likeliest."""

from collections.abc import Mapping, Sequence
from itertools import product
from math import prod

import numpy as np

from estimation.fits.hypothesis_search.fault_guesses import WORST_LEAKAGE, faulty_coefficient
from estimation.models.greybox import GreyBoxModel
from plant.arrays import Array
from plant.eha.model import EhaParameters

GUESSED: Mapping[str, Sequence[float]] = {
    "leakage_coefficient": (1.0, 2.5, 5.0, 8.0, WORST_LEAKAGE),
    "flow_bias": (1.0, 3.5, 6.0),
    "bulk_modulus": (0.7, 1.0, 1.3),
}
"""Guesses of the unknowns, as multiples of the first start [dimensionless]: leakage and flow bias of the paper's rig,
from the healthy actuator to the worst of Table 3."""


def guesses_about(around: Mapping[str, float], model: GreyBoxModel, p: EhaParameters) -> list[Array]:
    """Return all combinations of guesses about a start.

    Parameters
    ----------
    around : Mapping[str, float]
        Values of the start, by unknown [SI].
    model : GreyBoxModel
        The form that has these unknowns.
    p : EhaParameters
        The actuator, for the size of its faults.

    Returns
    -------
    list of ndarray, shape (unknowns,)
        Coordinates [dimensionless].
    """
    places = [model.unknowns.index(name) for name in GUESSED]

    def times(name: str, factor: float) -> float:
        return factor * around[name] if name == "bulk_modulus" else faulty_coefficient(p, name, around[name], factor)

    tried = [
        [model.theta({**around, name: times(name, factor)})[place] for factor in factors]
        for place, (name, factors) in zip(places, GUESSED.items(), strict=True)
    ]
    guesses = np.tile(model.theta(around), (prod(map(len, tried)), 1))
    guesses[:, places] = list(product(*tried))
    return list(guesses)
