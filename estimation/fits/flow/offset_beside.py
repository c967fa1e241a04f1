"""`settled_offset(plain, strange, explained)`: the offset of motor speed, fitted again beside what explains a log.

An encoder with another zero, or a single rod, makes a plain fit find an offset of speed that does not exist. The effect
is then fitted beside that wrong offset, and is several deviations off.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from estimation.finding import NORMAL_95
from estimation.fits.flow.plain import PlainFits
from estimation.fits.greybox.pump_ripple import MOST_OFFSET, Turning, with_ripple
from estimation.fits.hypotheses import DELIVERY, Hypothesis
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.pump_ripple_fits import KEPT_GAIN, OFFSET_SETTLED, OFFSET_WORTH, offset_note
from estimation.fits.hypothesis_search.speed_offset import MOST_SHARE
from estimation.notes import RigCode


def settled_offset(
    plain: PlainFits,
    strange: Explanation | None,
    asked: Sequence[Hypothesis],
    explained: Callable[[PlainFits, Sequence[Hypothesis]], Explanation | None],
) -> tuple[PlainFits, Explanation | None]:
    """Return a log's fits and its explanation, at the offset of speed that fits beside the explanation.

    Parameters
    ----------
    plain : PlainFits
        The log's plain fits, with the offset that they found.
    strange : Explanation or None
        The effect that explains the log.
    asked : sequence of Hypothesis
        The hypotheses that were tested.
    explained : callable
        ``explained(plain, asked)``: the explanation of a log by hypotheses, None if it is not believed.

    Returns
    -------
    tuple of (PlainFits, Explanation or None)
        Unchanged if the explanation needs no other offset, or if the other offset does not gain what slopes promise.
        With the other offset, a part of the explanation may become unnecessary, or a worn pump may explain the log
        instead.
    """
    if strange is None or plain.log.gaps.size:
        return plain, strange
    shown, taken = strange.fit.speed_offset, plain.turning.offset
    if shown.gain < (OFFSET_SETTLED if taken else OFFSET_WORTH):
        return plain, strange
    offset = taken + shown.value
    if taken and abs(offset) < NORMAL_95 * shown.std:
        offset = 0.0
    # an offset of pressure looks like one of speed; `speed_offset_instead` distinguishes a large one
    alike = "pressure_offset" in strange.names
    most = MOST_OFFSET if alike else MOST_SHARE * plain.start.parameters.rated_speed
    if abs(offset) > max(most, 2.0 * abs(taken)):
        return plain, strange
    other = _with_offset(plain, offset, shown.std)
    same = [one for one in asked if one.name in (*strange.names, DELIVERY.name)]
    known = {one.name for one in same}
    again = explained(other, same) if known.issuperset(strange.names) else None
    kept = again is not None and again.fit.cost <= strange.fit.cost - KEPT_GAIN * shown.gain
    if again is None or not kept or not known.issuperset(again.names):
        return plain, strange
    return other, again


def _with_offset(plain: PlainFits, offset: float, std: float) -> PlainFits:
    """Return plain fits whose log has another offset of speed; the fits are still those at the old offset."""
    turning = Turning(plain.turning.teeth, offset)
    drives = plain.log.drives.copy()
    drives[:, 0] = with_ripple(plain.unturned, turning.teeth, offset).drives[:, 0]
    others = tuple(note for note in plain.teeth if note.code is not RigCode.SPEED_OFFSET)
    log = replace(plain.log, drives=drives, speed_offset=offset)
    return replace(plain, log=log, turning=turning, teeth=(*others, *offset_note(offset, std)))
