"""Odds of a change of condition: two conditions, one before and one after, against one throughout.

Two circuits always explain more than one: they may differ within a condition, the time of the change is chosen, and so
are the conditions. All three are priced, and what is left is the logarithm of a Bayes factor, with what is presumed
(Kass and Raftery 1995, Journal of the American Statistical Association 90, equation 1).
"""

import math
from collections.abc import Sequence

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import LASTING, WITHIN
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes
from faults.diagnosis.circuits.model_doubt import distrust
from faults.diagnosis.circuits.region_scores import region_scores
from faults.diagnosis.circuits.rivals import behind

CHANGES = 0.05
"""Share of logs in which the condition changes, presumed [fraction]."""


LIKELIER = 10.0
"""How many times likelier than none a change must be to be believed [dimensionless]: evidence is called strong from
there on (Jeffreys, Theory of Probability, 1961, appendix B). Beside one circuit throughout, plain logs without a change
come to a thirtieth at most, and those with one to 36 at least."""


def believed(
    blocks: Blocks, parts: Sequence[Blocks], fits: Sequence[ClassFits], whole: ClassFits, actuator: Actuator
) -> bool:
    """Return whether a change of condition is so much likelier than none that it is believed.

    A search may end short of the best: one circuit for all is asked again from where those of the parts ended.

    Parameters
    ----------
    blocks : Blocks
        The log.
    parts : sequence of Blocks
        What is before the change, and after it.
    fits : sequence of ClassFits
        Circuits fitted to each.
    whole : ClassFits
        Circuits fitted to all.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    bool
        Whether it is `LIKELIER` times as likely.
    """
    again = [fit_classes(blocks, actuator, start=one.best.coordinates) for one in fits]
    gains = [gain_of(one, parts, fits) for one in (whole, *again)]
    least = int(np.argmin(gains))
    odds = odds_of_change(gains[least], fits, (whole, *again)[least], blocks, actuator)
    return odds > math.log(LIKELIER)


def gain_of(whole: ClassFits, parts: Sequence[Blocks], fits: Sequence[ClassFits]) -> float:
    """Return the gain of two circuits, one for each part, over one circuit for all.

    Each part is compared by itself: noise or a model's error that changes with the motion is no other condition.

    Parameters
    ----------
    whole : ClassFits
        Circuits fitted to all.
    parts : sequence of Blocks
        What is before the change, and after it.
    fits : sequence of ClassFits
        Circuits fitted to each.

    Returns
    -------
    float
        Log-likelihood, in `LASTING` blocks that count as one [dimensionless].
    """
    return sum(float(behind([whole.best], one.best, part)[0]) for part, one in zip(parts, fits, strict=True))


def odds_of_change(
    gain: float, parts: Sequence[ClassFits], whole: ClassFits, blocks: Blocks, actuator: Actuator
) -> float:
    """Return the odds of a change of condition against none.

    Without one, one circuit is there from end to end, or it goes elsewhere within its condition: after a change the
    circuit is in any of the nine conditions alike. Likelihoods count in `LASTING` blocks, as the gain does, and there
    are as many times at which a log may change. Velocity and pressure are tied by the flow, so that a wrong model errs
    in both at once: they count as one look. With pressure all three circuits are believed as the least believed one:
    else a part that is followed to its noise is priced by up to 101 times the information, while its gain counts no
    more. Which condition a circuit is in is told as a class is.

    Parameters
    ----------
    gain : float
        Log-likelihood that both circuits gain on one [dimensionless].
    parts : sequence of ClassFits
        Circuits fitted to what is before the change, and after it.
    whole : ClassFits
        Circuits fitted to all.
    blocks : Blocks
        The log.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    float
        Logarithm of the ratio of posterior probabilities [dimensionless].
    """
    times = max(len(blocks.velocity) / LASTING, 1.0)
    outputs = len(whole.best.scales)
    pressure = blocks.pressure is not None
    doubts = [distrust(one.best, blocks) if pressure else 1.0 for one in (*parts, whole)]
    shares = [
        _share(one, outputs * max(doubts) / doubt, actuator) for one, doubt in zip((*parts, whole), doubts, strict=True)
    ]
    to_one = (
        gain / outputs
        + sum(shares[:-1])
        - shares[-1]
        - math.log(len(CONDITIONS) * times)
        + math.log(CHANGES / (1.0 - CHANGES))
    )
    before, after = (one.of_one_law for one in parts)
    to_drift = float(np.max(before) + np.max(after) - np.max(before + after))
    return -float(np.logaddexp(-to_one, -to_drift))


def _share(fits: ClassFits, less: float, actuator: Actuator) -> float:
    """Return the logarithm of the share of its condition's region that a log leaves to a circuit, by its density."""
    told = fits.information / (LASTING * less)
    volume = 0.5 * float(np.linalg.slogdet(np.eye(len(WITHIN)) + WITHIN @ told)[1])
    return float(np.max(region_scores(fits.best, told, actuator))) - volume
