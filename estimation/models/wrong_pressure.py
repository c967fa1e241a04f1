"""`pressure_error(pressures, elapsed, p)`: error of a pressure sensor, apart from its lag."""

from types import SimpleNamespace
from typing import Any

from plant.compiled.functions import Scalar

SETTLING = "drift_settling"
"""Parameter that states how far a drifting offset settles within the log."""

MOST_SETTLING = 12.0
"""Most time constants of a settling offset within a log [1]: `relative_drift` has an error of 0.002 there."""


def pressure_error(pressures: tuple[Scalar, Scalar], elapsed: Scalar, p: SimpleNamespace) -> Scalar:
    """Return the error of the pressure sensor, apart from its lag [Pa].

    Parameters
    ----------
    pressures : tuple of float or Expression
        Of the chambers, absolute [Pa].
    elapsed : float
        Share of the log that has gone [fraction].
    p : SimpleNamespace
        The wide flow form's parameters [SI].

    Returns
    -------
    float
        Pressure [Pa].
    """
    above = pressures[0] + pressures[1] - 2.0 * p.accumulator_pressure
    return p.pressure_offset + p.pressure_drift * relative_drift(elapsed, p.drift_settling) + p.pressure_sides * above


def relative_drift(elapsed: Any, settling: Any) -> Any:
    """Return how far an offset has drifted, over the drift of the whole log at its initial rate.

    A sensor that warms up after it is switched on settles by ``(1 - exp(-k x)) / k``; with k = 0 the drift is linear.
    The exponential is approximated by the eighth power of ``u = (1 - k x / 16) / (1 + k x / 16)``, and ``1 - u^8`` is
    written as a product, which is defined at 0.

    Parameters
    ----------
    elapsed : float, ndarray or Expression
        Share of the log [fraction].
    settling : float or Expression
        k: time constants within the log [1].

    Returns
    -------
    float, ndarray or Expression
        Dimensionless.
    """
    gone = settling * elapsed
    root = (16.0 - gone) / (16.0 + gone)
    squared = root * root
    return 2.0 * elapsed / (16.0 + gone) * (1.0 + root) * (1.0 + squared) * (1.0 + squared * squared)
