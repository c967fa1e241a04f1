"""Rival circuits of one log, one per level of friction, compared as far as the log can separate them.

No circuit follows a piston that creeps, sticks and slips to the sensors' noise: when it breaks loose depends on the
seals' law, which is known roughly. The cost then has many minima, and a search that begins at one level of friction
ends there. The advantage of one over another counts only as often as a wrong model's error gives independent looks,
much as in the intervals (`faults.diagnosis.circuits.model_doubt`).
"""

from collections.abc import Sequence

import numpy as np

from estimation.notes import EstimateCode
from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.beginning import SETTLING
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import LASTING, PointFit, fit_freely, least_scales, scales_of
from faults.diagnosis.circuits.model_doubt import NOISE_ALONE
from plant.arrays import Array
from plant.notes import Note

LOOKS = 5.0
"""Independent looks at a wrong model's error for the choice between two circuits that follow a log roughly
[dimensionless]: half of those for an interval, since both circuits err where the piston sticks and slips."""

ROUGH_RESIDUAL = 0.06
"""Share of velocity, root mean square, that a circuit leaves if it follows a piston roughly [dimensionless]: half of
the limit. Of 36 plain training logs of the open benchmark with travel over 4 mm, all but one leave less (0.062);
creeping ones with a wrong class over 90 % leave 0.12 and more."""

_SLIDING = [COORDINATES.index(name) for name in ("friction_quadratic", "friction_rated")]


def leaves_only_noise(blocks: Blocks, fit: PointFit) -> bool:
    """Return whether a circuit's residuals are the sensors' noise alone.

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


def is_followed_roughly(blocks: Blocks, fit: PointFit) -> bool:
    """Return whether a piston moves so little, or so roughly, that a search may have ended at a wrong friction level.

    Parameters
    ----------
    blocks : Blocks
        The log, with pressure.
    fit : PointFit
        The best circuit.

    Returns
    -------
    bool
        Whether residuals exceed the noise, and `ROUGH_RESIDUAL` of the velocity.
    """
    left, size = float(fit.scales[0]), float(blocks.rms[0])
    return left > max(NOISE_ALONE * float(least_scales(blocks)[0]), ROUGH_RESIDUAL * size)


def remaining_doubts(doubts: Sequence[Note], blocks: Blocks, fit: PointFit) -> tuple[Note, ...]:
    """Return the remaining objections given a circuit, without a fit of motion that failed for what its form lacks.

    The motion form knows neither drift nor stops nor a start in motion. A circuit, whose beginning does not count,
    follows such logs.

    Parameters
    ----------
    doubts : sequence of Note
        Objections before a circuit was fitted.
    fit : PointFit
        The best circuit.

    Returns
    -------
    tuple of Note
        All of them if leakage is constant and the log begins at rest and shows no stop, or if no circuit follows the
        piston.
    """
    unknown_to_motion = blocks.settling != SETTLING or blocks.stop is not None
    if blocks.leakage_course is None and (is_followed_roughly(blocks, fit) or not unknown_to_motion):
        return tuple(doubts)
    return tuple(note for note in doubts if note.code != EstimateCode.POSITION_RESIDUALS_LARGE)


def fits_from_other_friction(blocks: Blocks, actuator: Actuator, best: PointFit, condition: str) -> list[PointFit]:
    """Return the ends of searches that begin with another level of friction, and otherwise at a fit.

    Parameters
    ----------
    best : PointFit
        The best circuit so far.
    condition : str
        Its condition: the leakage stays.

    Returns
    -------
    list of PointFit
        One fit per other level. The force at rest stays too, since a piston that breaks loose shows it.
    """
    found: list[PointFit] = []
    for at, (name, other) in enumerate(CONDITIONS.items()):
        if name != condition and other.leakage == CONDITIONS[condition].leakage:
            start = best.coordinates.copy()
            start[_SLIDING] = actuator.conditions[at, _SLIDING]
            found.append(fit_freely(blocks, actuator, name, start))
    return found


def log_likelihood_behind(fits: Sequence[PointFit], best: PointFit, blocks: Blocks) -> Array:
    """Return the log-likelihood of each fit relative to the best, scaled by how well any circuit follows the log.

    If the better of two follows the piston, the log counts once per `LASTING` blocks. If it follows roughly, a wrong
    model's error decides between the two, and a log gives `LOOKS` looks at that. An output that is followed to the
    sensors' noise counts fully.

    Parameters
    ----------
    fits : sequence of PointFit
        The fits.
    best : PointFit
        The fit with which they are compared.
    blocks : Blocks
        The log. Without pressure a look always lasts `LASTING` blocks.

    Returns
    -------
    ndarray, shape (fits,)
        Log-likelihoods [dimensionless], 0 for the best; infinite if a circuit diverged.
    """
    scales = scales_of(blocks, best.fitted)
    found = np.full(len(fits), np.inf)
    for at, fit in enumerate(fits):
        if np.all(np.isfinite(fit.fitted)):
            others = scales_of(blocks, fit.fitted)
            looks = blocks.counts / blocks_a_look(blocks, _roughness(blocks, np.minimum(scales, others)))
            found[at] = float(looks @ np.log(others / scales))
    return found


def blocks_a_look(blocks: Blocks, error: Array) -> Array:
    """Return how many blocks count as one look at a model.

    Parameters
    ----------
    error : ndarray, shape (outputs,)
        Share of each output's residuals that is a wrong model's error [fraction].

    Returns
    -------
    ndarray, shape (outputs,)
        `LASTING` for noise alone; with a wrong model's error, a long log gives `LOOKS` looks [dimensionless].
    """
    return np.asarray(LASTING + error * blocks.counts / LOOKS, dtype=np.float64)


def model_error_share(blocks: Blocks, scales: Array) -> Array:
    """Return the share of a circuit's residuals that is a wrong model's error.

    Parameters
    ----------
    scales : ndarray, shape (outputs,)
        Root mean square residuals [m/s, Pa].

    Returns
    -------
    ndarray, shape (outputs,)
        What is beyond the sensors' noise [fraction].
    """
    noise = NOISE_ALONE * least_scales(blocks)
    return np.asarray(np.maximum(1.0 - (noise / scales) ** 2, 0.0), dtype=np.float64)


def _roughness(blocks: Blocks, scales: Array) -> Array:
    """Return the share of each output's residuals that is a wrong model's error, if the piston is followed roughly.

    All beyond noise from twice `ROUGH_RESIDUAL` on, nothing up to it [dimensionless].
    """
    if blocks.pressure is None:
        return np.zeros(len(scales))
    tiny = float(np.finfo(float).tiny)
    rough = min(max(float(scales[0]) / max(ROUGH_RESIDUAL * float(blocks.rms[0]), tiny) - 1.0, 0.0), 1.0)
    return np.asarray(rough * model_error_share(blocks, scales), dtype=np.float64)


def covariance_between_fits(fits: Sequence[PointFit], best: PointFit, worse: Array) -> Array:
    """Return the covariance that other, nearly equal ends of a search add to the best.

    Parameters
    ----------
    fits : sequence of PointFit
        The ends of the search.
    best : PointFit
        The fit that is reported.
    worse : ndarray, shape (fits,)
        Log-likelihood by which each is behind it, from `log_likelihood_behind` [dimensionless].

    Returns
    -------
    ndarray, shape (7, 7)
        Second moment about the best [dimensionless]; zero if the others explain much less.
    """
    shares = np.exp(np.min(worse) - worse)
    off = np.array([fit.coordinates - best.coordinates for fit in fits])
    return np.asarray((off.T * shares / np.sum(shares)) @ off, dtype=np.float64)
