"""`with_lead(blocks, actuator)`: a slow log with its motor's course between samples, as a circuit determines it.

A slow log has the motor speed at its samples only. If commands come at samples, as with a controller that shares the
logger's clock, a motor that settles within a sample or two leads the straight line at every turn. The oil pumped in
this way moves the piston at once; a circuit driven by straight lines absorbs it in friction and leakage. The flow form
has a lead for that (`estimation.models.flow.delivered_flow`), and so have circuits here.
"""

from dataclasses import replace

import numpy as np

from estimation.fits.flow.log import MOST_LEAD
from estimation.fits.greybox.intersample_doubt import SLOW
from estimation.fits.greybox.intersample_speed import steady_bend
from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import parameter_rows, predicted
from faults.diagnosis.circuits.class_fit import WEAK, PointFit, fit_freely, misfit, nominal_runs
from faults.diagnosis.circuits.model_doubt import doubt_of, left_of, seldom_known_slopes, spreads_of
from plant.arrays import Array

ROUNDS = 3
"""Most linear steps to a lead [count]."""

ROUGHLY = 10.0
"""Gain in log-likelihood below which the search before each ends [dimensionless]."""

SETTLED = 0.005
"""Last step over the sample time at which the lead has converged [dimensionless]: it moves severities by some
hundredths of their deviations."""

NUDGE = 0.02
"""Finite-difference step of a lead, over the sample time [dimensionless]."""


def with_lead(blocks: Blocks, actuator: Actuator) -> Blocks:
    """Return a slow log with the lead of its motor that a circuit determines; any other log unchanged.

    Parameters
    ----------
    blocks : Blocks
        The log.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    Blocks
        The log, with a speed half-way between each two samples. A log without pressure is unchanged.
    """
    if blocks.pressure is None or blocks.averaged or blocks.sample_time < SLOW:
        return blocks
    found, start = led(blocks, 0.0), None
    nearest = list(CONDITIONS)[int(np.argmin([misfit(found, run) for run in nominal_runs(found, actuator)]))]
    for _ in range(ROUNDS):
        fit = fit_freely(found, actuator, nearest, start, ROUGHLY)
        step = _step(found, fit, actuator)
        if not np.isfinite(step):
            return blocks
        start, found = fit.coordinates, led(found, found.lead + step)
        if abs(step) < SETTLED * blocks.sample_time:
            break
    return found


def led(blocks: Blocks, lead: float) -> Blocks:
    """Return a log whose motor leads the straight lines between its samples.

    Parameters
    ----------
    blocks : Blocks
        The log, with or without speeds between its samples.
    lead : float
        The motor turns further by this time, multiplied by each rise of the speed [s].

    Returns
    -------
    Blocks
        The log, with speeds half-way and straight lines between them: their mean is that of the curve if the bend is
        steady, and otherwise that of the straight line with the lead.

    Examples
    --------
    >>> steps = Blocks(np.array([0.0, 0.0, 100.0, 100.0]), 0.01, 2, np.zeros(1), np.zeros(1), np.ones(2))
    >>> led(steps, 1e-3).speed.tolist()
    [0.0, 0.0, 0.0, 70.0, 100.0, 100.0, 100.0]
    """
    logged, sample_time = blocks.speed[:: blocks.between], blocks.sample_time * blocks.between
    bend = steady_bend(logged)
    half_way = 0.5 * (logged[1:] + logged[:-1]) - (bend[1:] + bend[:-1]) / 12.0
    speed = np.empty(2 * len(logged) - 1)
    speed[::2], speed[1::2] = logged, half_way + 2.0 * lead / sample_time * np.diff(logged)
    if blocks.between > 1:
        return replace(blocks, speed=speed, lead=lead)
    course = blocks.course
    if course is not None:
        course = np.interp(np.arange(len(speed)) / 2.0, np.arange(len(course)), course)
    return replace(
        blocks,
        speed=speed,
        sample_time=0.5 * sample_time,
        block=2 * blocks.block,
        course=course,
        lead=lead,
        between=2,
    )


def open_beside(fit: PointFit, blocks: Blocks, actuator: Actuator) -> tuple[Array, Array]:
    """Return the nuisance unknowns of a circuit: seldom known parameters, and a slow log's lead.

    Parameters
    ----------
    fit : PointFit
        The fit.
    blocks : Blocks
        Its log.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    tuple of ndarray, shapes (m, n, outputs) and (m,)
        Response of the outputs to each, and its standard deviation, see `seldom_known_slopes` and `spreads_of`.
    """
    slopes, spreads = seldom_known_slopes(fit, blocks, actuator), spreads_of(actuator)
    if blocks.between == 1:
        return slopes, spreads
    return np.concatenate([slopes, _slope(blocks, fit, actuator)[None]]), np.append(spreads, MOST_LEAD)


def spread_with_pressure(
    fit: PointFit, blocks: Blocks, actuator: Actuator, scores: Array, seen: Array, among: Array
) -> Array:
    """Return the covariance of the coordinates of a circuit fitted to a log with pressure, for intervals.

    Parameters
    ----------
    fit : PointFit
        The fit.
    blocks : Blocks
        Its log.
    actuator : Actuator
        The healthy actuator.
    scores : ndarray, shape (9,)
        How well each condition's region holds it: log-likelihoods [dimensionless].
    seen : ndarray, shape (7,)
        See `doubt_of`.
    among : ndarray, shape (7, 7)
        Covariance between this and other circuits that fit as well [dimensionless].

    Returns
    -------
    ndarray, shape (7, 7)
        With the effect of the nuisance unknowns [dimensionless].
    """
    slopes, spreads = open_beside(fit, blocks, actuator)
    return doubt_of(fit, slopes, blocks, actuator.conditions, scores, seen, spreads) + among


def _step(blocks: Blocks, fit: PointFit, actuator: Actuator) -> float:
    """Return the step of the lead, with all coordinates free beside it [s]."""
    slopes = np.concatenate([fit.slopes, _slope(blocks, fit, actuator)[None]])[:, blocks.first :]
    weighted = np.where(blocks.seen, slopes / fit.scales, 0.0).reshape(len(slopes), -1)
    left = np.where(blocks.seen, left_of(fit, blocks) / fit.scales, 0.0).ravel()
    prior = np.zeros((len(slopes), len(slopes)))
    prior[:-1, :-1], prior[-1, -1] = np.linalg.inv(WEAK), MOST_LEAD**-2
    sample_time = blocks.sample_time * blocks.between
    pull = weighted @ left
    pull[-1] -= prior[-1, -1] * blocks.lead / sample_time
    try:
        return sample_time * float(np.linalg.solve(weighted @ weighted.T + prior, pull)[-1])
    except np.linalg.LinAlgError:  # the circuit's outputs are not finite
        return float("nan")


def _slope(blocks: Blocks, fit: PointFit, actuator: Actuator) -> Array:
    """Return the derivative of the outputs by the lead over the sample time, shape (n, outputs)."""
    rows = parameter_rows(fit.coordinates[None], actuator.circuit, actuator.rated)
    ahead = led(blocks, blocks.lead + NUDGE * blocks.sample_time * blocks.between)
    return np.asarray((predicted(ahead, rows)[0] - predicted(blocks, rows)[0]) / NUDGE, dtype=np.float64)
