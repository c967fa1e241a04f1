"""Pump ripple too small to fit: integrated out, with the shift and variance that it adds to the unknowns.

Every gear pump has some. Below `LEAST_TEETH` a log seldom determines the tooth count, but if pressure changes slowly
beside the tooth passing, small ripple moves bulk modulus by more than a deviation. Its effect is linear, so no new fit
is needed.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimation.fits.greybox.pump_ripple import LEAST_TEETH, TOOTH_COUNTS, ShownRipple

RIPPLE_PROBABILITY = 0.5
"""Prior probability that ripple has an effect at all: a simulator may have none [fraction]."""

SMALL_STD = LEAST_TEETH / 6.0**0.5
"""Standard deviation of the cosine and the sine of small ripple, uniform up to `LEAST_TEETH` [fraction]."""


CORRECTED_PARAMETERS = ("bulk_modulus", "leakage_coefficient", "flow_bias")
"""Parameters that are corrected for small ripple; all are fitted as logarithms."""

NO_SHIFTS: tuple[Mapping[str, float], Mapping[str, float]] = ({}, {})
"""Correction if a fit does not test for ripple, or includes some."""


LARGEST_SHIFT = 1.0
"""Largest shift of a parameter's logarithm by small ripple [dimensionless]; judged."""


def small_pump_ripple(
    shown: Mapping[int, ShownRipple], names: Sequence[str]
) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return the shift of the unknowns if a small ripple is unknown too, and the variance that this adds.

    Each tested tooth count is weighted by its evidence against no ripple (Kass and Raftery 1995, Journal of the
    American Statistical Association 90, equation 1), with a normal prior for cosine and sine.

    Parameters
    ----------
    shown : Mapping[int, ShownRipple]
        What residuals show of each, by tooth count.
    names : sequence of str
        The unknowns that are felt.

    Returns
    -------
    tuple of Mapping[str, float]
        In the fitted coordinates [dimensionless], by unknown.
    """
    alone = [one for one in shown.values() if one.offset == 0.0]
    share = RIPPLE_PROBABILITY / len(TOOTH_COUNTS)
    weights, moves, variances = [1.0 - share * len(alone)], [np.zeros(len(names))], [np.zeros(len(names))]
    for one in alone:
        along = one.power @ np.array([one.teeth.cosine, one.teeth.sine])
        spread = np.linalg.inv(one.power + np.eye(2) / SMALL_STD**2)
        tested = float(np.linalg.slogdet(np.eye(2) + SMALL_STD**2 * one.power)[1])
        weights.append(share * float(np.exp(min(0.5 * float(along @ spread @ along) - 0.5 * tested, 700.0))))
        moves.append(-one.answers @ spread @ along)
        variances.append(np.einsum("ij,jk,ik->i", one.answers, spread, one.answers))
    likely = np.array(weights) / np.sum(weights)
    moved = likely @ np.array(moves)
    variance = likely @ (np.array(variances) + (np.array(moves) - moved) ** 2)
    return dict(zip(names, moved.tolist(), strict=True)), dict(zip(names, variance.tolist(), strict=True))


def with_shifts(
    found: Mapping[str, tuple[float, float]], *shifts: tuple[Mapping[str, float], Mapping[str, float]]
) -> dict[str, tuple[float, float]]:
    """Return the result, shifted and widened by effects that are not fitted: small ripple, noise of motor speed.

    Parameters
    ----------
    found : Mapping[str, tuple of float]
        Value and deviation by parameter [SI].
    *shifts : tuple of Mapping[str, float]
        Each as of `small_pump_ripple` or `noise_shift` [dimensionless].

    Returns
    -------
    dict[str, tuple of float]
        The same, those of `CORRECTED_PARAMETERS` changed [SI].

    Examples
    --------
    >>> with_shifts({"bulk_modulus": (2e8, 3e5)}, ({"bulk_modulus": 0.0}, {"bulk_modulus": 4e-6}))
    {'bulk_modulus': (200000000.0, 500000.0)}
    """
    out = dict(found)
    for moved, variance in shifts:
        for name in (name for name in CORRECTED_PARAMETERS if name in moved and name in out):
            value, std = out[name]
            # no fit is linear beyond `LARGEST_SHIFT`: there only the deviation grows
            step = moved[name] if abs(moved[name]) <= LARGEST_SHIFT else 0.0
            out[name] = value * math.exp(step), math.hypot(std, value * variance[name] ** 0.5)
    return out
