"""Costs of hypotheses: above which they are hopeless, and below which they are believed."""

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from estimation.fits.cause_words import causes_in_words
from estimation.fits.flow.accumulator import is_far_stiffer
from estimation.fits.flow.agreement import wanted_gain
from estimation.fits.flow.log import homed_at_stop
from estimation.fits.flow.log_traits import LogTraits
from estimation.fits.flow.plain import PlainFits
from estimation.fits.flow.told_volume import unlikely_volume
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypotheses import ENCODER_ZERO, HYPOTHESES, OFFSET, PLAY, PRESSURE_LATE, Hypothesis
from estimation.fits.hypothesis_search.explain import REQUIRED_GAIN
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.fit_objections import exceeds_noise, fit_explains_all
from estimation.fits.hypothesis_search.form_fit import TEMPER
from estimation.notes import RigCode
from plant.notes import Note

MOST_LEFT = 0.1
"""What may be left of what no plain form explains, for a hint on its cause [fraction]; judged."""

LEAST_REMOVED = 0.01
"""Share of the plain form's misfit beyond noise that the best hypothesis must remove before pairs are tried
[fraction]."""


def hopeless_cost(swinging: GreyBoxFit, asked: Sequence[Hypothesis]) -> float:
    """Return the cost above which even the best hypothesis gains so little that no pair can explain the log.

    What remains is then not caused by an actuator: short bursts picked up by a cable, or noise that varies.

    Parameters
    ----------
    swinging : GreyBoxFit
        Fit of the plain form with varying volumes.
    asked : sequence of Hypothesis
        The hypotheses that were tested.

    Returns
    -------
    float
        Infinite unless all hypotheses were asked [dimensionless].
    """
    if len(asked) < len(HYPOTHESES):
        return np.inf
    left = swinging.cost * (1.0 - 1.0 / max(swinging.chi_square[0], 1.0))
    return swinging.cost - max(REQUIRED_GAIN, LEAST_REMOVED * left)


def wanted_cost(
    names: Sequence[str],
    best: GreyBoxFit,
    swinging: GreyBoxFit,
    *,
    homed: bool,
    late: bool,
    astray: bool = False,
    worth: float = REQUIRED_GAIN,
) -> float:
    """Return the cost below which hypotheses are believed rather than the plain form.

    No real actuator holds its chamber volumes constant. So the zero of an encoder that may have been homed at a stop
    must only explain the log as well as held volumes do. In the same way the lag of a filtered pressure must only
    explain it as well as no lag does. How encoder play is crossed is unknown: together with a second hypothesis it may
    explain a log that has neither.

    Parameters
    ----------
    names : sequence of str
        The hypotheses.
    best, swinging : GreyBoxFit
        The plain form's best fit, and its best fit with varying volumes.
    homed : bool
        Whether the encoder may have been homed at a stop.
    late : bool
        Whether the pressure was filtered.
    astray : bool
        Whether the accumulator of the fit with varying volumes is far too stiff.
    worth : float
        Required gain in log-likelihood [dimensionless].

    Returns
    -------
    float
        Half the sum of squared normalised residuals [dimensionless].
    """
    if PLAY.name in names and len(names) > 1:
        return -np.inf
    if tuple(names) == (PRESSURE_LATE.name,) and late:
        return best.cost + REQUIRED_GAIN
    if tuple(names) == (ENCODER_ZERO.name,) and homed:
        return min(best.cost + REQUIRED_GAIN, swinging.cost - (0.0 if astray else worth))
    return best.cost - worth


def wanted_cost_in(names: Sequence[str], plain: PlainFits, traits: LogTraits, left: float) -> float:
    """Return the cost below which hypotheses are believed rather than the plain form of a log.

    Parameters
    ----------
    names : sequence of str
        The hypotheses.
    plain : PlainFits
        The log's plain fits.
    traits : LogTraits
        How the log was logged.
    left : float
        Mean squared normalised residual under them [dimensionless].

    Returns
    -------
    float
        As of `wanted_cost` [dimensionless].
    """
    best, swinging, worth = plain.best, plain.swinging, wanted_gain(plain, left)
    homed, astray = homed_at_stop(plain.log), is_far_stiffer(plain.log, swinging.values)
    return wanted_cost(names, best, swinging, homed=homed, late=traits.filtered, astray=astray, worth=worth)


def judged(
    plain: PlainFits, strange: Explanation, traits: LogTraits, explains: Callable[[GreyBoxFit], bool]
) -> tuple[Explanation | None, tuple[Note, ...]]:
    """Return the likeliest hypotheses of a log if they are believed, else hints at what nearly explains it.

    Parameters
    ----------
    plain : PlainFits
        The log's plain fits.
    strange : Explanation
        The likeliest hypotheses.
    traits : LogTraits
        How the log was logged.
    explains : callable
        ``explains(fit)``: whether a fit explains the log.
    """
    gained = wanted_cost_in(strange.names, plain, traits, strange.fit.chi_square[0]) - strange.fit.cost
    crossed = PLAY.name not in strange.names or not exceeds_noise(strange.fit)  # beside a play only noise may be left
    if gained <= 0.0 or not crossed or not explains(strange.fit):
        return None, nearly_explained(plain, strange)
    if gained <= volume_worth(plain, strange):
        return None, unlikely_volume(strange, plain.swinging, plain.start.parameters.chamber_volume)
    return strange, ()


def volume_worth(plain: PlainFits, strange: Explanation) -> float:
    """Return the further gain that another chamber volume must reach where the rig file's volume explains the log too.

    The plain form is then a rival with the file's volume, weighed as rivals are: by likelihood, with its usual divisor
    since no model is exact, and by what the rig file says of the volume.

    Parameters
    ----------
    plain : PlainFits
        The log's plain fits.
    strange : Explanation
        The likeliest hypotheses.

    Returns
    -------
    float
        Gain in log-likelihood; 0 if no volume is told, or only another one explains the log [dimensionless].
    """
    if strange.priors is None or not plain.explains(plain.best):
        return 0.0
    return -TEMPER * math.log(strange.priors[0])


def nearly_explained(plain: PlainFits, strange: Explanation) -> tuple[Note, ...]:
    """Return a note on hypotheses that nearly explain a log that nothing explains.

    If a make-up valve is stuck shut, the oil in its chamber boils, and no model follows the vapour to the noise. But a
    valve that explains 98 % of the misfit is the first suspect.

    Parameters
    ----------
    plain : PlainFits
        The log's plain fits.
    strange : Explanation
        The likeliest hypotheses, which are not believed.

    Returns
    -------
    tuple of Note
        Empty if the plain form explains the log, or if much is left.
    """
    before, left = (max(fit.chi_square[0] - 1.0, 0.0) for fit in (plain.best, strange.fit))
    if plain.explains(plain.best) or left >= MOST_LEFT * before:
        return ()
    share, said = 100.0 * left / before, causes_in_words(strange.names)
    return (RigCode.PARTLY_EXPLAINED.note(cause=strange.names[0], causes=said, left=share, explained=100.0 - share),)


def explanation_test(plain: PlainFits, *, begun: bool) -> Callable[[GreyBoxFit], bool]:
    """Return the test of whether a fit explains the log. It is stricter if initial conditions are fitted.

    Initial conditions have many minima, so they are believed only if the sensors' noise is all that remains. A pressure
    offset in a log that begins at rest is not an initial condition. An encoder zero explains nothing beside an
    accumulator far stiffer than presumed: a make-up valve that was stuck shut looked like a zero of 0.85 m, with bulk
    modulus half its true value.

    Parameters
    ----------
    plain : PlainFits
        The plain fits of the log.
    begun : bool
        Whether initial conditions are fitted.
    """
    strictly = partial(fit_explains_all, noisy=plain.log.passes_on) if begun else plain.explains
    zero = ENCODER_ZERO.free[0]

    def told(fit: GreyBoxFit) -> bool:
        explains = plain.explains if OFFSET.free[0] in fit.values else strictly
        return explains(fit) and not (zero in fit.values and is_far_stiffer(plain.log, fit.values))

    return told


def likelier_of(one: Explanation | None, other: Explanation | None) -> Explanation | None:
    """Return the likelier of two explanations, the first if they are equal; either may be None.

    Parameters
    ----------
    one, other : Explanation or None
        Explanations of a log.
    """
    if one is None or other is None:
        return one or other
    return other if other.fit.cost < one.fit.cost else one
