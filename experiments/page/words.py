"""Names in results as a reader wants them."""

from collections.abc import Mapping
from typing import Any

from experiments.page.condition_names import in_words
from experiments.page.tables import Cell, Column
from plant.log.notes import LogCode


def in_short(condition: str) -> str:
    """Return a condition's name for a crowded axis.

    Examples
    --------
    >>> in_short("minor_leakage_major_friction")
    'min. leak. + maj. fric.'
    """
    short = in_words(condition)
    for word, shortened in (("minor", "min."), ("major", "maj."), ("leakage", "leak."), ("friction", "fric.")):
        short = short.replace(word, shortened)
    return short


def sentence(said: str) -> str:
    """Return a clause as a sentence; the name of a channel stays as it is spelt.

    Examples
    --------
    >>> sentence("check the rig file"), sentence("position_m stays at 0")
    ('Check the rig file.', 'position_m stays at 0.')
    """
    begin = said[:1] if "_" in said.split(" ", 1)[0] else said[:1].upper()
    return f"{begin}{said[1:].rstrip('.')}."


def left_unread(result: Mapping[str, Any]) -> list[str]:
    """Return what to do about columns that were not used though they may be needed, as sentences.

    Parameters
    ----------
    result : Mapping
        Entries of a log; its ``notes`` have what reading it brought up.
    """
    codes = (LogCode.COLUMN_OVERLOOKED, LogCode.CHAMBER_ALONE)
    return [sentence(one["text"]) for one in result.get("notes", ()) if one["code"] in codes]


CONDITION = Column("condition", words=lambda name: Cell(in_words(name), "name"))
