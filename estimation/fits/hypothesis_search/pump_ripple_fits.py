"""`with_pump_ripple(log, fitted)`: fits of a log with the pump's flow ripple in its speed, if residuals show one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from estimation.finding import NORMAL_95
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.pump_ripple import LEAST_TEETH, MOST_OFFSET, TOOTH_COUNTS, Ripple, ShownRipple, with_ripple
from estimation.notes import EstimateCode, RigCode
from plant.notes import Note

TEETH_WORTH = 10.0
"""Gain in log-likelihood from which pump ripple is fitted [dimensionless]: by chance one log in 1500 gains it with the
best of all tooth counts. In 60 training logs without ripple no gain is above 6."""

OFFSET_WORTH = 20.0
"""Gain in log-likelihood from which an offset of speed is subtracted before ripple is searched for [dimensionless]."""

OFFSET_SETTLED = 2.0
"""Gain from which a subtracted offset is corrected again [dimensionless]: two deviations."""

KEPT_GAIN = 0.5
"""Share of its predicted gain that an offset of speed must reach [fraction]: residuals respond linearly, so a real one
reaches 0.8 or more."""

SURE_SHARE = 0.3
"""Share of the rejection limit that a fit with an offset of speed and no ripple may reach [fraction]; judged. A single
rod looks like an offset: a log passed with one, with bulk modulus 39 % too low and a variance 12 % above the noise. In
160 plain training logs it is at most 6 %."""

CHANCE = 3.0
"""Standard deviations of the mean of squared noise that do not count as a misfit [dimensionless]: they matter in short
logs."""

CONTRADICTING_DEVIATIONS = 4.0
"""Deviations between the offset of speed from the flow and that from ripple, above which they contradict each other
[dimensionless]."""

LEAST_OFFSET = 0.01
"""Offset of speed from which it is reported [rad/s]; judged: encoders drift by a tenth of a revolution per minute."""

MOST_LINEAR = 0.5
"""Deviations by which small ripple may move bulk modulus before it is corrected too [dimensionless]: in one log the
first-order prediction was 0.06 %, and the actual change zero."""

ONE_SIDED_95 = 1.645
"""Deviations by which uncorrected ripple must exceed small ripple [dimensionless]. Sound pumps have ripple up to that
limit, and in one of 400 plain logs of pumps with 0 to 3 %, noise alone moved a ripple of 2 % above 3 %."""

SURELY_WORTH = 15.0
"""Gain in log-likelihood from which large ripple is reported although it does not move bulk modulus [dimensionless]: by
chance one log in 220,000 has it. A sound log was refused for a ripple of 5 % that gained 11 and moved bulk modulus by
0.02 deviations."""

MOST_TEETH = 0.4
"""Largest believed amplitude of ripple, over the mean flow [fraction]; judged: no pump pulsates more. With an offset in
the logged speed the phase of the ripple drifts, and another tooth count absorbed 59 %."""

STANDS_OUT, BY_CHANCE = 4.0, 5.0
"""Factor by which the ripple's gain must exceed that of any other tooth count, and the gain by chance that is
subtracted from the other's [dimensionless]: a misfit of another origin shows in several counts. The other's gain is
counted beside the ripple, since ripple at constant speed with an offset of speed looks like another count. In 184
training logs of 34 kinds all 13 counts found in this way are right."""

OVERTONE_WORTH = 5.0
"""Gain from which the double tooth count is fitted as well [dimensionless]: by chance one log in 150 gains it."""

MOST_GAIN_RATIO = 10.0
"""Largest factor by which the actual gain of ripple or speed offset may exceed the predicted one, if the log is not
explained without them [dimensionless]; judged: residuals respond almost linearly to both."""

ROUNDS = 4
"""Most corrections of the ripple [count]."""

SETTLED = 0.5
"""Remaining gain in log-likelihood at which no further correction is made [dimensionless]: one deviation."""


class RippleFits(NamedTuple):
    """Fits of a log, with the pump ripple that they include.

    Parameters
    ----------
    log : GreyBoxLog
        The log; its speed includes the ripple found, and not its offset.
    fits : sequence of GreyBoxFit
        One fit by each form that counts.
    remarks : tuple of Note
        Notes on what was corrected.
    left : tuple of Note
        Notes on what residuals show and was not corrected: an objection to a fit without other objections.
    """

    log: GreyBoxLog
    fits: Sequence[GreyBoxFit]
    remarks: tuple[Note, ...] = ()
    left: tuple[Note, ...] = ()

    @property
    def best(self) -> GreyBoxFit:
        """The likeliest fit."""
        return min(self.fits, key=lambda fit: fit.cost)


Fitted = Callable[[GreyBoxLog], Sequence[GreyBoxFit]]


def with_pump_ripple(
    log: GreyBoxLog,
    fitted: Fitted,
    explains: Callable[[GreyBoxFit], bool],
    largest: float = np.inf,
    offset: float = 0.0,
) -> RippleFits:
    """Return the fits of a log, with pump ripple and an offset of speed if its residuals show them.

    A log with gaps in its speed is not tested: the angle of its shaft is not known.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.
    fitted : callable
        ``fitted(log)``: its fits by every form that counts.
    explains : callable
        ``explains(fit)``: whether a fit explains the log. If a fit with ripple does not, the ripple hides another
        effect: a pump that delivers 4 % more looked like a ripple of 19 %.
    largest : float
        Mean squared normalised residual above which no fit explains a log [dimensionless].
    offset : float
        First guess of how much the logged speed exceeds the shaft's [rad/s].

    Returns
    -------
    RippleFits
        The log, its fits, and notes on what was corrected.
    """
    if log.gaps.size:
        return RippleFits(log, fitted(log))
    guessed = with_ripple(log, (), offset) if offset else log
    plain = RippleFits(guessed, fitted(with_ripple_test(guessed)))
    if not _may_be_explained(plain.fits, largest):
        return plain._replace(left=_ripple_left_note(plain))
    shifted = _fits_without_offset(log, plain, fitted, largest)
    if offset:
        plain, shifted = shifted or plain, None
        plain = plain._replace(remarks=offset_note(plain.log.speed_offset, plain.best.speed_offset.std))
    worth = plain.best.cost - TEETH_WORTH
    found = None
    for begun in (plain,) if shifted is None else (shifted, plain):
        found = _fits_with_ripple(log, begun, fitted, needed=not explains(begun.best))
        if found is not None and found.best.cost < worth and explains(found.best):
            return found
        if (
            begun is shifted
            and is_sure(begun, largest)
            and explains(begun.best)
            and begun.best.cost < plain.best.cost - OFFSET_WORTH
        ):
            offset = begun.log.speed_offset
            told = offset_note(offset, begun.best.speed_offset.std)
            return begun._replace(log=replace(begun.log, counts=()), remarks=told)
    return plain._replace(
        left=() if found is not None and _is_chance_gain(plain.best, found.best) else _ripple_left_note(plain)
    )


def is_sure(found: RippleFits, largest: float) -> bool:
    """Return whether the residuals with an offset of speed are so small that hardly any other effect can look like it.

    Parameters
    ----------
    found : RippleFits
        The fits.
    largest : float
        As in `with_pump_ripple` [dimensionless].
    """
    left, by_chance = found.best.chi_square[0], CHANCE * (2.0 / len(found.log.drives)) ** 0.5
    return left <= 1.0 + SURE_SHARE * (largest - 1.0) + by_chance


def _is_chance_gain(plain: GreyBoxFit, with_them: GreyBoxFit) -> bool:
    """Return whether a fit with ripple reached its predicted gain, and gained no more than chance does."""
    promised = max(one.gain for one in plain.teeth.values())
    return KEPT_GAIN * promised < plain.cost - with_them.cost < TEETH_WORTH


def with_ripple_test(log: GreyBoxLog) -> GreyBoxLog:
    """Return a log on which fits test for pump ripple, if it has none yet and the shaft's angle is known."""
    return log if log.teeth or log.gaps.size else replace(log, counts=TOOTH_COUNTS)


def _may_be_explained(fits: Sequence[GreyBoxFit], largest: float) -> bool:
    """Return whether pump ripple or a speed offset may explain a log that is unexplained without them."""
    for fit in fits:
        promised = max([fit.speed_offset.gain, *(one.gain for one in fit.teeth.values())])
        if fit.chi_square[0] <= largest or MOST_GAIN_RATIO * promised >= fit.cost * (1.0 - largest / fit.chi_square[0]):
            return True
    return False


def _fits_without_offset(log: GreyBoxLog, plain: RippleFits, fitted: Fitted, largest: float) -> RippleFits | None:
    """Return the fits of a log without its offset of speed; None if residuals show none, or a large one.

    The correction ends if the log is then unexplained and neither ripple nor more offset may explain the rest.
    """
    found, offset, wanted = plain, plain.log.speed_offset, OFFSET_SETTLED if plain.log.speed_offset else OFFSET_WORTH
    for _ in range(ROUNDS):
        likely = min(found.fits, key=lambda fit: fit.cost - fit.speed_offset.gain)  # each fit shows its own offset
        shown = likely.speed_offset
        if shown.gain < wanted:
            break
        offset, wanted = offset + shown.value, OFFSET_SETTLED
        if abs(offset - plain.log.speed_offset) > MOST_OFFSET + abs(plain.log.speed_offset):
            return None
        held = with_ripple(replace(log, counts=TOOTH_COUNTS), (), offset)
        found = RippleFits(held, fitted(held))
        if shown.gain > OFFSET_WORTH and found.best.cost > likely.cost - KEPT_GAIN * shown.gain:
            return None
        if not _may_be_explained(found.fits, largest + CHANCE * (2.0 / len(log.drives)) ** 0.5):
            return None
    return None if found is plain else found


def _fits_with_ripple(log: GreyBoxLog, begun: RippleFits, fitted: Fitted, *, needed: bool) -> RippleFits | None:
    """Return fits with the ripple that other fits show, corrected until nothing is left; None if there is none."""
    if (first := _ripple_to_fit(begun.best, needed=needed)) is None:
        return None
    found, taken, offset = None, [first.teeth], begun.log.speed_offset + first.offset
    for _ in range(ROUNDS):
        count = taken[0].count
        if abs(offset - begun.log.speed_offset) > MOST_OFFSET or any(one.amplitude >= MOST_TEETH for one in taken):
            return None
        tried = with_ripple(replace(log, counts=(count, 2 * count)), taken, offset)
        held = RippleFits(tried, fitted(tried))
        left = held.best.teeth
        worse = found is None and held.best.cost > begun.best.cost
        if worse or any(one.count not in left for one in taken):
            return found
        if found is not None and held.best.cost > found.best.cost:  # the overtone does not help
            break
        found = held._replace(remarks=_ripple_notes(taken[0], offset, left[count]))
        new = _corrected_ripple(taken, left)
        if not new:
            break
        taken, offset = new, offset + (left[count].offset if offset != 0.0 else 0.0)
    return found


def _modulus_shift(fit: GreyBoxFit) -> float:
    """Return the shift of bulk modulus by a small pump ripple, in standard deviations."""
    moved, value = fit.small_teeth[0].get("bulk_modulus", 0.0), fit.values.get("bulk_modulus", 1.0)
    return abs(moved) * value / fit.std["bulk_modulus"] if moved else 0.0


def _shown_ripples(fit: GreyBoxFit, *, small: bool = False, needed: bool = False) -> list[ShownRipple]:
    """Return the teeth that a fit's residuals show, the likeliest first; none if their size does not matter.

    ``small`` ones matter where they move bulk modulus, or are ``needed`` as a log is not explained without them.
    """
    ranked = sorted((one for one in fit.teeth.values() if _is_possible(one, fit)), key=lambda one: -one.gain)
    if not ranked or ranked[0].gain < TEETH_WORTH:
        return []
    large = ranked[0].teeth.amplitude > LEAST_TEETH or ranked[0].offset != 0.0
    return ranked if large or needed or (small and _modulus_shift(fit) > MOST_LINEAR) else []


def _is_possible(one: ShownRipple, fit: GreyBoxFit) -> bool:
    """Return whether the flow shows the same offset of speed as the ripple, or the ripple is surely large.

    The pump's mean flow determines the offset whatever the ripple, so small ripple that needs another offset is chance.
    """
    differs = abs(one.offset - fit.speed_offset.value)
    told = differs > max(CONTRADICTING_DEVIATIONS * fit.speed_offset.std, KEPT_GAIN * abs(one.offset))
    return one.offset == 0.0 or not told or _surely_large(one)


def _surely_large(one: ShownRipple) -> bool:
    return one.teeth.amplitude - ONE_SIDED_95 * one.std > LEAST_TEETH


def _ripple_to_fit(fit: GreyBoxFit, *, needed: bool) -> ShownRipple | None:
    """Return the ripple that a fit's residuals show, if no other tooth count fits as well except its overtones."""
    if not (ranked := _shown_ripples(fit, small=True, needed=needed)):
        return None
    count = ranked[0].teeth.count
    apart = [one for one in ranked[1:] if one.teeth.count % count and count % one.teeth.count]
    other = max((one.beside - BY_CHANCE for one in apart), default=0.0)
    return ranked[0] if ranked[0].gain > TEETH_WORTH + STANDS_OUT * max(other, 0.0) else None


def _ripple_left_note(found: RippleFits) -> tuple[Note, ...]:
    """Return the note on ripple left in residuals; none for a slow log, in which motor speed can look like ripple.

    Ripple that may be as small as any pump's, or chance, is ignored: it is reported only if it moves bulk modulus.
    """
    likeliest = [] if found.log.course is not None else _shown_ripples(found.best)[:1]
    felt = _modulus_shift(found.best) > MOST_LINEAR
    sure = [_surely_large(one) and one.gain > SURELY_WORTH for one in likeliest]
    shown = [one.teeth for one, large in zip(likeliest, sure, strict=True) if felt or one.offset != 0.0 or large]
    return tuple(EstimateCode.TEETH_LEFT.note(percent=100.0 * one.amplitude, teeth=one.count) for one in shown)


def _corrected_ripple(taken: Sequence[Ripple], left: Mapping[int, ShownRipple]) -> list[Ripple]:
    """Return the ripple with the correction that residuals show; None if it no longer matters."""
    held = {one.count for one in taken}
    # overtones count only near the optimum, since an error of phase may look like one
    near = all(left[count].gain < OVERTONE_WORTH for count in held)
    new = [one.teeth for one in left.values() if near and one.teeth.count not in held and one.gain > OVERTONE_WORTH]
    if not new and all(left[count].gain < SETTLED for count in held):
        return []
    rest = [left[one.count].teeth for one in taken]
    return [
        *(Ripple(one.count, one.cosine + it.cosine, one.sine + it.sine) for one, it in zip(taken, rest, strict=True)),
        *new,
    ]


def _ripple_notes(teeth: Ripple, offset: float, left: ShownRipple) -> tuple[Note, ...]:
    ripples = RigCode.PUMP_RIPPLES.note(
        percent=100.0 * teeth.amplitude, half_width=100.0 * NORMAL_95 * left.std, teeth=teeth.count
    )
    return (ripples, *offset_note(offset, left.offset_std))


def offset_note(offset: float, std: float) -> tuple[Note, ...]:
    """Return the note on an offset of motor speed; none if it is too small to matter.

    Parameters
    ----------
    offset, std : float
        Offset of the logged speed from the shaft's, and its standard deviation [rad/s].
    """
    if abs(offset) < LEAST_OFFSET:
        return ()
    return (RigCode.SPEED_OFFSET.note(offset_rad_s=offset, half_width=NORMAL_95 * std),)
