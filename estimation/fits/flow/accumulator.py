"""`presumed_stiffness(p, ...)`: what is known of the inner circuit's accumulator before a log is seen.

The accumulator feeds the lower side of the piston. Its pressure rises and falls with the oil that the chambers take and
return, and its stiffness depends on its gas. A rig file may state the gas, with an uncertainty. If it does not, the
range that designers choose is assumed: a few times the oil that comes and goes. Both are priors: the logarithm of the
stiffness is normally distributed before the log is seen, and the log may correct it. The uncertainty that remains is
part of both intervals, the one given the rig and the total one. See decision 389.
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
"""Polytropic exponents of nitrogen: slow (isothermal) and quick (adiabatic) compression [dimensionless]."""

LEAST_GAS, MOST_GAS = 1.0, 100.0
"""Gas volume of an accumulator over the oil that it gives and takes [dimensionless]; judged. At the lower end the
pressure falls by half, so designers choose more gas; at the upper end the pressure is constant. All ratios in between
are equally likely on a logarithmic scale."""

SOFT_DEVIATIONS = 2.0
"""Deviations below the presumed stiffness at which searches begin [dimensionless]; judged, see decision 389."""


def oil_exchange(p: EhaParameters) -> float:
    """Return the oil that the inner circuit gives and takes.

    Returns
    -------
    float
        Oil that both chambers take up from rest to relief pressure, plus half of one chamber's largest volume, plus
        what a single rod displaces [m^3].
    """
    compressed = p.chamber_volume * min(4.0 * p.relief_pressure / p.bulk_modulus, 1.0)
    swept = p.piston_area * p.stroke if p.stroke else 2.0 * p.chamber_volume
    return compressed + 2.0 * abs(p.area_difference) * swept


def presumed_stiffness(p: EhaParameters, uncertainties: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Return what is known of the accumulator's stiffness before a log is seen.

    The stiffness is ``n p / V`` for gas of volume ``V`` at the pressure ``p``. The exponent ``n`` lies anywhere between
    slow and quick compression.

    Parameters
    ----------
    uncertainties : Mapping[str, float]
        Relative standard deviation of the actuator's parameters [fraction].

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
        gas, doubt = math.sqrt(LEAST_GAS * MOST_GAS) * oil_exchange(p), _uniform_deviation(LEAST_GAS, MOST_GAS)
    spread = math.hypot(_uniform_deviation(SLOWEST, QUICKEST), doubt)
    return {STIFFNESS: (math.sqrt(SLOWEST * QUICKEST) * p.accumulator_pressure / gas, spread)}


def _uniform_deviation(least: float, most: float) -> float:
    """Return the standard deviation of a logarithm that is evenly likely between two ends [dimensionless]."""
    return math.log(most / least) / math.sqrt(12.0)


def first_stiffness(log: GreyBoxLog) -> float:
    """Return the accumulator's stiffness from which searches begin: the soft end of what is presumed.

    Searches for unusual effects hold the stiffness at this value if no plain fit has found one. A rod that the rig file
    does not mention displaces so much oil that an accumulator of the usual stiffness would not fit it.

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
    return value * math.exp(-SOFT_DEVIATIONS * spread)


FAR_STIFFER = 2.0
"""Deviations above the presumed stiffness from which the accumulator has absorbed another effect [dimensionless]."""


def is_far_stiffer(log: GreyBoxLog, values: Mapping[str, float]) -> bool:
    """Return whether a fit's accumulator is so much stiffer than presumed that it has absorbed another effect.

    Its pressure then follows the piston, as do the chamber volumes of an encoder with another zero.

    Parameters
    ----------
    log : GreyBoxLog
        The log, with what is presumed.
    values : Mapping[str, float]
        Parameters of the fit [SI].
    """
    if STIFFNESS not in values or values[STIFFNESS] <= 0.0 or STIFFNESS not in log.presumed:
        return False
    usual, std = log.presumed[STIFFNESS]
    return math.log(values[STIFFNESS] / usual) > FAR_STIFFER * std


CONTRADICTING_DEVIATIONS = 3.0
"""Deviations by which a log must move a stated accumulator before it contradicts the rig file [dimensionless]."""


def gas_contradicted(log: GreyBoxLog, fit: GreyBoxFit, p: EhaParameters) -> tuple[Note, ...]:
    """Return a note if a log contradicts the accumulator that a rig file states.

    A log without information leaves the stiffness at its prior value. If the file is right, the shift from the prior
    has the prior variance less the posterior variance. The precharge is uncertain too.

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
        One at most; none if the file states no gas.
    """
    found = fit.values.get(STIFFNESS, 0.0)
    if p.accumulator_gas is None or found <= 0.0 or STIFFNESS not in log.presumed:
        return ()
    usual, spread = log.presumed[STIFFNESS]
    left = fit.std.get(STIFFNESS, math.inf) / found
    if not left < spread:
        return ()
    moved, told = math.log(usual / found), spread**2 + log.uncertainties.get(CHARGE, 0.0) ** 2 - left**2
    if abs(moved) <= CONTRADICTING_DEVIATIONS * math.sqrt(told):
        return ()
    limit = "least" if moved > 0.0 else "most"
    return (RigCode.GAS_CONTRADICTED.note(limit=limit, ratio=math.exp(moved)),)
