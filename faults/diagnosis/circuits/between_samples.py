"""`with_fitted_lead(blocks, actuator)`: a slow log with its motor's course between samples, as a circuit determines it.

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
from faults.diagnosis.circuits.circuit_runs import parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import (
    ROUGH_GAIN,
    WEAK_PRIOR,
    PointFit,
    fit_freely,
    misfit,
    nominal_runs,
    normalised_rows,
)
from faults.diagnosis.circuits.model_doubt import error_moment, seldom_known_slopes, seldom_known_spreads
from plant.arrays import Array

ROUNDS = 3
"""Most linear steps to a lead [count]."""

CONVERGED_STEP = 0.005
"""Last step over the sample time at which the lead has converged [dimensionless]: it moves severities by some
hundredths of their deviations."""

NUDGE = 0.02
"""Finite-difference step of a lead, over the sample time [dimensionless]."""


def with_fitted_lead(blocks: Blocks, actuator: Actuator) -> Blocks:
    """Return a slow log with the lead of its motor that a circuit determines; any other log unchanged.

    Returns
    -------
    Blocks
        The log, with a speed half-way between each two samples. A log without pressure is unchanged.
    """
    if blocks.pressure is None or blocks.averaged or blocks.sample_time < SLOW:
        return blocks
    found, start = with_motor_lead(blocks, 0.0), None
    nearest = list(CONDITIONS)[int(np.argmin([misfit(found, run) for run in nominal_runs(found, actuator)]))]
    for _ in range(ROUNDS):
        fit = fit_freely(found, actuator, nearest, start, ROUGH_GAIN)
        step = _lead_step(found, fit, actuator)
        if not np.isfinite(step):
            return blocks
        start, found = fit.coordinates, with_motor_lead(found, found.lead + step)
        if abs(step) < CONVERGED_STEP * blocks.sample_time:
            break
    return found


def with_motor_lead(blocks: Blocks, lead: float) -> Blocks:
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
    >>> with_motor_lead(steps, 1e-3).speed.tolist()
    [0.0, 0.0, 0.0, 70.0, 100.0, 100.0, 100.0]
    """
    logged, sample_time = blocks.speed[:: blocks.substeps], blocks.sample_time * blocks.substeps
    bend = steady_bend(logged)
    half_way = 0.5 * (logged[1:] + logged[:-1]) - (bend[1:] + bend[:-1]) / 12.0
    speed = np.empty(2 * len(logged) - 1)
    speed[::2], speed[1::2] = logged, half_way + 2.0 * lead / sample_time * np.diff(logged)
    if blocks.substeps > 1:
        return replace(blocks, speed=speed, lead=lead)
    course = blocks.leakage_course
    if course is not None:
        course = np.interp(np.arange(len(speed)) / 2.0, np.arange(len(course)), course)
    return replace(
        blocks,
        speed=speed,
        sample_time=0.5 * sample_time,
        block=2 * blocks.block,
        leakage_course=course,
        lead=lead,
        substeps=2,
    )


def nuisance_unknowns(fit: PointFit, blocks: Blocks, actuator: Actuator) -> tuple[Array, Array]:
    """Return the nuisance unknowns of a circuit: seldom known parameters, and a slow log's lead.

    Returns
    -------
    tuple of ndarray, shapes (m, n, outputs) and (m,)
        Response of the outputs to each, and its standard deviation, see `seldom_known_slopes` and
        `seldom_known_spreads`.
    """
    slopes, spreads = seldom_known_slopes(fit, blocks, actuator), seldom_known_spreads(actuator)
    if blocks.substeps == 1:
        return slopes, spreads
    return np.concatenate([slopes, _lead_slope(blocks, fit, actuator)[None]]), np.append(spreads, MOST_LEAD)


def spread_with_pressure(
    fit: PointFit, blocks: Blocks, actuator: Actuator, scores: Array, seen: Array, among: Array
) -> Array:
    """Return the covariance of the coordinates of a circuit fitted to a log with pressure, for intervals.

    Parameters
    ----------
    scores : ndarray, shape (9,)
        How well each condition's region holds it: log-likelihoods [dimensionless].
    seen : ndarray, shape (7,)
        See `error_moment`.
    among : ndarray, shape (7, 7)
        Covariance between this and other circuits that fit as well [dimensionless].

    Returns
    -------
    ndarray, shape (7, 7)
        With the effect of the nuisance unknowns [dimensionless].
    """
    slopes, spreads = nuisance_unknowns(fit, blocks, actuator)
    return error_moment(fit, slopes, blocks, actuator.conditions, scores, seen, spreads) + among


def _lead_step(blocks: Blocks, fit: PointFit, actuator: Actuator) -> float:
    """Return the step of the lead, with all coordinates free beside it [s]."""
    slopes = np.concatenate([fit.slopes, _lead_slope(blocks, fit, actuator)[None]])
    weighted, left = normalised_rows(blocks, fit, slopes)
    prior = np.zeros((len(slopes), len(slopes)))
    prior[:-1, :-1], prior[-1, -1] = np.linalg.inv(WEAK_PRIOR), MOST_LEAD**-2
    sample_time = blocks.sample_time * blocks.substeps
    pull = weighted @ left
    pull[-1] -= prior[-1, -1] * blocks.lead / sample_time
    try:
        return sample_time * float(np.linalg.solve(weighted @ weighted.T + prior, pull)[-1])
    except np.linalg.LinAlgError:  # the circuit's outputs are not finite
        return float("nan")


def _lead_slope(blocks: Blocks, fit: PointFit, actuator: Actuator) -> Array:
    """Return the derivative of the outputs by the lead over the sample time, shape (n, outputs)."""
    rows = parameter_rows(fit.coordinates[None], actuator.circuit, actuator.rated)
    ahead = with_motor_lead(blocks, blocks.lead + NUDGE * blocks.sample_time * blocks.substeps)
    return np.asarray(
        (predicted_outputs(ahead, rows)[0] - predicted_outputs(blocks, rows)[0]) / NUDGE, dtype=np.float64
    )
