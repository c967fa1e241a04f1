"""`with_implicit_steps(plain)`: where a second fit needs model steps that err by less than noise does."""

from dataclasses import replace

import numpy as np

from estimation.fits.flow.asked_hypotheses import at_widest
from estimation.fits.flow.plain import FitStart, PlainFits, fills_within_a_step
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.spared_steps import step_errors
from estimation.models.flow import HELD_FLOW_FORM

STEPS_FELT = 1.0
"""Error of a block's residual from which implicit steps are taken, in deviations of its noise [dimensionless]. Of 26
random rigs 18 err by less than 1 at the true values, the others by 2 to 180."""

LEAST_ERROR = 0.04
"""Errors of steps over what a fit leaves of a log, root mean square, from which exact ones may explain it [fraction]:
of those that they do explain it is 0.09 to 0.6, of one at 190 times the noise 0.02."""

STEEP, BESIDE_STEEP = 3.0, 10
"""How many times as steep as the last of so many blocks the steepest is, where steps are looked at of a log that is
explained, too [dimensionless, count]; judged."""

WRONG_VALLEY = 4.0
"""What a fit leaves of a log, mean square over noise, from which its search may have ended in another valley, where
valves are shut and no step is felt [dimensionless]; judged: such logs left 16 and more, and one of 1.6 was fitted no
better with implicit steps, in three times the time."""


def with_implicit_steps(plain: PlainFits) -> FitStart | None:
    """Return the start of a second fit with implicit model steps, if those of the first err by more than noise does.

    Valves of small chambers fill them in less time than a step takes. Where both sides of a piston float at the inner
    circuit's pressure, make-up valves open and shut by turns, above all those that a pilot of the other side holds
    open. With usual steps the model chatters there, by up to 300 deviations of the noise at the true values, and no
    search finds a way.

    Parameters
    ----------
    plain : PlainFits
        The log's fits.

    Returns
    -------
    FitStart or None
        None where steps are exact enough, or implicit already. Not asked of a log that is explained, but for that of a
        single rod, whose chatter may pass for a bulk modulus that the log does not tell or end a search above its
        minimum, and for one whose slopes leap: the deviation of bulk modulus came out 26 times too small.
    """
    if plain.start.implicit:
        return None
    swinging, p = [fit for fit in plain.fits if fit.model.rates is not HELD_FLOW_FORM.rates], plain.start.parameters
    explained = plain.explains(plain.best)
    quick = plain.best.chi_square[0] > WRONG_VALLEY and not explained and fills_within_a_step(p)
    if quick or (p.single_rod and at_widest(plain.swinging, p, plain.log)):
        return replace(plain.start, implicit=True)
    asked = not explained or p.single_rod or p.pilot_share > 0.0 or any(map(_leaps, swinging))
    felt = asked and any(_chatters(plain.log, fit, 0.0 if explained else LEAST_ERROR) for fit in swinging)
    return replace(plain.start, implicit=True) if felt else None


def _chatters(log: GreyBoxLog, fit: GreyBoxFit, least: float) -> bool:
    """Return whether steps err by more than noise at a fit, and by the least share of what it leaves of its log."""
    errors = step_errors(FreedProblem.of(fit.model, log), fit.model.theta(fit.values))
    share = float(np.sqrt(np.mean(errors**2) / max(fit.chi_square[0], 1.0)))
    return share >= least and float(np.max(np.abs(errors))) > STEPS_FELT


def _leaps(fit: GreyBoxFit) -> bool:
    """Return whether single blocks tell far more of bulk modulus than those that tell most after them."""
    if not fit.slopes.size:
        return False
    slopes = np.sort(np.abs(fit.slopes[:, fit.model.unknowns.index("bulk_modulus")]))[-BESIDE_STEEP:]
    return bool(slopes[-1] > STEEP * slopes[0])
