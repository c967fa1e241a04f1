"""Four evidences on one log, one scoreboard: transfer functions, models, innovations, estimated parameters."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimation.finding import Change
from estimation.identification.model.linear_model import LinearModel
from faults.conditions import CONDITIONS
from faults.diagnosis.calibration import Calibration
from faults.diagnosis.changes.onset import last_part
from faults.diagnosis.changes.warming import Drift
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_regions import ClassFits, is_stuck
from faults.diagnosis.innovation_bank import innovation_scores
from faults.diagnosis.rmse import score_transfer_functions
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

EVIDENCES = ("transfer_functions", "models", "innovations", "parameters")
"""The evidences, in the order of the scoreboard's rows."""

FARTHEST = 30.0
"""Largest log-odds of an evidence [dimensionless]: no model is more certain than that."""

BREAKAWAY_RATIO = 1.2
"""Ratio by which the breakaway force may differ between actuators of one kind [dimensionless]."""

SAMPLES = 20.0
"""Number of independent samples that a root-mean-square error stands for [dimensionless]; the weights scale it."""


@dataclass(frozen=True, eq=False)
class Scoreboard:
    """Scores of the evidences on a log.

    Parameters
    ----------
    log_odds : Mapping[str, ndarray of shape (9,)]
        By evidence, each condition's score below the best [dimensionless], 0 for the best; unavailable evidence is
        absent.
    blocks : Blocks
        The log as it was compared.
    fits : ClassFits
        The circuits that were fitted.
    window : Record
        The part of the log that was used.
    onset : Change or None
        When the condition began; only what follows is judged. None if it began before the log.
    against : tuple of Note
        What changed within the log and is no change of condition.
    drift : Drift or None
        Drift of its leakage, which these evidences ignore; without pressure.
    """

    log_odds: Mapping[str, Array]
    blocks: Blocks
    fits: ClassFits
    window: Record
    onset: Change | None
    against: tuple[Note, ...] = ()
    drift: Drift | None = None

    def choice(self, evidence: str) -> str:
        """Return the condition that one evidence alone names.

        Parameters
        ----------
        evidence : str
            One of those in `log_odds`.
        """
        return list(CONDITIONS)[int(np.argmax(self.log_odds[evidence]))]

    def probabilities(self, calibration: Calibration) -> Mapping[str, float]:
        """Return the probability of each condition: a multinomial model on the evidences' log-odds.

        Returns
        -------
        Mapping[str, float]
            Probability by condition [probability]; they sum to 1.
        """
        weights = calibration.weights(self.blocks.pressure is not None)
        total = np.sum([weights[name] * odds for name, odds in self.log_odds.items()], axis=0)
        shares = np.exp(total - np.max(total))
        return dict(zip(CONDITIONS, (float(share) for share in shares / np.sum(shares)), strict=True))


def weigh_evidence(record: Record, actuator: Actuator, library: Mapping[str, LinearModel] | None = None) -> Scoreboard:
    """Return the scores of the evidences for the condition at the end of a log.

    Parameters
    ----------
    library : Mapping[str, LinearModel], optional
        Transfer functions of the nine conditions of this actuator; without it that evidence is absent.

    Raises
    ------
    LogError
        If the log has neither position nor velocity, or is too short.
    """
    part = last_part(record, actuator)
    record, blocks, fits = part.record, part.blocks, part.fits
    found = {
        "models": models_scores(fits),
        "innovations": innovation_scores(record, actuator.circuit) / blocks.rows,
        "parameters": fits.scores,
    }
    if library is not None:
        table = score_transfer_functions(record, library).by_condition
        found["transfer_functions"] = -SAMPLES * np.log([table[name] for name in CONDITIONS])
    apart = fits.separations(actuator)
    found = {
        name: scores if name == "parameters" else limited_by_separation(scores, apart) for name, scores in found.items()
    }
    if is_stuck(blocks, actuator):
        found = {name: friction_left_open(scores, blocks, actuator) for name, scores in found.items()}
    odds = {name: bounded_log_odds(found[name]) for name in EVIDENCES if name in found}
    return Scoreboard(odds, blocks, fits, part.window, part.onset, part.against, part.drift)


def models_scores(fits: ClassFits) -> Array:
    """Return the score of each condition's nominal circuit on a log.

    Returns
    -------
    ndarray, shape (9,)
        Log-likelihoods [dimensionless] up to a constant of the log.
    """
    return np.asarray(-SAMPLES * np.sum(np.log(fits.nominal_scales), axis=1), dtype=np.float64)


def limited_by_separation(scores: Array, apart: Array) -> Array:
    """Return the scores of nominal circuits, limited by how far the log separates the conditions.

    Nominal circuits differ from the actuator in all other fitted parameters as well. If the log says nothing about
    friction or leakage, these differences would be taken for it.

    Parameters
    ----------
    scores : ndarray, shape (9,)
        Log-likelihoods of the conditions [dimensionless].
    apart : ndarray, shape (9, 9)
        How far the log separates the conditions, see `faults.diagnosis.circuits.region_scores.separations`.

    Returns
    -------
    ndarray, shape (9,)
        None is farther below another than the log separates the two [dimensionless].

    Examples
    --------
    >>> limited_by_separation(np.array([0.0, -20.0]), np.array([[0.0, 3.0], [3.0, 0.0]])).tolist()
    [0.0, -3.0]
    """
    return np.asarray(np.max(scores[:, None] - apart, axis=0), dtype=np.float64)


def friction_left_open(scores: Array, blocks: Blocks, actuator: Actuator) -> Array:
    """Score the friction levels that hold the piston equally: a stuck piston cannot separate them.

    Parameters
    ----------
    scores : ndarray, shape (9,)
        Log-likelihoods of the conditions [dimensionless].
    blocks : Blocks
        The log; without pressure every level may hold.

    Returns
    -------
    ndarray, shape (9,)
        For a level that holds against the largest pressure, the best score among those of the same leakage.
    """
    reached = (
        0.0 if blocks.pressure is None else actuator.circuit.piston_area * float(np.nanmax(np.abs(blocks.pressure)))
    )
    holding = np.exp(actuator.conditions[:, COORDINATES.index("friction_rest")]) * BREAKAWAY_RATIO > reached
    leakage = np.array([condition.leakage for condition in CONDITIONS.values()])
    alike = [np.max(scores[holding & (leakage == level)], initial=-np.inf) for level in leakage]
    return np.where(holding, alike, scores)


def bounded_log_odds(scores: Array) -> Array:
    """Return log-odds to the best, compressed so that none falls below ``-FARTHEST``.

    Parameters
    ----------
    scores : ndarray, shape (n,)
        Log-likelihoods [dimensionless].

    Returns
    -------
    ndarray, shape (n,)
        Between ``-FARTHEST`` and 0 [dimensionless].

    Examples
    --------
    >>> bounded_log_odds(np.array([1.0, 0.0, -np.inf])).round(2).tolist()
    [0.0, -0.98, -30.0]
    """
    scores = np.where(np.isnan(scores), -np.inf, scores)
    if not np.any(np.isfinite(scores)):
        return np.zeros(len(scores))
    return FARTHEST * np.expm1((scores - np.max(scores)) / FARTHEST)
