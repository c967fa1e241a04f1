"""`toothed(log, fitted)`: fits of a log, with a pump's teeth taken up in its speed where the log asks for them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from estimation.finding import NORMAL_95
from estimation.fits.greybox_fit import GreyBoxFit
from estimation.fits.greybox_log import GreyBoxLog
from estimation.fits.teeth import COUNTS, ShownTeeth, Teeth, with_teeth
from estimation.notes import EstimateCode, RigCode
from plant.notes import Note

TEETH_WORTH = 10.0
"""Gain in log-likelihood from which a log is asked for a pump's teeth [dimensionless]: by chance the likeliest of all
counts gains it in one log of 1500. Of 60 training logs without teeth none gains 6."""

LEAST_TEETH = 0.03
"""Amplitude from which teeth are taken up, as a share of the flow [fraction]; judged. With less they put bulk modulus
off by less than noise does."""

MOST_TEETH = 0.4
"""Amplitude up to which teeth are believed, as a share of the flow [fraction]; judged: a pump's flow does not pulse so.
Where speed is logged with an offset, teeth seem to wander, and another count took up 59 %."""

STANDS_OUT, BY_CHANCE = 4.0, 5.0
"""How many times as much as any other count the teeth must gain, less what another one gains by chance [dimensionless]:
what a fit leaves for other reasons shows in several counts. On 184 training logs of 34 kinds what stands
out so is the count that is there, 13 times."""

OVERTONE_WORTH = 5.0
"""Gain from which twice their count is taken up with them [dimensionless]: by chance one log in 150 gains it."""

ROUNDS = 4
"""How often teeth are corrected at most [count]."""

SETTLED = 0.5
"""Gain in log-likelihood that is left where a correction matters no more: a deviation [dimensionless]."""


class Toothed(NamedTuple):
    """Fits of a log.

    Parameters
    ----------
    log : GreyBoxLog
        The log, its speed with the teeth that were taken up.
    fits : sequence of GreyBoxFit
        By every form that counts.
    remarks : tuple of Note
        What was taken up.
    left : tuple of Note
        What residuals show and was not taken up: an objection to a fit that nothing else speaks against.
    """

    log: GreyBoxLog
    fits: Sequence[GreyBoxFit]
    remarks: tuple[Note, ...] = ()
    left: tuple[Note, ...] = ()


def toothed(
    log: GreyBoxLog,
    fitted: Callable[[GreyBoxLog], Sequence[GreyBoxFit]],
    explains: Callable[[GreyBoxFit], bool],
) -> Toothed:
    """Return the fits of a log, with the pump's teeth where the log asks for them.

    A log with gaps in its speed is not asked: the angle of its shaft is not known.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.
    fitted : callable
        ``fitted(log)``: its fits by every form that counts.
    explains : callable
        ``explains(fit)``: whether a fit explains the log. Where it does not with teeth, something else is strange that
        they would hide: a pump that delivers 4 % more looked like teeth of 19 %.

    Returns
    -------
    Toothed
        The log, its fits, and a note on teeth that were taken up.
    """
    if log.gaps.size:
        return Toothed(log, fitted(log))
    plain = found = Toothed(log, fitted(replace(log, counts=COUNTS)))
    first = _asked_for(_best(plain.fits))
    taken = [first] if first else []
    for _ in range(ROUNDS):
        if not taken or not _believable(taken):
            break
        held = with_teeth(replace(log, counts=(taken[0].count, 2 * taken[0].count)), taken)
        fits = fitted(held)
        left = _best(fits).teeth
        if any(one.count not in left for one in taken):
            break
        found = Toothed(held, fits, (_told(taken[0], left[taken[0].count].std),))
        taken = _corrected(taken, left)
    best = _best(found.fits)
    if _believable(taken) and best.cost < _best(plain.fits).cost - TEETH_WORTH and explains(best):
        return found
    return plain._replace(left=_left(_best(plain.fits)))


def _believable(teeth: Sequence[Teeth]) -> bool:
    return all(one.amplitude < MOST_TEETH for one in teeth)


def _best(fits: Sequence[GreyBoxFit]) -> GreyBoxFit:
    return min(fits, key=lambda fit: fit.cost)


def _shown(fit: GreyBoxFit) -> list[ShownTeeth]:
    """Return the teeth that a fit's residuals show, the likeliest first; none if its size does not matter."""
    ranked = sorted(fit.teeth.values(), key=lambda one: -one.gain)
    matters = ranked and ranked[0].gain > TEETH_WORTH and ranked[0].teeth.amplitude > LEAST_TEETH
    return ranked if matters else []


def _asked_for(fit: GreyBoxFit) -> Teeth | None:
    """Return the teeth that a fit's residuals ask for, if no other count does as well but their overtones."""
    if not (ranked := _shown(fit)):
        return None
    count = ranked[0].teeth.count
    apart = [one for one in ranked[1:] if one.teeth.count % count and count % one.teeth.count]
    other = max((one.gain - BY_CHANCE for one in apart), default=0.0)
    return ranked[0].teeth if ranked[0].gain > TEETH_WORTH + STANDS_OUT * max(other, 0.0) else None


def _left(fit: GreyBoxFit) -> tuple[Note, ...]:
    shown = [one.teeth for one in _shown(fit)[:1]]
    return tuple(EstimateCode.TEETH_LEFT.note(percent=100.0 * one.amplitude, teeth=one.count) for one in shown)


def _corrected(taken: Sequence[Teeth], left: Mapping[int, ShownTeeth]) -> list[Teeth]:
    """Return the teeth with what residuals still ask for; none where that matters no more."""
    held = {one.count for one in taken}
    new = [one.teeth for one in left.values() if one.teeth.count not in held and one.gain > OVERTONE_WORTH]
    if not new and all(left[count].gain < SETTLED for count in held):
        return []
    known = [
        Teeth(one.count, one.cosine + left[one.count].teeth.cosine, one.sine + left[one.count].teeth.sine)
        for one in taken
    ]
    return [*known, *new]


def _told(teeth: Teeth, std: float) -> Note:
    return RigCode.PUMP_RIPPLES.note(
        percent=100.0 * teeth.amplitude, half_width=100.0 * NORMAL_95 * std, teeth=teeth.count
    )
