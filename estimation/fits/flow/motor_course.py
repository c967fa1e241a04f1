"""`with_motor_course(logged, plain)`, `with_open_turns(...)`: plain fits with the motor's course as the log shows it.

A motor with a continuous command changes its speed smoothly, and straight lines between samples are corrected for its
curvature (`straight_line_speed`). If the command is held from sample to sample, the speed bends at the samples only: a
lead on the straight line is then the whole correction, and one for curvature is wrong. A rig file does not say which,
and both exist; where it matters, the log says so.

A motor at its current limit, or in a sampled position loop, follows neither. In the paper's chambers one millisecond of
that does not matter. A fast pump with small chambers of stiff oil moves pressure ten times as much. See decision 399.
"""

from dataclasses import replace

import numpy as np

from estimation.fits.flow.plain import Logged, PlainFits, plain_fits
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.intersample_doubt import SLOW, turns
from estimation.fits.hypothesis_search.between_samples import FIRST_UNCERTAINTY

HELD_WORTH = 1.0
"""Gain in log-likelihood from which the command is taken as held [dimensionless]; judged."""

RESTART_GAIN = 6.0
"""Largest possible gain of a held command, from which it may lead to another minimum and all starts are searched again
[dimensionless]; judged. For 20 s of the paper's actuator it is 2 to 4. For a flight control it is 20: started from the
smooth fit, its search ended 180 above the right minimum, with bulk modulus 2.4 % off."""

FELT = 0.1
"""Pressure that the largest turn may leave unexplained, over the pressure noise, from which it matters [fraction];
judged. In the paper's actuator at 1 kHz it is 0.06 at the motor's limit."""

NEARLY_EXPLAINED = 4.0
"""Mean squared normalised residual of a plain fit up to which the course of turns may be the remaining cause
[dimensionless]; judged: a load at the start leaves thousands."""


def with_motor_course(logged: Logged, plain: PlainFits) -> PlainFits:
    """Return the plain fits of a log with the right course of its motor between samples.

    Parameters
    ----------
    logged : Logged
        The log.
    plain : PlainFits
        Its fits with a smooth course.

    Returns
    -------
    PlainFits
        The same fits if a smooth course is as good.
    """
    told = plain.best.slopes.size and not plain.log.gaps.size
    if plain.start.held or plain.unturned.sample_time >= SLOW or not told:
        return plain
    noise_alone = plain.explains(plain.best)  # otherwise the other course may also lead to another minimum
    most = _gains_at_most(plain) if noise_alone else np.inf
    if most <= HELD_WORTH or _held_gains(logged, plain) <= HELD_WORTH:
        return plain
    near = plain.fits if most < RESTART_GAIN else ()
    other = plain_fits(logged, replace(plain.start, held=True), near)
    return other if other.best.cost < plain.best.cost else plain


def with_open_turns(logged: Logged, plain: PlainFits) -> PlainFits:
    """Return the plain fits of a log that nothing else explains, with the course of its turns free.

    This is tried last: free turns would absorb the effects of a pressure sensor's gain or lag.

    Returns
    -------
    PlainFits
        The same fits if turns do not matter, or do not explain the log either.
    """
    bare, left = not plain.log.gaps.size and plain.unturned.sample_time < SLOW, plain.best.chi_square[0]
    if (
        not bare
        or plain.start.turns_open
        or plain.explains(plain.best)
        or left >= NEARLY_EXPLAINED
        or not _turns_matter(plain)
    ):
        return plain
    for held in (plain.start.held, not plain.start.held):
        other = plain_fits(logged, replace(plain.start, held=held, turns_open=True))
        if other.explains(other.best):
            return other
    return plain


def _held_gains(logged: Logged, plain: PlainFits) -> float:
    """Return the first-order gain in log-likelihood of a held command, at the same noise."""
    log, best, smooth = plain.log, plain.best, plain.unturned.drives
    bare = logged.as_flow_log(plain.start.parameters, held=True).drives
    if len(bare) != len(smooth):  # averaged in other blocks: the log is so fast that the course has no effect
        return 0.0
    problem, theta = FreedProblem.of(best.model, log), best.model.theta(best.values)
    known, other = problem.disturbed(theta, [log.drives, log.drives + bare - smooth])
    change, slopes = (other - known).ravel(), best.slopes
    change = change - slopes @ np.linalg.lstsq(slopes, change, rcond=None)[0]
    return -float(change @ known.ravel()) - 0.5 * float(change @ change)


def _gains_at_most(plain: PlainFits) -> float:
    """Return the largest gain in log-likelihood of a held command, if nothing leaks off.

    The correction for curvature is at most a twelfth of the change of speed within a sample (Euler and Maclaurin).
    """
    (speed, *_), deviation = plain.unturned.drives.T, plain.unturned.noise[0].variance ** 0.5
    apart = _pressure_per_speed(plain) / 12.0 * np.diff(speed) / deviation
    return 0.5 * float(apart @ apart)


def _turns_matter(plain: PlainFits) -> bool:
    """Return whether what the motor's largest turn leaves unexplained matters beside the pressure noise."""
    log = plain.unturned
    return (
        FIRST_UNCERTAINTY * _pressure_per_speed(plain) * float(np.max(turns(log))) > FELT * log.noise[0].variance ** 0.5
    )


def _pressure_per_speed(plain: PlainFits) -> float:
    """Return the pressure that one sample of motor speed adds to a shut chamber [Pa s/rad]."""
    p = plain.start.parameters
    stiffness = plain.best.values["bulk_modulus"] / p.chamber_volume
    return plain.unturned.sample_time * p.pump_displacement * stiffness
