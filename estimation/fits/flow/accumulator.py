"""`presumed_stiffness(p, ...)`: what is known of the inner circuit's accumulator before a log is seen.

The pressure that feeds the lower side of a piston rises and falls with the oil that chambers take and give back. How
stiff it is depends on the accumulator's gas, which a rig file may state, with an uncertainty. A file that says nothing
leaves what designers choose: some times the oil that comes and goes. Either is a belief, and the log may say better:
the logarithm of the stiffness is normal before the log is seen. So what it leaves open is in the interval given the
rig, and in the total one. See decision 389.
"""

import math
from collections.abc import Mapping

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import STIFFNESS
from estimation.notes import RigCode
from plant.eha.model import EhaParameters
from plant.notes import Note

GAS, CHARGE = "accumulator_gas", "accumulator_pressure"

SLOWEST, QUICKEST = 1.0, 1.4
"""Exponents of nitrogen that is compressed slowly, at its wall's temperature, and quickly [dimensionless]."""

LEAST_GAS, MOST_GAS = 1.0, 100.0
"""Gas of an accumulator, over the oil that it gives and takes [dimensionless]; judged. With as much as that it loses
half of its pressure, and a designer gives it more; with the most its pressure stays as it is. Evenly likely between, in
ratios."""

SOFT = 2.0
"""Deviations below what is presumed at which searches begin [dimensionless]; judged, see decision 389."""


def oil_taken(p: EhaParameters) -> float:
    """Return the oil that the inner circuit gives and takes.

    Parameters
    ----------
    p : EhaParameters
        The actuator.

    Returns
    -------
    float
        What both chambers take up from rest to relief pressure, half of what one holds at most, and what a single
        rod displaces [m^3].
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
        By unknown of the flow form: stiffness [Pa/m^3] and standard deviation of its logarithm [dimensionless].

    Examples
    --------
    >>> stated = presumed_stiffness(EhaParameters(accumulator_gas=1e-3), {"accumulator_gas": 0.3})
    >>> [(name, f"{value:.3g}", round(doubt, 2)) for name, (value, doubt) in stated.items()]
    [('accumulator_stiffness', '3.26e+08', 0.32)]
    """
    gas, doubt = p.accumulator_gas, uncertainties.get(GAS, 0.0)
    if gas is None:
        gas, doubt = math.sqrt(LEAST_GAS * MOST_GAS) * oil_taken(p), _even(LEAST_GAS, MOST_GAS)
    spread = math.hypot(_even(SLOWEST, QUICKEST), doubt)
    return {STIFFNESS: (math.sqrt(SLOWEST * QUICKEST) * p.accumulator_pressure / gas, spread)}


def _even(least: float, most: float) -> float:
    """Return the standard deviation of a logarithm that is evenly likely between two ends [dimensionless]."""
    return math.log(most / least) / math.sqrt(12.0)


def first_stiffness(log: GreyBoxLog) -> float:
    """Return the accumulator's stiffness from which searches begin: as soft as it may well be.

    What is strange is sought with it held where no plain form has found it, and a rod that the file does not know
    displaces oil to which an accumulator of the usual size would be too stiff.

    Parameters
    ----------
    log : GreyBoxLog
        The log, with what is presumed of the accumulator.

    Returns
    -------
    float
        Rise of its pressure per volume of oil that it takes in [Pa/m^3].
    """
    value, spread = log.presumed[STIFFNESS]
    return value * math.exp(-SOFT * spread)


FAR_STIFFER = 2.0
"""Deviations over what is presumed from which an accumulator has taken up something else [dimensionless]."""


def is_far_stiffer(log: GreyBoxLog, values: Mapping[str, float]) -> bool:
    """Return whether a fit's accumulator is so much stiffer than presumed that it has taken up something else.

    The level that it holds follows the piston, as do the volumes of an encoder that was homed elsewhere.

    Parameters
    ----------
    log : GreyBoxLog
        The log, with what is presumed.
    values : Mapping[str, float]
        The fit's [SI].
    """
    if STIFFNESS not in values or values[STIFFNESS] <= 0.0 or STIFFNESS not in log.presumed:
        return False
    usual, std = log.presumed[STIFFNESS]
    return math.log(values[STIFFNESS] / usual) > FAR_STIFFER * std


CONTRADICTS = 3.0
"""Deviations of what a log may move a stated accumulator by, from which it contradicts the rig file [dimensionless]."""


def gas_contradicted(log: GreyBoxLog, fit: GreyBoxFit, p: EhaParameters) -> tuple[Note, ...]:
    """Return a note where a log contradicts the accumulator that a rig file states.

    A log that tells nothing leaves the stiffness where it is presumed. What it moves it by has the variance that was
    presumed less the one that is left, if the file is right; its charge is doubted too.

    Parameters
    ----------
    log : GreyBoxLog
        The log, with what is presumed.
    fit : GreyBoxFit
        The fit that explains it.
    p : EhaParameters
        The actuator, as its rig file has it.

    Returns
    -------
    tuple of Note
        One at most; none where the file states no gas.
    """
    found = fit.values.get(STIFFNESS, 0.0)
    if p.accumulator_gas is None or found <= 0.0 or STIFFNESS not in log.presumed:
        return ()
    usual, spread = log.presumed[STIFFNESS]
    left = fit.std.get(STIFFNESS, math.inf) / found
    if not left < spread:
        return ()
    moved, told = math.log(usual / found), spread**2 + log.uncertainties.get(CHARGE, 0.0) ** 2 - left**2
    if abs(moved) <= CONTRADICTS * math.sqrt(told):
        return ()
    limit = "least" if moved > 0.0 else "most"
    return (RigCode.GAS_CONTRADICTED.note(limit=limit, ratio=math.exp(moved)),)
