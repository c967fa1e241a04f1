"""Parts of a circuit that a log does not determine; their values are those of the prior.

See decision 302.
"""

import numpy as np

from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import WEAK_PRIOR
from faults.diagnosis.circuits.class_regions import ClassFits

BLIND_RATIO = 0.9
"""Ratio of posterior to prior deviation from which a log says nothing about a coefficient [dimensionless]."""

FRICTION_LAW = frozenset({"friction_rated", "friction_rest"})
"""Coordinates of a circuit that determine its friction."""


def undetermined_coordinates(fits: ClassFits) -> frozenset[str]:
    """Return the coordinates of the best circuit that a log does not narrow.

    Returns
    -------
    frozenset[str]
        Of `faults.diagnosis.circuits.circuit_runs.COORDINATES`.
    """
    known, believed = np.sqrt(np.diag(fits.covariance)), np.sqrt(np.diag(WEAK_PRIOR))
    return frozenset(name for name, k, b in zip(COORDINATES, known, believed, strict=True) if k > BLIND_RATIO * b)
