"""Names in results, as shown to readers."""

from experiments.page.condition_names import condition_in_words
from experiments.page.tables import Cell, Column


def condition_in_short(condition: str) -> str:
    """Return a condition's name, shortened for a crowded axis.

    Examples
    --------
    >>> condition_in_short("minor_leakage_major_friction")
    'min. leak. + maj. fric.'
    """
    short = condition_in_words(condition)
    for word, shortened in (("minor", "min."), ("major", "maj."), ("leakage", "leak."), ("friction", "fric.")):
        short = short.replace(word, shortened)
    return short


CONDITION = Column("condition", words=lambda name: Cell(condition_in_words(name), "name"))
