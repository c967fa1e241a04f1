"""`agreed_answer(straight, read)`: effects in a slow log that hold for straight lines and with turns read."""

from collections.abc import Sequence
from typing import NamedTuple

from estimation.fits.flow.asked_hypotheses import wanted_gain_at_turns
from estimation.fits.flow.plain import PlainFits
from estimation.fits.hypotheses import Hypothesis
from estimation.fits.hypothesis_search.explain import REQUIRED_GAIN
from estimation.fits.hypothesis_search.explanation import Explanation
from plant.notes import Note


class LogAnswer(NamedTuple):
    """What a fit of a log says, after the search for unusual effects.

    Parameters
    ----------
    plain : PlainFits
        The plain form's fits.
    asked : sequence of Hypothesis
        The hypotheses that were tested.
    open_ends : sequence of Note
        What the log leaves undecided.
    strange : Explanation, optional
        The effect that explains the log, if it is believed rather than the plain form.
    ended : bool
        Whether the search was stopped early, see `estimation.fits.greybox.work_limit`.
    """

    plain: PlainFits
    asked: Sequence[Hypothesis]
    open_ends: Sequence[Note]
    strange: Explanation | None
    ended: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects found."""
        return () if self.strange is None else self.strange.names


def wanted_gain(plain: PlainFits, left: float = 1.0) -> float:
    """Return the gain that a hypothesis must reach: at each turn of a slow log, unless turns are read as well.

    Parameters
    ----------
    plain : PlainFits
        The plain form's fits.
    left : float
        Mean squared normalised residual under the hypothesis [dimensionless].

    Returns
    -------
    float
        Gain in log-likelihood [dimensionless].
    """
    return REQUIRED_GAIN if plain.turns_readable or plain.start.turns_read else wanted_gain_at_turns(plain.log, left)


def agreed_answer(straight: LogAnswer, read: LogAnswer) -> LogAnswer:
    """Return what a slow log says, from fits with straight lines between samples and with turns read from the log.

    The error of straight lines at a turn may look like oil that the pump compresses, or like a drift of pressure. So an
    effect counts, or is left undecided, only if it also shows with turns read; and one that shows only there must gain
    at each turn. If both fits agree, the numbers are those of straight lines: their intervals include the error of the
    lines, while intervals with turns read are too narrow for leakage (decision 332).

    Parameters
    ----------
    straight : LogAnswer
        From straight lines.
    read : LogAnswer
        With the volume pumped in each turn read from the samples after it, see `with_turns_read`.
    """
    if read.ended:
        return straight._replace(strange=None, ended=True)
    if read.names != straight.names and not _gains_at_each_turn(read):
        read = read._replace(strange=None)
    by_lines, by_turns = (one.plain.explains(one.plain.best) for one in (straight, read))
    if straight.names == read.names and (straight.strange or by_lines or not by_turns):
        return straight if read.strange else _without_effects(straight, read)
    if read.strange is None and by_lines:
        return _without_effects(straight, read)
    return read


def _without_effects(straight: LogAnswer, read: LogAnswer) -> LogAnswer:
    """Return what straight lines say of a log without unusual effects; undecided is what both fits leave undecided."""
    open_too = {note.code for note in straight.open_ends}
    ends = tuple(note for note in read.open_ends if note.code in open_too)
    return straight._replace(strange=None, open_ends=ends)


def _gains_at_each_turn(answer: LogAnswer) -> bool:
    """Return whether the effect gains `REQUIRED_GAIN` over the plain form at each turn."""
    if answer.strange is None:
        return False
    gain = answer.plain.best.cost - answer.strange.fit.cost
    return gain > wanted_gain_at_turns(answer.plain.log, answer.strange.fit.chi_square[0])
