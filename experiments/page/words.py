"""Names in results as a reader wants them."""

from experiments.page.condition_names import in_words
from experiments.page.tables import Cell, Column


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
    """Return a clause as a sentence.

    Examples
    --------
    >>> sentence("check the rig file")
    'Check the rig file.'
    """
    return f"{said[:1].upper()}{said[1:].rstrip('.')}."


CONDITION = Column("condition", words=lambda name: Cell(in_words(name), "name"))
