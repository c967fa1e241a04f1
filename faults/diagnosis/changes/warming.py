"""Without pressure: does the oil warm or cool within a log? A circuit with drifting leakage against a constant one.

With pressure, the flow balance detects a drifting leakage (`estimation.eha.changing_leakage`). Without it, the best
circuit gets an eighth unknown, the drift of leakage. Viscous friction falls as leakage rises. The predicted gain from
its slope decides whether a search is worth while, which for most logs it is not.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from estimation.eha.changing_leakage import changed_leakage_note
from estimation.eha.explanation_notes import LEAKAGE_COURSE
from estimation.log_checks.clean import CleanLog
from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import LONGEST, Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import LASTING, PointFit, fit_freely, misfit
from faults.diagnosis.circuits.class_regions import ClassFits, is_stuck
from faults.diagnosis.circuits.yielding import UNEXPLAINED, yields_on_seals
from plant.arrays import Array
from plant.notes import Note

BELIEVED_ODDS = 10.0
"""How many times likelier a circuit with drifting leakage must be than one with constant leakage [dimensionless]:
evidence is called strong above that (Jeffreys, Theory of Probability, 1961, appendix B)."""

LEAST_DRIFT = 0.2
"""Least drift, as a logarithm [dimensionless]: less than two deviations of actuators of one kind changes no class."""

DRIFT_PRIOR_STD = 1.0
"""Prior standard deviation of the drift, as a logarithm [dimensionless]: oil that warms by 25 K."""

LEAST_PROMISED_GAIN = 1.0
"""Predicted gain in log-likelihood from which a drift is searched [dimensionless], in `LASTING` blocks that count as
one."""

LEAST_FIRST_STEP = 0.5 * LEAST_DRIFT
"""Least first step of a search that may reach `LEAST_DRIFT` [dimensionless]."""

DOUBLING_DRIFT = float(np.log(2.0))
"""Drift at which a search begins if slopes lead nowhere [dimensionless]."""

FARTHEST, NEAR, ROUNDS = 0.7, 0.05, 4
"""Longest step in the logarithm, the step that ends a search [dimensionless], and the most steps."""

MOST_GAIN_RATIO = 2.0
"""How many times what the last step gained, or what the next one promises, each step that is left may gain
[dimensionless]: steps to a tenfold leakage gained up to twice the one before, or the promise."""

NUDGE = 0.02
"""Step of the finite difference in the logarithm [dimensionless]."""

_LEAKAGE_DIRECTION = np.array([1.0 if name == "leakage" else 0.0 for name in COORDINATES])


class Drift(NamedTuple):
    """A drift of leakage over a log.

    Parameters
    ----------
    logarithm : float
        Logarithm of leakage at the end over that at the beginning [dimensionless].
    fit : PointFit
        The circuit; its leakage is that at the end.
    gain : float
        Log-likelihood that it gains over constant leakage, in `LASTING` blocks that count as one [dimensionless].
    """

    logarithm: float
    fit: PointFit
    gain: float

    @property
    def is_shown(self) -> bool:
        """Whether the log shows it."""
        return abs(self.logarithm) >= LEAST_DRIFT and self.gain - 0.5 * (
            self.logarithm / DRIFT_PRIOR_STD
        ) ** 2 > np.log(BELIEVED_ODDS)


def find_drift(blocks: Blocks, fits: ClassFits, actuator: Actuator, wanted: float = 0.0) -> Drift | None:
    """Return the drift of leakage that a log without pressure shows.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fits : ClassFits
        The circuits with constant leakage that were fitted to it.
    actuator : Actuator
        The healthy actuator.
    wanted : float
        Gain below which a drift is of no use [dimensionless]: a search ends where the steps that are left would hardly
        bring it to that, see `MOST_GAIN_RATIO`.

    Returns
    -------
    Drift or None
        None with pressure, if the log shows none, if no circuit with one follows it, if one without follows a nearly
        resting piston within what its seals yield, and for logs longer than what is fitted.
    """
    whole = len(blocks.speed) * blocks.sample_time <= LONGEST
    if blocks.pressure is not None or blocks.leakage_course is not None or not whole or is_stuck(blocks, actuator):
        return None
    if yields_on_seals(blocks, fits.best, actuator):
        return None
    condition, none = list(CONDITIONS)[int(np.argmax(fits.scores))], Drift(0.0, fits.best, 0.0)
    promised, moved, step = _step(blocks, none, actuator)
    most = UNEXPLAINED[0] * blocks.rms[0]
    if promised > LEAST_PROMISED_GAIN and abs(moved) >= LEAST_FIRST_STEP:
        starts = [(moved, step)]
    elif none.fit.scales[0] > most:
        starts = [(way * DOUBLING_DRIFT, 0.5 * way * DOUBLING_DRIFT * _LEAKAGE_DIRECTION) for way in (1.0, -1.0)]
    else:
        return None
    found = max(
        (_search_drift(blocks, none, *one, condition, actuator, wanted) for one in starts), key=lambda one: one.gain
    )
    followed = found.fit.scales[0] <= most  # a drift must also make the circuit follow the log
    return found if found.is_shown and followed else None


def with_drift(blocks: Blocks, logarithm: float) -> Blocks:
    """Return a log over which leakage drifts, linearly in its logarithm, to its value at the end.

    Parameters
    ----------
    logarithm : float
        Logarithm of leakage at the end over that at the beginning [dimensionless].

    Returns
    -------
    Blocks
        The same log.
    """
    return replace(blocks, leakage_course=leakage_course(logarithm, len(blocks.speed)))


def leakage_course(logarithm: float, samples: int) -> Array:
    """Return leakage over its value at the end.

    Parameters
    ----------
    logarithm : float
        Logarithm of leakage at the end over that at the beginning [dimensionless].
    samples : int
        How many [samples].

    Returns
    -------
    ndarray, shape (samples,)
        Dimensionless.

    Examples
    --------
    >>> leakage_course(float(np.log(4.0)), 3).round(6).tolist()
    [0.25, 0.5, 1.0]
    """
    return np.asarray(np.exp(logarithm * (np.linspace(0.0, 1.0, samples) - 1.0)), dtype=np.float64)


def with_leakage_course(log: CleanLog, found: Drift) -> tuple[CleanLog, Note]:
    """Return a log with the drift that it shows, and a note.

    Returns
    -------
    tuple of CleanLog and Note
        The log with a `LEAKAGE_COURSE`; that leakage drifts as oil warms or cools, or that it grows by more than that.
    """
    factor, last = float(np.exp(found.logarithm)), float(np.exp(found.fit.coordinates @ _LEAKAGE_DIRECTION))
    course = leakage_course(found.logarithm, len(log.record))
    return replace(log, record=log.record.replace(**{LEAKAGE_COURSE: course})), changed_leakage_note(factor, last)


def _search_drift(
    blocks: Blocks, none: Drift, moved: float, step: Array, condition: str, actuator: Actuator, wanted: float
) -> Drift:
    """Return the end of a search that starts from a circuit with a given drift."""
    found = none
    for left in range(ROUNDS - 1, -1, -1):
        there = with_drift(blocks, found.logarithm + moved)
        fit = fit_freely(there, actuator, condition, found.fit.coordinates + step)
        gain = (misfit(blocks, none.fit.fitted) - misfit(there, fit.fitted)) / LASTING
        if found is not none and not gain > found.gain:
            break
        last, found = found.gain, Drift(found.logarithm + moved, fit, gain)
        promised, moved, step = _step(blocks, found, actuator)
        if not abs(moved) >= NEAR or gain + left * MOST_GAIN_RATIO * max(promised, gain - last) < wanted:
            break
    return found


def _step(blocks: Blocks, found: Drift, actuator: Actuator) -> tuple[float, float, Array]:
    """Return the predicted gain of the next step of a drift, that step, and that of the coordinates.

    All move at once (Gauss-Newton); the gain is that of the drift alone.
    """
    drift, fit, _ = found
    rows = parameter_rows((fit.coordinates + 0.5 * NUDGE * _LEAKAGE_DIRECTION)[None], actuator.circuit, actuator.rated)
    moved = predicted_outputs(with_drift(blocks, drift + NUDGE), rows)[
        0
    ]  # leakage halfway through the log is unchanged
    slopes = np.concatenate([fit.slopes, ((moved - fit.fitted) / NUDGE)[None]])[:, blocks.first :] / fit.scales
    slopes = np.where(blocks.valid, slopes, 0.0).reshape(len(slopes), -1)
    uphill = slopes @ np.nan_to_num((blocks.outputs - fit.fitted)[blocks.first :] / fit.scales).ravel()
    uphill[-1] -= LASTING * drift / DRIFT_PRIOR_STD**2
    covariance = np.linalg.inv(slopes @ slopes.T + np.eye(len(slopes)) * LASTING / DRIFT_PRIOR_STD**2)
    step = covariance @ uphill
    promised = 0.5 * float(step[-1] ** 2 / covariance[-1, -1]) / LASTING
    step *= min(1.0, FARTHEST / float(np.max(np.abs(step))))
    return promised, float(step[-1]), step[:-1] + 0.5 * step[-1] * _LEAKAGE_DIRECTION
