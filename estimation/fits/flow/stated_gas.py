"""What a rig file says of its accumulator's gas, as a belief in the stiffness of the inner circuit.

A file that says nothing leaves the stiffness free between none and that of the smallest usual accumulator. Gas that is
stated is believed as far as its uncertainty goes, and the log may say better: the logarithm of the stiffness is normal
before the log is seen. So what the belief leaves open is in the interval given the rig, and in the total one.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import STIFFNESS
from estimation.models.greybox import GreyBoxModel
from plant.eha.model import EhaParameters

GAS, CHARGE = "accumulator_gas", "accumulator_pressure"

SLOWEST, QUICKEST = 1.0, 1.4
"""Exponents of nitrogen that is compressed slowly, at its wall's temperature, and quickly [dimensionless]."""


LEAST_GAS, MOST_GAS = 1.0, 100.0
"""Gas of an accumulator, over the oil that it gives and takes [dimensionless]; judged. With as much as that it loses half
of its pressure, and a designer gives it more; with the most its pressure stays as it is."""


def oil_taken(p: EhaParameters) -> float:
    """Return the oil that the inner circuit gives and takes.

    Parameters
    ----------
    p : EhaParameters
        The actuator.

    Returns
    -------
    float
        What both chambers take up from rest to relief pressure, as much as a chamber at most, and what a single rod
        displaces [m^3].
    """
    compressed = p.chamber_volume * min(4.0 * p.relief_pressure / p.bulk_modulus, 1.0)
    swept = p.piston_area * p.stroke if p.stroke else 2.0 * p.chamber_volume
    return compressed + 2.0 * abs(p.area_difference) * swept


def presumed_stiffness(p: EhaParameters, uncertainties: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Return what is known of the accumulator's stiffness before a log is seen.

    ``n p / V`` for gas of volume ``V`` at the pressure ``p``. Its exponent lies anywhere between those of slow and
    quick compression.

    Parameters
    ----------
    p : EhaParameters
        The actuator.
    uncertainties : Mapping[str, float]
        Relative standard deviation of its parameters [fraction].

    Returns
    -------
    dict
        Stiffness [Pa/m^3] and standard deviation of its logarithm [dimensionless]; empty where no gas is stated.

    Examples
    --------
    >>> presumed_stiffness(EhaParameters(), {})
    {}
    >>> value, _ = presumed_stiffness(EhaParameters(accumulator_gas=1e-4), {"accumulator_gas": 0.3})["accumulator_stiffness"]
    >>> round(value)
    3263309670
    """
    exponent = math.sqrt(SLOWEST * QUICKEST)
    if p.accumulator_gas is None:
        usual = math.sqrt(LEAST_GAS * MOST_GAS) * oil_taken(p)
        return {STIFFNESS: (exponent * p.accumulator_pressure / usual, math.log(MOST_GAS / LEAST_GAS) / math.sqrt(12.0))}
    of_exponent = math.log(QUICKEST / SLOWEST) / math.sqrt(12.0)
    spread = math.hypot(of_exponent, uncertainties.get(GAS, 0.0), uncertainties.get(CHARGE, 0.0))
    return {STIFFNESS: (exponent * p.accumulator_pressure / p.accumulator_gas, spread)}


def first_stiffness(log: GreyBoxLog) -> float:
    """Return the accumulator's stiffness from which searches begin [Pa/m^3]: as presumed, none where nothing is."""
    return log.presumed.get(STIFFNESS, (0.0, 0.0))[0]


def by_belief(form: GreyBoxModel, log: GreyBoxLog) -> GreyBoxModel:
    """Return a form that fits the logarithm of the accumulator's stiffness where its gas is stated.

    Parameters
    ----------
    form : GreyBoxModel
        The flow form, which fits multiples of a usual stiffness.
    log : GreyBoxLog
        The log, with what is presumed.
    """
    if STIFFNESS not in log.presumed:
        return form
    return replace(form, linear=tuple(one for one in form.linear if one[0] != STIFFNESS))
