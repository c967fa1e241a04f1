"""`by_course(logged, plain)`, `with_open_turns(...)`: plain fits with the motor's course that the log shows, or none.

A motor whose speed is asked for continuously bends its course smoothly, and straight lines between samples are put
right by its bends (`straightened`). One whose command is held from sample to sample bends at the samples alone: there
the lead on the straight line is all, and what is added for bends is wrong. Neither is in a rig file, and both are
built: where it is felt, the log says which.

And a motor at its current limit, or under a position loop that is sampled, has neither course. In the paper's chambers
a millisecond of that is not felt; a pump that turns fast beside small chambers of stiff oil moves pressure by ten
times as much. See decision 399.
"""

from dataclasses import replace

import numpy as np

from estimation.fits.flow.plain import Logged, PlainFits, plain_fits
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.intersample_doubt import SLOW, turns
from estimation.fits.hypothesis_search.between_samples import FIRST

HELD_WORTH = 1.0
"""Gain in log-likelihood from which a command is taken as held [dimensionless]; judged."""

ELSEWHERE = 6.0
"""What bends may gain at most, from which a held command may lead to another minimum, and all is searched anew
[dimensionless]; judged. For 20 s of the paper's actuator it is 2 to 4. For a flight control it is 20: its fit went on
from the smooth one's to a minimum 180 above the right one, and its bulk modulus was 2.4 % off."""

FELT = 0.1
"""What the largest turn may leave open beside the pressure's noise, from which it is felt [fraction]; judged. In the
paper's actuator at 1 kHz it is 0.06 at its motor's limit."""

NEARLY = 4.0
"""Mean squared normalised residual of a plain fit up to which the turns' course may be what is left [dimensionless];
judged: a load at the start leaves thousands."""


def by_course(logged: Logged, plain: PlainFits) -> PlainFits:
    """Return the plain fits of a log with the course of its motor between samples.

    Parameters
    ----------
    logged : Logged
        The log.
    plain : PlainFits
        Its fits, the motor's course smooth.

    Returns
    -------
    PlainFits
        The same ones where a smooth course is as good.
    """
    told = plain.best.slopes.size and not plain.log.gaps.size
    if plain.start.held or plain.unturned.sample_time >= SLOW or not told:
        return plain
    noise_alone = plain.explains(plain.best)  # else a course may also lead to another minimum
    most = _gains_at_most(plain) if noise_alone else np.inf
    if most <= HELD_WORTH or _held_gains(logged, plain) <= HELD_WORTH:
        return plain
    near = plain.fits if most < ELSEWHERE else ()
    other = plain_fits(logged, replace(plain.start, held=True), near)
    return other if other.best.cost < plain.best.cost else plain


def with_open_turns(logged: Logged, plain: PlainFits) -> PlainFits:
    """Return the plain fits of a log that nothing explains with the course of its motor's turns left open.

    It is asked last: what is left open at turns would take up what a gain or a lag of the pressure does there.

    Parameters
    ----------
    logged : Logged
        The log.
    plain : PlainFits
        Its fits.

    Returns
    -------
    PlainFits
        The same ones where turns are not felt, or do not explain the log either.
    """
    bare, left = not plain.log.gaps.size and plain.unturned.sample_time < SLOW, plain.best.chi_square[0]
    if not bare or plain.start.turns_open or plain.explains(plain.best) or left >= NEARLY or not _turns_felt(plain):
        return plain
    for held in (plain.start.held, not plain.start.held):
        other = plain_fits(logged, replace(plain.start, held=held, turns_open=True))
        if other.explains(other.best):
            return other
    return plain


def _held_gains(logged: Logged, plain: PlainFits) -> float:
    """Return the gain in log-likelihood, to first order, if the motor's command is held; under the same noise."""
    log, best, smooth = plain.log, plain.best, plain.unturned.drives
    bare = logged.seen_at(plain.start.parameters, held=True).drives
    if len(bare) != len(smooth):  # averaged over other samples: so fast that no course is felt
        return 0.0
    problem, theta = FreedProblem.of(best.model, log), best.model.theta(best.values)
    known, other = problem.disturbed(theta, [log.drives, log.drives + bare - smooth])
    change, slopes = (other - known).ravel(), best.slopes
    change = change - slopes @ np.linalg.lstsq(slopes, change, rcond=None)[0]
    return -float(change @ known.ravel()) - 0.5 * float(change @ change)


def _gains_at_most(plain: PlainFits) -> float:
    """Return the gain in log-likelihood if the motor's command is held in truth, and none of it leaks off.

    What is added for bends adds up to a twelfth of what speed changes by in a sample (Euler and Maclaurin).
    """
    (speed, *_), deviation = plain.unturned.drives.T, plain.unturned.noise[0].variance ** 0.5
    apart = _rise(plain) / 12.0 * np.diff(speed) / deviation
    return 0.5 * float(apart @ apart)


def _turns_felt(plain: PlainFits) -> bool:
    """Return whether what the largest turn of the motor leaves open is felt beside the pressure's noise."""
    log = plain.unturned
    return FIRST * _rise(plain) * float(np.max(turns(log))) > FELT * log.noise[0].variance ** 0.5


def _rise(plain: PlainFits) -> float:
    """Return the pressure that a sample of motor speed adds to a shut chamber [Pa s/rad]."""
    p = plain.start.parameters
    stiffness = plain.best.values["bulk_modulus"] / p.chamber_volume
    return plain.unturned.sample_time * p.pump_displacement * stiffness
