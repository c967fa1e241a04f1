"""Leakage that changes within a log, in notes: it drifts, grows, or steps."""

import numpy as np

from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.models.wide_flow import GROWTH, grown_leakage
from estimation.notes import RigCode
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.notes import Note

LARGEST_WARMING_FACTOR = 3.0
"""Factor up to which leakage follows the oil's viscosity and is no fault [dimensionless]: the viscosity of mineral oil
falls to a third as it warms by some 25 K (ISO 3448 VG 46 between 40 and 65 degrees Celsius, about)."""

LEAST_RELATIVE_LEAKAGE = 1e-3
"""Least leakage over its value halfway [dimensionless]: a parabola may cross zero outside the fitted range."""


def growth_note(found: Explanation, _: EhaParameters) -> Note:
    """Return the note on a leakage that changes throughout a log: drifting as oil warms, or growing.

    Returns
    -------
    Note
        With the factor of the change, and leakage at the start and the end [m^3/(s Pa)].
    """
    begun, ended = relative_leakage(found, np.array([0.0, 1.0]))
    return changed_leakage_note(float(ended / begun), found.values["leakage_coefficient"][0])


def changed_leakage_note(factor: float, last: float) -> Note:
    """Return the note on leakage that changes within a log: it drifts, or it grows.

    Parameters
    ----------
    factor : float
        Leakage at the end over that at the beginning [dimensionless].
    last : float
        Leakage at the end [m^3/(s Pa)].

    Returns
    -------
    Note
        That it drifts, as when oil warms or cools, or that it grows by more than that.
    """
    code = (
        RigCode.LEAKAGE_DRIFTS
        if 1.0 / LARGEST_WARMING_FACTOR < factor < LARGEST_WARMING_FACTOR
        else RigCode.LEAKAGE_GROWS
    )
    return code.note(factor=factor, first=last / factor, last=last)


def step_note(found: Explanation, _: EhaParameters) -> Note:
    """Return the note on a leakage that steps.

    Returns
    -------
    Note
        With when, and leakage before and after [m^3/(s Pa)].
    """
    last, before = found.values["leakage_coefficient"][0], found.values["leakage_before"][0]
    return RigCode.LEAKAGE_STEPS.note(
        percent_of_log=100.0 * found.values["step_at"][0],
        within_percent=100.0 * found.values["step_width"][0],
        first=last * (1.0 + before),
        last=last,
    )


def relative_leakage(found: Explanation, elapsed: Array) -> Array:
    """Return a leakage that changes throughout a log, over its value halfway.

    Parameters
    ----------
    found : Explanation
        The explanation of the log.
    elapsed : ndarray, shape (n,)
        Shares of the log [fraction].

    Returns
    -------
    ndarray, shape (n,)
        Dimensionless, positive.
    """
    return np.maximum(
        grown_leakage(elapsed, *(found.values.get(name, (0.0, 0.0))[0] for name in GROWTH)), LEAST_RELATIVE_LEAKAGE
    )
