"""Common errors that slopes underrate: another pump delivery behind leaks, an encoder zero behind a pressure offset."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import DELIVERY, ENCODER_ZERO, LEAST_DELIVERY, VOLUME, Hypothesis
from estimation.fits.hypothesis_search.conclusion import Accepted, delivery_beside, is_explained
from estimation.fits.hypothesis_search.decimation import Decimation
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.ranking import likeliest_sets
from estimation.fits.hypothesis_search.screening import screen
from estimation.fits.hypothesis_search.wide_log import without_delays

DELIVERY_GAIN = 20.0
"""Predicted gain in log-likelihood of another delivery beside an explanation, from which both are searched together
[dimensionless]; judged, twice what a hypothesis must gain. With a pump of 90 % and a pressure 3.7 ms late, slopes
promised 27, and bulk modulus was 11 % too low."""


def fit_of_delivery(log: GreyBoxLog, finished: Sequence[Trial], spared: Decimation, accepted: Accepted) -> list[Trial]:
    """Return the final fit of another pump delivery, if no single hypothesis explains the log.

    A worn pump biases leakage, bulk modulus and valves of the plain form together. The slopes there do not show it, and
    after a few steps its cost is still above that of air or late valves, which do not explain the log either.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    finished : sequence of Trial
        Single hypotheses, the best first.
    spared : Decimation
        Samples and starts of the search.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.

    Returns
    -------
    list of Trial
        Empty if this fit exists already, or if a hypothesis explains the log. The search stops early if its cost stays
        far above the best.
    """
    followed = any(one.together == (DELIVERY,) and one.fits for one in finished)
    if followed or is_explained(finished[0], accepted):
        return []
    return _joint_search(log, (DELIVERY,), spared, known=finished[0].cost)


def with_zero(log: GreyBoxLog, first: Trial, spared: Decimation, accepted: Accepted) -> list[Trial]:
    """Return the likeliest hypothesis together with an encoder zero, if the log suggests one and both explain it.

    Both are searched from the first one's start: alone it has absorbed part of the zero. A pressure offset was found a
    third too large, and then no zero beside it.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    first : Trial
        The likeliest hypothesis alone.
    spared : Decimation
        Samples and starts of the search.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.
    """
    if ENCODER_ZERO in first.together or is_explained(first, accepted):
        return []
    return _joint_search(log, (*first.together, ENCODER_ZERO), spared, accepted, first.delays)


def rig_and_load(log: GreyBoxLog, load: Hypothesis, best: Trial, spared: Decimation, accepted: Accepted) -> list[Trial]:
    """Return a load at the start of a log together with a pump and chambers that the rig file states wrongly.

    A load is not an error of a rig file, so two errors may come beside it. Searched one after the other, each absorbs
    what belongs to the others. The three are searched only if no pair explains the log, and always to their end.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    load : Hypothesis
        The load hypothesis that fits the start of this log.
    best : Trial
        The likeliest so far, alone or in a pair.
    spared : Decimation
        Samples and starts of the search.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.
    """
    if is_explained(best, accepted):
        return []
    return _joint_search(log, (DELIVERY, VOLUME, load), spared, accepted)


def with_delivery(log: GreyBoxLog, best: Trial, spared: Decimation, accepted: Accepted) -> list[Trial]:
    """Return the explanation of a log together with another pump delivery, if slopes promise a gain.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    best : Trial
        The explanation, fitted to the end.
    spared : Decimation
        Samples and starts of the search.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.

    Returns
    -------
    list of Trial
        Delays are relative to those of the explanation; empty if nothing explains the log.
    """
    if DELIVERY in best.together or not is_explained(best, accepted):
        return []
    promised = delivery_beside(log, best)
    if promised.gain < DELIVERY_GAIN or abs(promised.size) < LEAST_DELIVERY:
        return []
    return _joint_search(log, (*best.together, DELIVERY), spared, accepted, best.delays, [best.coarse or best.values])


def _joint_search(
    log: GreyBoxLog,
    together: tuple[Hypothesis, ...],
    spared: Decimation,
    accepted: Accepted | None = None,
    delays: Mapping[str, float] = MappingProxyType({}),
    starts: Sequence[Mapping[str, float]] = (),
    known: float = np.inf,
) -> list[Trial]:
    """Return the ends of a search for hypotheses together, best first; on request only those that explain the log."""
    late = without_delays(log, delays)
    tried = [*screen(late, together, starts or spared.starts, every=spared.every)]
    ended = [replace(one, delays={**delays, **one.delays}) for one in likeliest_sets(late, [tried], known, spared)]
    return [one for one in ended if accepted is None or is_explained(one, accepted)]
