"""Faults outside the nine conditions that a log without pressure does not exclude: how likely, and what they change.

Some leave no trace in motion: a relief valve that would open at a pressure that the log never reaches, a make-up valve
that never had to open. They keep what was presumed of them before the log was seen.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from estimation.eha.rig_share import DELIVERY_ENTRY
from estimation.fits.hypotheses import PRESUMED
from estimation.notes import RigCode
from faults.conditions import CONDITIONS
from faults.notes import ClassCode
from plant.arrays import Array
from plant.notes import Note

WORTH_SAYING = 0.01
"""Probability of a fault from which it is said beside its name [probability]."""

LOWEST = 0.1
"""Setting of a relief valve over the rig file's, to which it may be low [fraction]: no piston slides below."""

DELIVERIES = (0.7, 0.75, 0.8, 0.85, 0.9)
"""Shares of its displacement that a worn pump delivers [dimensionless]. In a log of 10 s, a pump of 0.85 is likelier
than a sound one by 50 of log-likelihood; its neighbours at 0.8 and 0.9 are no likelier than a sound one."""

SO_WORN = math.log(0.5)
"""Log-likelihood of one of them before a log is seen, beside what is presumed of wear [dimensionless]: each stands for
5 % of the displacement, a sound pump for 10 %."""

WELL_WORN = 0.8
"""Share up to which a pump is a worn one whatever the rig file's displacement is worth [dimensionless]: an entry may be
off by 5 %, and what is presumed of wear has a deviation of 15 %."""

UNSEEN = 1.0 / (1.0 + len(CONDITIONS))
"""Probability that a make-up valve which a log never opens is stuck shut [probability]: as likely as each of the nine,
which are alike before a log is seen."""

STAYS = 0.5
"""Probability of a condition, beside a fault, from which it is the same as without [probability]."""


class OpenFault(NamedTuple):
    """A fault that a log does not exclude.

    Parameters
    ----------
    name : str
        What it is called.
    chance : float
        How likely it is [probability].
    scores : ndarray, shape (9,)
        How well each condition holds the log beside it: log-likelihoods [dimensionless].
    """

    name: str
    chance: float
    scores: Array


def odds_of_hidden_relief(pressure: float, setting: float) -> float:
    """Return the log-likelihood, before a log is seen, that a low relief valve opens nowhere in it.

    Parameters
    ----------
    pressure : float
        Largest pressure in the log [Pa].
    setting : float
        Of a sound relief valve [Pa].

    Returns
    -------
    float
        Logarithm of the share of low settings, all alike in their logarithm, that lie above that pressure
        [dimensionless].

    Examples
    --------
    >>> odds_of_hidden_relief(3.4e5, 3.4e6), odds_of_hidden_relief(3.4e6, 3.4e6)
    (0.0, -inf)
    """
    if not 0.0 < pressure < setting:
        return -math.inf
    return math.log(min(math.log(setting / pressure) / -math.log(LOWEST), 1.0))


def odds_of_wear(scores: Sequence[float], sound: float) -> float:
    """Return the odds of a well worn pump against a sound one, with the prior of wear.

    What is presumed of wear before a log is seen is that of `faults.diagnosis.beyond_nine.wear.summed_over_wear`.

    Parameters
    ----------
    scores : sequence of float
        How well pumps that deliver each of `DELIVERIES` explain a log [dimensionless].
    sound : float
        The same of a sound pump [dimensionless].

    Returns
    -------
    float
        Logarithm of the ratio of pumps that deliver `WELL_WORN` at most to sound ones [dimensionless].

    Examples
    --------
    >>> odds_of_wear([-9.0, -9.0, 0.0, 9.0, 9.0], 0.0) < 0.0 < odds_of_wear([-9.0, 0.0, 2.0, 0.0, 0.0], 0.0)
    True
    """
    well = np.array(DELIVERIES) <= WELL_WORN
    return float(np.logaddexp.reduce((np.array(scores) - sound + presumed_of_wear(DELIVERIES))[well]))


def presumed_of_wear(shares: Sequence[float]) -> Array:
    """Return the log-likelihoods of what pumps deliver before a log is seen.

    Parameters
    ----------
    shares : sequence of float
        What they deliver over their displacement [dimensionless].

    Returns
    -------
    ndarray, shape (n,)
        Half a normal distribution of the logarithm of deviation `PRESUMED`, with `SO_WORN`; 0 for a sound pump
        [dimensionless].
    """
    delivered = np.asarray(shares, dtype=np.float64)
    return -0.5 * (np.log(delivered) / PRESUMED[DELIVERY_ENTRY]) ** 2 + np.where(delivered < 1.0, SO_WORN, 0.0)


def probabilities_of(odds: Mapping[str, float]) -> dict[str, float]:
    """Return the probability of each of several faults, of which at most one is there.

    Parameters
    ----------
    odds : Mapping[str, float]
        How much likelier each is than none: logarithms of ratios, by name [dimensionless].

    Returns
    -------
    dict[str, float]
        Probability by name [probability]; what is left is that of none.

    Examples
    --------
    >>> {name: round(chance, 2) for name, chance in probabilities_of({"one": 0.0, "other": 0.0}).items()}
    {'one': 0.33, 'other': 0.33}
    >>> probabilities_of({"one": -math.inf})
    {'one': 0.0}
    """
    together = np.logaddexp.reduce([0.0, *odds.values()])
    return {name: math.exp(one - together) for name, one in odds.items()}


def not_excluded(faults: Sequence[OpenFault], sound: Array) -> tuple[Note, ...]:
    """Return a note that names the faults that a log does not exclude, and what the condition would be beside them.

    Parameters
    ----------
    faults : sequence of OpenFault
        They.
    sound : ndarray, shape (9,)
        How well each condition holds the log without a fault: log-likelihoods [dimensionless].

    Returns
    -------
    tuple of Note
        One at most.
    """
    if not faults:
        return ()
    named = [f"{one.name} ({100.0 * one.chance:.0f} %)" if one.chance > WORTH_SAYING else one.name for one in faults]
    names, likeliest = list(CONDITIONS), int(np.argmax(sound))
    moved = [one for one in faults if one.chance > WORTH_SAYING and _share(one.scores, likeliest) < STAYS]
    others = {one.name: names[int(np.argmax(one.scores))] for one in moved}
    beside = ", and ".join(f"with {name} it would be {_in_words(one)}" for name, one in others.items())
    condition = f"the condition would be the same, but {beside}" if beside else "the condition would be the same"
    return (ClassCode.NOT_EXCLUDED.note(faults=", ".join(named), condition=condition),)


def beside_unseen_valve(
    probabilities: Mapping[str, float], not_told: Sequence[Note]
) -> tuple[Mapping[str, float], tuple[Note, ...]]:
    """Return the classes of a log in which a make-up valve never opened: that it is stuck shut is none of the nine.

    A stuck valve then has the likelihood of a sound one, and keeps what is presumed of it.

    Parameters
    ----------
    probabilities : Mapping[str, float]
        Of each condition with a sound valve [probability].
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
    left = {name: (1.0 - UNSEEN) * share for name, share in probabilities.items()}
    return left, (ClassCode.STUCK_NOT_TOLD.note(percent=100.0 * UNSEEN * sum(probabilities.values())),)


def likelier_fault(probabilities: Mapping[str, float], not_told: Sequence[Note]) -> tuple[Note, ...]:
    """Return the notes on faults that a log does not exclude, where these are likelier than each of the nine.

    They speak against all nine then: a verdict would name one of what is less likely.

    Parameters
    ----------
    probabilities : Mapping[str, float]
        Of each condition; what they lack to 1 is that of such faults [probability].
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
