"""From which cost on hypotheses about a log are hopeless, and below which they are believed."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from estimation.fits.flow.accumulator import is_far_stiffer
from estimation.fits.flow.plain import PlainFits
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypotheses import ENCODER_ZERO, HYPOTHESES, OFFSET, PLAY, PRESSURE_LATE, Hypothesis
from estimation.fits.hypothesis_search.explain import WORTH
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.fit_objections import fit_explains_all

LITTLE = 0.01
"""Share of what the plain form leaves beside noise that the best hypothesis must take up before pairs are tried
[fraction]."""


def hopeless_cost(swinging: GreyBoxFit, asked: Sequence[Hypothesis]) -> float:
    """Return the cost from which the best of all hypotheses gains so little that no two of them explain a log.

    What they all leave alone is then no actuator's: bursts of a few samples that a cable picks up, or a noise that
    varies.

    Parameters
    ----------
    swinging : GreyBoxFit
        The plain form's fit with volumes that swing.
    asked : sequence of Hypothesis
        What the log was asked.

    Returns
    -------
    float
        Infinite unless all hypotheses were asked [dimensionless].
    """
    if len(asked) < len(HYPOTHESES):
        return np.inf
    left = swinging.cost * (1.0 - 1.0 / max(swinging.chi_square[0], 1.0))
    return swinging.cost - max(WORTH, LITTLE * left)


def wanted_cost(
    names: Sequence[str],
    best: GreyBoxFit,
    swinging: GreyBoxFit,
    *,
    homed: bool,
    late: bool,
    astray: bool = False,
    worth: float = WORTH,
) -> float:
    """Return the cost below which hypotheses are believed rather than the plain form.

    No actuator holds its chambers' volumes. So the zero of an encoder that may have been homed at a stop need explain a
    log no better than held volumes do, and the lag of a filter no better than none. How a play is crossed is not known:
    with a second hypothesis it may explain a log that has neither.

    Parameters
    ----------
    names : sequence of str
        The hypotheses.
    best, swinging : GreyBoxFit
        The plain form's best fit, and that with volumes that swing.
    homed : bool
        Whether the encoder may have been homed at a stop.
    late : bool
        Whether the pressure was filtered.
    astray : bool
        Whether the accumulator of the fit with volumes that swing is far too stiff.
    worth : float
        What they must gain in log-likelihood [dimensionless].

    Returns
    -------
    float
        Half the sum of squares, as the fits have it [dimensionless].
    """
    if PLAY.name in names and len(names) > 1:
        return -np.inf
    if tuple(names) == (PRESSURE_LATE.name,) and late:
        return best.cost + WORTH
    if tuple(names) == (ENCODER_ZERO.name,) and homed:
        return min(best.cost + WORTH, swinging.cost - (0.0 if astray else worth))
    return best.cost - worth


def told_by(plain: PlainFits, *, begun: bool) -> Callable[[GreyBoxFit], bool]:
    """Return the test of whether a fit explains the log, stricter if its initial conditions are asked for.

    That has so many valleys that one is believed only where sensors' noise is all that it leaves. An offset of a log
    that begins at rest is no such beginning. An encoder's zero explains nothing beside an accumulator far stiffer than
    presumed: a make-up valve that was stuck shut passed for one of 0.85 m, in oil half as stiff as it was.

    Parameters
    ----------
    plain : PlainFits
        The log's plain fits.
    begun : bool
        Whether initial conditions are asked for.
    """
    strictly = partial(fit_explains_all, noisy=plain.log.passes_on) if begun else plain.explains
    zero = ENCODER_ZERO.free[0]

    def told(fit: GreyBoxFit) -> bool:
        explains = plain.explains if OFFSET.free[0] in fit.values else strictly
        return explains(fit) and not (zero in fit.values and is_far_stiffer(plain.log, fit.values))

    return told


def likelier(one: Explanation | None, other: Explanation | None) -> Explanation | None:
    """Return the likelier of two explanations of a log, the first where they are alike; either may be none.

    Parameters
    ----------
    one, other : Explanation or None
        What explains it.
    """
    if one is None or other is None:
        return one or other
    return other if other.fit.cost < one.fit.cost else one
