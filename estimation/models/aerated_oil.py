"""Oil that contains air: its tangent bulk modulus, and how much it expands from one pressure to another."""

from types import SimpleNamespace

from plant.compiled.functions import Scalar, exp, log, maximum, minimum, where
from plant.components.oil import ATMOSPHERE

VAPOUR = 2e4
"""Absolute pressure around which a chamber short of oil becomes soft [Pa]; pressures stay positive."""

STIFFEST = 0.01
"""Least compliance of a chamber over that at the stated pressure: a search may try more air than is possible."""


def present_air(elapsed: Scalar, p: SimpleNamespace) -> Scalar:
    """Return the present softness of the oil due to entrained air: ``a`` of ``a/p^2``.

    Parameters
    ----------
    elapsed : float
        Share of the log that has gone [fraction].
    p : SimpleNamespace
        Parameters of the wide flow form [SI].

    Returns
    -------
    float
        Softness [Pa].
    """
    return p.air_softness * minimum(maximum((elapsed - p.air_onset) / p.air_width, 0.0), 1.0)


def _bubbles(pressure: Scalar, air: Scalar, p: SimpleNamespace, *, quick: bool) -> Scalar:
    """Return the volume of entrained air over that of its oil [dimensionless]."""
    above = maximum(pressure, 0.05 * VAPOUR)
    return air / above * exp(p.air_quickness * log(above / ATMOSPHERE)) if quick else air / above


def _stated_air(air: Scalar, p: SimpleNamespace, *, quick: bool) -> Scalar:
    """Return the volume of the air that the stated bulk modulus includes, over that of its oil [dimensionless]."""
    return where(p.air_onset < 0.0, _bubbles(p.stated_pressure, air, p, quick=quick), 0.0)


def _liquid_share(air: Scalar, p: SimpleNamespace, *, quick: bool) -> Scalar:
    """Return the share of the stated oil's compliance that is due to the liquid, and not to air [fraction]."""
    slope = 1.0 - p.air_quickness if quick else 1.0
    return 1.0 - p.bulk_modulus * slope * _stated_air(air, p, quick=quick) / p.stated_pressure


def _stiffness_times_volume(pressure: Scalar, air: Scalar, p: SimpleNamespace, *, quick: bool) -> Scalar:
    """Return bulk modulus times the volume of oil and bubbles over that at the stated pressure, 1 by volume [Pa]."""
    grown = p.by_mass * (_bubbles(pressure, air, p, quick=quick) - _stated_air(air, p, quick=quick))
    squeezed = pressure - (p.stated_pressure if quick else ATMOSPHERE)
    return p.bulk_modulus * (1.0 + grown) - p.by_mass * squeezed * _liquid_share(air, p, quick=quick)


def tangent_stiffness(pressure: Scalar, air: Scalar, p: SimpleNamespace, *, quick: bool = False) -> Scalar:
    """Return the tangent bulk modulus of a chamber: liquid, air that softens about as 1/p^2, and vapour.

    `bulk_modulus` is that at `stated_pressure`, air included; that of the liquid if air enters within the log. By mass
    it refers to the volume that the oil fills, bubbles included.

    Parameters
    ----------
    pressure : float
        Absolute pressure of the chamber [Pa].
    air : float
        Present softness due to entrained air, see `present_air` [Pa].
    p : SimpleNamespace
        Parameters of the wide flow form [SI].
    quick : bool
        Whether bubbles are compressed faster than heat leaves them.

    Returns
    -------
    float
        Rise of pressure over the relative decrease of volume [Pa].
    """
    above = maximum(pressure, 0.05 * VAPOUR)
    ratio, bubbles = VAPOUR / above, _bubbles(pressure, air, p, quick=quick)
    short = ratio * ratio
    slope = 1.0 - p.air_quickness if quick else 1.0
    softer = slope * (bubbles / above - _stated_air(air, p, quick=quick) / p.stated_pressure)
    return _stiffness_times_volume(pressure, air, p, quick=quick) / maximum(
        1.0 + short * short + softer * p.bulk_modulus, STIFFEST
    )


def swellings(p1: Scalar, p2: Scalar, air: Scalar, p: SimpleNamespace, *, quick: bool = False) -> tuple[Scalar, Scalar]:
    """Return the relative expansion of oil that flows from the first pressure to the second, in the volume of either.

    Parameters
    ----------
    p1, p2 : float
        Absolute pressures of the chambers [Pa].
    air : float
        Present softness due to entrained air, see `present_air` [Pa].
    p : SimpleNamespace
        Parameters of the wide flow form [SI].
    quick : bool
        Whether bubbles are compressed faster than heat leaves them.

    Returns
    -------
    tuple of float
        Both zero if volumes are balanced [fraction].
    """
    freed = _bubbles(p2, air, p, quick=quick) - _bubbles(p1, air, p, quick=quick)
    swells = (p1 - p2) * _liquid_share(air, p, quick=quick) + p.bulk_modulus * freed
    first, second = (p.by_mass * swells / _stiffness_times_volume(one, air, p, quick=quick) for one in (p1, p2))
    return first, second
