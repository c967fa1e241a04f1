"""Faults outside the nine conditions that a log without pressure does not exclude: how likely, and what they change.

Some leave no trace in motion: a relief valve that would open at a pressure the log never reaches, a make-up valve that
never had to open. They keep their prior probability.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from estimation.eha.rig_share import DELIVERY_ENTRY
from estimation.fits.hypotheses import PRIOR_SPREADS
from estimation.notes import RigCode
from faults.conditions import CONDITIONS
from faults.notes import ClassCode
from plant.arrays import Array
from plant.notes import Note

LEAST_REPORTED = 0.01
"""Probability of a fault from which it is reported beside its name [probability]."""

LOWEST = 0.1
"""Lowest setting of a faulty relief valve over the rig file's [fraction]: no piston slides below."""

DELIVERIES = (0.7, 0.75, 0.8, 0.85, 0.9)
"""Deliveries of worn pumps over their displacement [dimensionless]. In a log of 10 s, a pump of 0.85 is likelier than a
sound one by 50 of log-likelihood; its neighbours at 0.8 and 0.9 are no likelier than a sound one."""

DELIVERY_LOG_PRIOR = math.log(0.5)
"""Prior log-probability of one of them, beside that of wear [dimensionless]: each stands for 5 % of the displacement, a
sound pump for 10 %."""

WELL_WORN_DELIVERY = 0.8
"""Delivery up to which a pump is worn whatever the accuracy of the rig file's displacement [dimensionless]: an entry
may be off by 5 %, and the prior of wear has a deviation of 15 %."""

STUCK_VALVE_PRIOR = 1.0 / (1.0 + len(CONDITIONS))
"""Probability that a make-up valve which never opens in a log is stuck shut [probability]: as likely as each of the
nine conditions before a log is seen."""

SAME_CONDITION = 0.5
"""Probability of a condition, given a fault, from which it is the same as without the fault [probability]."""


class OpenFault(NamedTuple):
    """A fault that a log does not exclude.

    Parameters
    ----------
    name : str
        Its name.
    chance : float
        Its probability [probability].
    scores : ndarray, shape (9,)
        How well each condition fits the log given the fault: log-likelihoods [dimensionless].
    """

    name: str
    chance: float
    scores: Array


def hidden_relief_log_prior(pressure: float, setting: float) -> float:
    """Return the prior log-probability that a low relief valve never opens in a log.

    Parameters
    ----------
    pressure : float
        Largest pressure in the log [Pa].
    setting : float
        Setting of a sound relief valve [Pa].

    Returns
    -------
    float
        Logarithm of the share of low settings, uniform in their logarithm, that are above that pressure
        [dimensionless].

    Examples
    --------
    >>> hidden_relief_log_prior(3.4e5, 3.4e6), hidden_relief_log_prior(3.4e6, 3.4e6)
    (0.0, -inf)
    """
    if not 0.0 < pressure < setting:
        return -math.inf
    return math.log(min(math.log(setting / pressure) / -math.log(LOWEST), 1.0))


def odds_of_wear(scores: Sequence[float], sound: float) -> float:
    """Return the odds of a well worn pump against a sound one, with the prior of wear.

    The prior is that of `faults.diagnosis.beyond_nine.wear.summed_over_wear`.

    Parameters
    ----------
    scores : sequence of float
        How well pumps with each of `DELIVERIES` explain a log [dimensionless].
    sound : float
        The same for a sound pump [dimensionless].

    Returns
    -------
    float
        Logarithm of the ratio of pumps that deliver at most `WELL_WORN_DELIVERY` to sound ones [dimensionless].

    Examples
    --------
    >>> odds_of_wear([-9.0, -9.0, 0.0, 9.0, 9.0], 0.0) < 0.0 < odds_of_wear([-9.0, 0.0, 2.0, 0.0, 0.0], 0.0)
    True
    """
    well = np.array(DELIVERIES) <= WELL_WORN_DELIVERY
    return float(np.logaddexp.reduce((np.array(scores) - sound + delivery_log_priors(DELIVERIES))[well]))


def delivery_log_priors(shares: Sequence[float]) -> Array:
    """Return the prior log-probabilities of pump deliveries.

    Parameters
    ----------
    shares : sequence of float
        Deliveries over displacement [dimensionless].

    Returns
    -------
    ndarray, shape (n,)
        Half a normal distribution of the logarithm of deviation `PRIOR_SPREADS`, with `DELIVERY_LOG_PRIOR`; 0 for a
        sound pump [dimensionless].
    """
    delivered = np.asarray(shares, dtype=np.float64)
    return -0.5 * (np.log(delivered) / PRIOR_SPREADS[DELIVERY_ENTRY]) ** 2 + np.where(
        delivered < 1.0, DELIVERY_LOG_PRIOR, 0.0
    )


def fault_probabilities(odds: Mapping[str, float]) -> dict[str, float]:
    """Return the probability of each of several faults, of which at most one is present.

    Parameters
    ----------
    odds : Mapping[str, float]
        Log-odds of each against no fault, by name [dimensionless].

    Returns
    -------
    dict[str, float]
        Probability by name [probability]; the remainder is that of no fault.

    Examples
    --------
    >>> {name: round(chance, 2) for name, chance in fault_probabilities({"one": 0.0, "other": 0.0}).items()}
    {'one': 0.33, 'other': 0.33}
    >>> fault_probabilities({"one": -math.inf})
    {'one': 0.0}
    """
    together = np.logaddexp.reduce([0.0, *odds.values()])
    return {name: math.exp(one - together) for name, one in odds.items()}


def not_excluded_notes(faults: Sequence[OpenFault], sound: Array) -> tuple[Note, ...]:
    """Return a note that names the faults that a log does not exclude, and the condition given each of them.

    Parameters
    ----------
    faults : sequence of OpenFault
        The faults.
    sound : ndarray, shape (9,)
        How well each condition fits the log without a fault: log-likelihoods [dimensionless].

    Returns
    -------
    tuple of Note
        One at most.
    """
    if not faults:
        return ()
    named = [f"{one.name} ({100.0 * one.chance:.0f} %)" if one.chance > LEAST_REPORTED else one.name for one in faults]
    names, likeliest = list(CONDITIONS), int(np.argmax(sound))
    moved = [one for one in faults if one.chance > LEAST_REPORTED and _share(one.scores, likeliest) < SAME_CONDITION]
    others = {one.name: names[int(np.argmax(one.scores))] for one in moved}
    beside = ", and ".join(f"with {name} it would be {_in_words(one)}" for name, one in others.items())
    condition = f"the condition would be the same, but {beside}" if beside else "the condition would be the same"
    return (ClassCode.NOT_EXCLUDED.note(faults=", ".join(named), condition=condition),)


def with_unseen_valve(
    probabilities: Mapping[str, float], not_told: Sequence[Note]
) -> tuple[Mapping[str, float], tuple[Note, ...]]:
    """Return the classes of a log in which a make-up valve never opened: if it is stuck shut, none of the nine holds.

    A stuck valve then has the likelihood of a sound one, and keeps its prior probability.

    Parameters
    ----------
    probabilities : Mapping[str, float]
        Probability of each condition with a sound valve [probability].
    not_told : sequence of Note
        What the log does not determine.

    Returns
    -------
    Mapping[str, float]
        They sum to the probability that the valve is sound [probability].
    tuple of Note
        What they lack; none where both valves opened.
    """
    if not probabilities or all(note.code is not RigCode.MAKEUP_UNSEEN for note in not_told):
        return probabilities, ()
    left = {name: (1.0 - STUCK_VALVE_PRIOR) * share for name, share in probabilities.items()}
    return left, (ClassCode.STUCK_NOT_TOLD.note(percent=100.0 * STUCK_VALVE_PRIOR * sum(probabilities.values())),)


def likelier_fault_notes(probabilities: Mapping[str, float], not_told: Sequence[Note]) -> tuple[Note, ...]:
    """Return the notes on faults that a log does not exclude, if these are likelier than each of the nine.

    They are then a reason against all nine: a verdict would name something less likely.

    Parameters
    ----------
    probabilities : Mapping[str, float]
        Probability of each condition; the remainder to 1 is that of such faults [probability].
    not_told : sequence of Note
        What the log does not determine.
    """
    if not probabilities or 1.0 - sum(probabilities.values()) <= max(probabilities.values()):
        return ()
    return tuple(note for note in not_told if note.code in (ClassCode.WEAR_NOT_TOLD, ClassCode.NOT_EXCLUDED))


def _share(scores: Array, place: int) -> float:
    return float(np.exp(scores[place] - np.logaddexp.reduce(scores)))


def _in_words(condition: str) -> str:
    return condition.replace("leakage_", "leakage and ").replace("_", " ")
