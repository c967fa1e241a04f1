"""Common errors that slopes underrate: another pump delivery behind leaks, an encoder zero behind a pressure offset."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import DELIVERY, ENCODER_ZERO, LEAST_DELIVERY, VOLUME, Hypothesis
from estimation.fits.hypothesis_search.conclusion import Accepted, delivery_beside, is_explained
from estimation.fits.hypothesis_search.decimation import Decimation
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.ranking import likeliest
from estimation.fits.hypothesis_search.screening import screen
from estimation.fits.hypothesis_search.wide_log import delayed

AS_WELL = 0.5
"""Share of the largest predicted gain from which another delivery is searched to its end, if no hypothesis explains a
log alone [fraction]; judged. With an area 5 % low, slopes promised four ways of leakage that changes more than the
delivery, and a relief valve that opens early came nearest."""

BESIDE_OTHERS = 20.0
"""Predicted gain in log-likelihood of another delivery beside an explanation, from which both are searched together
[dimensionless]; judged, twice what a hypothesis must gain. With a pump of 90 % and a pressure 3.7 ms late, slopes
promised 27, and bulk modulus was 11 % too low."""


def delivery_followed(
    log: GreyBoxLog, finished: Sequence[Trial], gains: Mapping[str, float], spared: Decimation, accepted: Accepted
) -> list[Trial]:
    """Return the end of a search for another pump delivery, if slopes promise it nearly as much as any hypothesis.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    finished : sequence of Trial
        Hypotheses tried alone, the best first.
    gains : Mapping[str, float]
        Predicted gain of each hypothesis [dimensionless].
    spared : Decimation
        Samples and starts of the search.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.

    Returns
    -------
    list of Trial
        Empty if the delivery was searched already, or if a hypothesis explains the log.
    """
    promises = DELIVERY.name in gains and gains[DELIVERY.name] >= AS_WELL * max(gains.values())
    followed = any(one.together == (DELIVERY,) and one.fits for one in finished)
    if not promises or followed or is_explained(finished[0], accepted):
        return []
    return _sought(log, (DELIVERY,), spared)


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
    return _sought(log, (*first.together, ENCODER_ZERO), spared, accepted, first.delays)


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
    return _sought(log, (DELIVERY, VOLUME, load), spared, accepted)


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
    if promised.gain < BESIDE_OTHERS or abs(promised.size) < LEAST_DELIVERY:
        return []
    return _sought(log, (*best.together, DELIVERY), spared, accepted, best.delays, [best.coarse or best.values])


def _sought(
    log: GreyBoxLog,
    together: tuple[Hypothesis, ...],
    spared: Decimation,
    accepted: Accepted | None = None,
    delays: Mapping[str, float] = MappingProxyType({}),
    starts: Sequence[Mapping[str, float]] = (),
) -> list[Trial]:
    """Return the ends of a search for hypotheses together, best first; on request only those that explain the log."""
    late = delayed(log, delays)
    tried = [*screen(late, together, starts or spared.starts, every=spared.every)]
    ended = [replace(one, delays={**delays, **one.delays}) for one in likeliest(late, [tried], spared=spared)]
    return [one for one in ended if accepted is None or is_explained(one, accepted)]
