"""`with_implicit_steps(plain)`: whether a second fit needs implicit model steps, with errors below the noise."""

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
"""Error of a block's residual due to model steps, over the standard deviation of its noise, from which steps are
implicit [dimensionless]. Of 26 random rigs 18 have errors below 1 at the true values, the others 2 to 180."""

LEAST_ERROR = 0.04
"""Root mean square error of model steps over that of the residuals, from which exact steps may explain the log
[fraction]. In logs that they explain it is 0.09 to 0.6; in one at 190 times the noise it was 0.02."""

STEEP, BESIDE_STEEP = 3.0, 10
"""How much steeper the steepest block must be than the last of so many blocks, before the steps of an explained log are
checked too [dimensionless, count]; judged."""

WRONG_VALLEY = 4.0
"""Mean squared normalised residual from which a search may have ended in another minimum, where valves are shut and
step errors do not matter [dimensionless]; judged. Such logs had 16 and more. A log with 1.6 was fitted no better with
implicit steps, in three times the time."""


def with_implicit_steps(plain: PlainFits) -> FitStart | None:
    """Return the start of a second fit with implicit model steps, if the errors of explicit steps exceed the noise.

    Valves fill the small chambers of small rigs in less than a step. If both sides of a piston are at the inner
    circuit's pressure, make-up valves open and close in turn, most of all if pilot pressure holds them open. With
    explicit steps the model chatters there, by up to 300 standard deviations of the noise at the true values, and no
    search converges.

    Parameters
    ----------
    plain : PlainFits
        The log's fits.

    Returns
    -------
    FitStart or None
        None if steps are exact enough, or implicit already. If the log is explained, only two cases are checked: a
        single rod, whose chatter may look like a bulk modulus that the log does not determine, and a log with single
        blocks of very steep slopes, where the deviation of bulk modulus came out 26 times too small.
    """
    if plain.start.implicit:
        return None
    swinging, p = [fit for fit in plain.fits if fit.model.rates is not HELD_FLOW_FORM.rates], plain.start.parameters
    explained = plain.explains(plain.best)
    quick = plain.best.chi_square[0] > WRONG_VALLEY and not explained and fills_within_a_step(p)
    if quick or (p.single_rod and at_widest(plain.swinging, p, plain.log)):
        return replace(plain.start, implicit=True)
    asked = not explained or p.single_rod or p.pilot_share > 0.0 or any(map(_has_steep_blocks, swinging))
    felt = asked and any(_has_large_step_errors(plain.log, fit, 0.0 if explained else LEAST_ERROR) for fit in swinging)
    return replace(plain.start, implicit=True) if felt else None


def _has_large_step_errors(log: GreyBoxLog, fit: GreyBoxFit, least: float) -> bool:
    """Return whether step errors of a fit exceed the noise, and at least the least share of its residuals."""
    errors = step_errors(FreedProblem.of(fit.model, log), fit.model.theta(fit.values))
    share = float(np.sqrt(np.mean(errors**2) / max(fit.chi_square[0], 1.0)))
    return share >= least and float(np.max(np.abs(errors))) > STEPS_FELT


def _has_steep_blocks(fit: GreyBoxFit) -> bool:
    """Return whether a few blocks determine bulk modulus far better than all others."""
    if not fit.slopes.size:
        return False
    slopes = np.sort(np.abs(fit.slopes[:, fit.model.unknowns.index("bulk_modulus")]))[-BESIDE_STEEP:]
    return bool(slopes[-1] > STEEP * slopes[0])
