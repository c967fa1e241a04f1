"""`agreed(straight, read)`: what is strange about a slow log, by straight lines between samples and with turns read."""

from collections.abc import Sequence
from typing import NamedTuple

from estimation.fits.flow.asked_hypotheses import worth_in
from estimation.fits.flow.plain import PlainFits
from estimation.fits.hypotheses import Hypothesis
from estimation.fits.hypothesis_search.explain import WORTH
from estimation.fits.hypothesis_search.explanation import Explanation
from plant.notes import Note


class Answered(NamedTuple):
    """What a log says, asked what is strange about it.

    Parameters
    ----------
    plain : PlainFits
        The plain form's fits.
    asked : sequence of Hypothesis
        What it was asked.
    open_ends : sequence of Note
        What it leaves open.
    strange : Explanation, optional
        What is strange about it, if it is believed rather than the plain form.
    ended : bool
        Whether the search for it was ended before it was done, see `estimation.fits.greybox.work_limit`.
    """

    plain: PlainFits
    asked: Sequence[Hypothesis]
    open_ends: Sequence[Note]
    strange: Explanation | None
    ended: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is strange."""
        return () if self.strange is None else self.strange.names


def wanted_of(plain: PlainFits, left: float = 1.0) -> float:
    """Return what a hypothesis must gain: at each turn of a slow log, unless it must gain with turns read as well.

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
    return WORTH if plain.turns_told or plain.start.turns_read else worth_in(plain.log, left)


def agreed(straight: Answered, read: Answered) -> Answered:
    """Return what a slow log says, asked by straight lines between samples and with its turns read.

    What straight lines leave of a turn may pass for a pump that compresses its oil or a pressure that drifts. So
    nothing is strange, or left open, that is not with turns read too, and what shows there alone must gain at each
    turn. Where both ways agree, straight lines have the numbers: their intervals hold what they leave, those of turns
    that were read are too narrow for leakage (decision 332).

    Parameters
    ----------
    straight : Answered
        By straight lines.
    read : Answered
        With what each turn pumps read off the samples after it, see `with_turns_read`.
    """
    if read.ended:
        return straight._replace(strange=None, ended=True)
    if read.names != straight.names and not _gains_at_each_turn(read):
        read = read._replace(strange=None)
    by_lines, by_turns = (one.plain.explains(one.plain.best) for one in (straight, read))
    if straight.names == read.names and (straight.strange or by_lines or not by_turns):
        return straight if read.strange else _plain(straight, read)
    if read.strange is None and by_lines:
        return _plain(straight, read)
    return read


def _plain(straight: Answered, read: Answered) -> Answered:
    """Return what straight lines say of a log that has nothing strange: open is what both leave open."""
    open_too = {note.code for note in straight.open_ends}
    ends = tuple(note for note in read.open_ends if note.code in open_too)
    return straight._replace(strange=None, open_ends=ends)


def _gains_at_each_turn(answer: Answered) -> bool:
    """Return whether what is strange gains `WORTH` over the plain form at each turn."""
    if answer.strange is None:
        return False
    gain = answer.plain.best.cost - answer.strange.fit.cost
    return gain > worth_in(answer.plain.log, answer.strange.fit.chi_square[0])
