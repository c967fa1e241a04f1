"""Rival circuits of one log, one per level of friction, compared as far as the log can separate them.

A piston that creeps on its seals, sticks and slips is followed by no circuit to the sensors' noise: when it breaks
loose rests on the seals' law, which is known roughly. The misfit has many minima then, and a search that begins at
one level of friction ends there. What one end explains more than another counts no more often than a wrong model's
error gives independent looks, much as in the intervals (`faults.diagnosis.circuits.model_doubt`).
"""

from collections.abc import Sequence

import numpy as np

from estimation.notes import EstimateCode
from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import SETTLING, Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import LASTING, PointFit, fit_freely, least_scales, scales_of
from faults.diagnosis.circuits.model_doubt import NOISE_ALONE
from plant.arrays import Array
from plant.notes import Note

LOOKS = 5.0
"""Independent looks at a wrong model's error by which one of two circuits that follow a log roughly is preferred
[dimensionless]: half of those that an interval counts, as both circuits err where the piston sticks and slips."""

ROUGHLY = 0.06
"""Share of velocity, root mean square, that is left where a circuit follows a piston roughly [dimensionless]: half of
what may be left unexplained. Of 36 plain training logs of the open benchmark all but one of those that travel further
than 4 mm leave less (0.062); creeping ones that were called wrongly over 90 % leave 0.12 and more."""

_SLIDING = [COORDINATES.index(name) for name in ("friction_quadratic", "friction_rated")]


def explains(blocks: Blocks, fit: PointFit) -> bool:
    """Return whether a circuit leaves the sensors' noise alone of a log.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fit : PointFit
        The circuit fitted to it.

    Returns
    -------
    bool
        Whether no output's residuals are more than `NOISE_ALONE` times the noise.
    """
    return bool(np.all(fit.scales <= NOISE_ALONE * least_scales(blocks)))


def creeps(blocks: Blocks, fit: PointFit) -> bool:
    """Return whether a piston moves so little, or so roughly, that a search may have ended beside its friction.

    Parameters
    ----------
    blocks : Blocks
        The log, with pressure.
    fit : PointFit
        The circuit that explains it best.

    Returns
    -------
    bool
        Whether more than noise, and more than `ROUGHLY` of the velocity, is left.
    """
    left, size = float(fit.scales[0]), float(blocks.sizes[0])
    return left > max(NOISE_ALONE * float(least_scales(blocks)[0]), ROUGHLY * size)


def doubts_left(doubts: Sequence[Note], blocks: Blocks, fit: PointFit) -> tuple[Note, ...]:
    """Return the objections left beside a circuit; a failed motion fit is none if its form lacks what the log shows.

    The motion form knows none of these. A circuit, whose beginning does not count, says how the piston moves.

    Parameters
    ----------
    doubts : sequence of Note
        What speaks against the log before a circuit was fitted.
    blocks : Blocks
        The log.
    fit : PointFit
        The circuit that explains it best.

    Returns
    -------
    tuple of Note
        All of them where leakage stays and the log begins at rest and shows no stop, or no circuit follows the piston.
    """
    unknown_to_motion = blocks.settling != SETTLING or blocks.stop is not None
    if blocks.course is None and (creeps(blocks, fit) or not unknown_to_motion):
        return tuple(doubts)
    return tuple(note for note in doubts if note.code != EstimateCode.POSITION_RESIDUALS_LARGE)


def other_friction(blocks: Blocks, actuator: Actuator, best: PointFit, condition: str) -> list[PointFit]:
    """Return the ends of searches that begin with the friction of another level, and with all else as in a fit.

    Parameters
    ----------
    blocks : Blocks
        The log.
    actuator : Actuator
        The healthy actuator.
    best : PointFit
        The circuit that explains the log best so far.
    condition : str
        The condition in which it is: its leakage stays.

    Returns
    -------
    list of PointFit
        A fit for each other level. The force at rest stays too, since a piston that breaks loose shows it.
    """
    found: list[PointFit] = []
    for at, (name, other) in enumerate(CONDITIONS.items()):
        if name != condition and other.leakage == CONDITIONS[condition].leakage:
            start = best.coordinates.copy()
            start[_SLIDING] = actuator.conditions[at, _SLIDING]
            found.append(fit_freely(blocks, actuator, name, start))
    return found


def behind(fits: Sequence[PointFit], best: PointFit, blocks: Blocks) -> Array:
    """Return the log-likelihood ratio of each fit to the best, scaled by how well any circuit follows the log.

    Where the better of two follows the piston, the log is looked at once in `LASTING` blocks. Where it follows it
    roughly, a wrong model's error decides between the two, and of that a log gives `LOOKS` looks; an output that it
    follows to the sensors' noise is not in doubt.

    Parameters
    ----------
    fits : sequence of PointFit
        The fits.
    best : PointFit
        The one that they are compared with.
    blocks : Blocks
        The log. Without pressure a look lasts `LASTING` blocks in any case.

    Returns
    -------
    ndarray, shape (fits,)
        Log-likelihoods [dimensionless], 0 for the best; infinite where a circuit ran away.
    """
    scales, noise = scales_of(blocks, best.fitted), NOISE_ALONE * least_scales(blocks)
    found = np.full(len(fits), np.inf)
    for at, fit in enumerate(fits):
        if np.all(np.isfinite(fit.fitted)):
            others = scales_of(blocks, fit.fitted)
            error = _roughness(blocks, np.minimum(scales, others), noise)
            looks = blocks.counts / (LASTING + error * blocks.counts / LOOKS)
            found[at] = float(looks @ np.log(others / scales))
    return found


def _roughness(blocks: Blocks, scales: Array, noise: Array) -> Array:
    """Return which share of each output's residuals is a wrong model's error, where the piston is followed roughly.

    All of what is no noise from twice `ROUGHLY` on, nothing up to it [dimensionless].
    """
    if blocks.pressure is None:
        return np.zeros(len(scales))
    tiny = float(np.finfo(float).tiny)
    rough = min(max(float(scales[0]) / max(ROUGHLY * float(blocks.sizes[0]), tiny) - 1.0, 0.0), 1.0)
    return np.asarray(rough * np.maximum(1.0 - (noise / scales) ** 2, 0.0), dtype=np.float64)


def between_fits(fits: Sequence[PointFit], best: PointFit, worse: Array) -> Array:
    """Return the covariance that near-equal other ends of a search add to the best.

    Parameters
    ----------
    fits : sequence of PointFit
        The ends of the search.
    best : PointFit
        The one that is told.
    worse : ndarray, shape (fits,)
        How far each is behind that one, by `behind` [dimensionless].

    Returns
    -------
    ndarray, shape (7, 7)
        Second moment about the best [dimensionless]; none where the others explain much less.
    """
    shares = np.exp(np.min(worse) - worse)
    off = np.array([fit.coordinates - best.coordinates for fit in fits])
    return np.asarray((off.T * shares / np.sum(shares)) @ off, dtype=np.float64)
