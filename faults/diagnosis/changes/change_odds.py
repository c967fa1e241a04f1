"""Odds of a change of condition: two conditions, one before and one after, against one throughout.

Two circuits always explain more than one: they may differ within a condition, the time of the change is chosen, and so
are the conditions. All three are priced. The remainder is the logarithm of a Bayes factor, with priors (Kass and
Raftery 1995, Journal of the American Statistical Association 90, equation 1).
"""

import math
from collections.abc import Sequence

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import CONDITION_SPREAD, LASTING
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes
from faults.diagnosis.circuits.model_doubt import information_divisor
from faults.diagnosis.circuits.region_scores import region_scores
from faults.diagnosis.circuits.rivals import log_likelihood_behind

CHANGE_PRIOR = 0.05
"""Prior share of logs in which the condition changes [fraction]."""


BELIEVED_ODDS = 10.0
"""How many times likelier than none a change must be to be believed [dimensionless]: evidence is called strong above
that (Jeffreys, Theory of Probability, 1961, appendix B). In plain logs without a change the ratio is at most a
thirtieth, and in those with one at least 36."""


def is_change_believed(
    blocks: Blocks, parts: Sequence[Blocks], fits: Sequence[ClassFits], whole: ClassFits, actuator: Actuator
) -> bool:
    """Return whether a change of condition is so much likelier than none that it is believed.

    A search may end too early: one circuit for all is searched again from the ends of the parts.

    Parameters
    ----------
    parts : sequence of Blocks
        The log before the change, and after it.
    fits : sequence of ClassFits
        Circuits fitted to each.
    whole : ClassFits
        Circuits fitted to all.

    Returns
    -------
    bool
        Whether it is `BELIEVED_ODDS` times as likely.
    """
    again = [fit_classes(blocks, actuator, start=one.best.coordinates) for one in fits]
    gains = [gain_of_parts(one, parts, fits) for one in (whole, *again)]
    least = int(np.argmin(gains))
    odds = odds_of_change(gains[least], fits, (whole, *again)[least], blocks, actuator)
    return odds > math.log(BELIEVED_ODDS)


def gain_of_parts(whole: ClassFits, parts: Sequence[Blocks], fits: Sequence[ClassFits]) -> float:
    """Return the gain of two circuits, one for each part, over one circuit for all.

    Each part is compared separately: noise or a model's error that changes with the motion is no other condition.

    Parameters
    ----------
    whole : ClassFits
        Circuits fitted to all.
    parts : sequence of Blocks
        The log before the change, and after it.
    fits : sequence of ClassFits
        Circuits fitted to each.

    Returns
    -------
    float
        Log-likelihood, in `LASTING` blocks that count as one [dimensionless].
    """
    return sum(
        float(log_likelihood_behind([whole.best], one.best, part)[0]) for part, one in zip(parts, fits, strict=True)
    )


def odds_of_change(
    gain: float, parts: Sequence[ClassFits], whole: ClassFits, blocks: Blocks, actuator: Actuator
) -> float:
    """Return the odds of a change of condition against none.

    Without a change, one circuit holds throughout, or it moves within its condition; after a change, all nine
    conditions are equally likely. Likelihoods count in `LASTING` blocks, as the gain does, and there are as many
    possible times of a change. The flow links velocity and pressure, so a wrong model errs in both at once: they count
    as one look. With pressure all three circuits have the credibility of the least credible one: otherwise a part that
    is followed to its noise would be priced by up to 101 times the information, while its gain counts no more. The
    condition of a circuit is found as a class is.

    Parameters
    ----------
    gain : float
        Log-likelihood that both circuits gain over one [dimensionless].
    parts : sequence of ClassFits
        Circuits fitted to the log before the change, and after it.
    whole : ClassFits
        Circuits fitted to all.

    Returns
    -------
    float
        Logarithm of the ratio of posterior probabilities [dimensionless].
    """
    times = max(len(blocks.velocity) / LASTING, 1.0)
    outputs = len(whole.best.scales)
    pressure = blocks.pressure is not None
    doubts = [information_divisor(one.best, blocks) if pressure else 1.0 for one in (*parts, whole)]
    shares = [
        _region_share(one, outputs * max(doubts) / doubt, actuator)
        for one, doubt in zip((*parts, whole), doubts, strict=True)
    ]
    to_one = (
        gain / outputs
        + sum(shares[:-1])
        - shares[-1]
        - math.log(len(CONDITIONS) * times)
        + math.log(CHANGE_PRIOR / (1.0 - CHANGE_PRIOR))
    )
    before, after = (one.one_law_scores for one in parts)
    to_drift = float(np.max(before) + np.max(after) - np.max(before + after))
    return -float(np.logaddexp(-to_one, -to_drift))


def _region_share(fits: ClassFits, less: float, actuator: Actuator) -> float:
    """Return the logarithm of the share of its condition's region that a log leaves to a circuit, by its density."""
    told = fits.information / (LASTING * less)
    volume = 0.5 * float(np.linalg.slogdet(np.eye(len(CONDITION_SPREAD)) + CONDITION_SPREAD @ told)[1])
    return float(np.max(region_scores(fits.best, told, actuator))) - volume
