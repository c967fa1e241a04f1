"""Common mistakes that a search by slopes leaves out: another pump delivery behind leaks, a zero behind an offset."""

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
"""Share of the largest gain that slopes promise, from which another delivery is followed to its end where nothing
explains a log alone [fraction]; judged. An area 5 % low promised more as a leakage that changes, in four ways, and came
nearest as a relief valve that opens early."""

BESIDE_OTHERS = 20.0
"""Gain in log-likelihood that slopes promise another delivery beside an explanation, from which both are sought
together [dimensionless]; judged, twice what a hypothesis must gain. A pump of 90 % beside a pressure 3.7 ms late
promised 27, and bulk modulus was 11 % too low."""


def delivery_followed(
    log: GreyBoxLog, finished: Sequence[Trial], gains: Mapping[str, float], spared: Decimation, accepted: Accepted
) -> list[Trial]:
    """Return the end of a search for another pump delivery, where slopes promise it nearly as much as any.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    finished : sequence of Trial
        What was tried alone, the best first.
    gains : Mapping[str, float]
        What slopes promise each hypothesis [dimensionless].
    spared : Decimation
        Samples and starts of the search.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.

    Returns
    -------
    list of Trial
        None where it has been followed already, or something explains the log.
    """
    promises = DELIVERY.name in gains and gains[DELIVERY.name] >= AS_WELL * max(gains.values())
    followed = any(one.together == (DELIVERY,) and one.fits for one in finished)
    if not promises or followed or is_explained(finished[0], accepted):
        return []
    return _sought(log, (DELIVERY,), spared)


def with_zero(log: GreyBoxLog, first: Trial, spared: Decimation, accepted: Accepted) -> list[Trial]:
    """Return what is likeliest alone together with an encoder's zero, of a log that shows one, if both explain it.

    Both are sought from where the first one was: alone it has taken up part of the zero. An offset of the pressure was
    found a third too large, and no zero beside it.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    first : Trial
        What is likeliest alone.
    spared : Decimation
        Samples and starts of the search.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.
    """
    if ENCODER_ZERO in first.together or is_explained(first, accepted):
        return []
    return _sought(log, (*first.together, ENCODER_ZERO), spared, accepted, first.delays)


def rig_and_load(log: GreyBoxLog, load: Hypothesis, best: Trial, spared: Decimation, accepted: Accepted) -> list[Trial]:
    """Return a load at the start of a log together with a pump and chambers that the rig file has wrong.

    A load is no error of a rig file, so two errors may come beside it. Searched one after the other, each takes up what
    belongs to the others. They are sought only where no two explain the log, and to their end, whatever two leave.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    load : Hypothesis
        That at the start of this log.
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
    """Return what explains a log together with another pump delivery, where slopes promise that it gains.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    best : Trial
        What explains the log, fitted to the end.
    spared : Decimation
        Samples and starts of the search.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.

    Returns
    -------
    list of Trial
        Delays beside those of the explanation; none where nothing explains the log.
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
    """Return the ends of a search for hypotheses together, the best first; if asked, of those that explain the log."""
    late = delayed(log, delays)
    tried = [*screen(late, together, starts or spared.starts, every=spared.every)]
    ended = [replace(one, delays={**delays, **one.delays}) for one in likeliest(late, [tried], spared=spared)]
    return [one for one in ended if accepted is None or is_explained(one, accepted)]
