"""Names of conditions for readers; imports nothing, so that a verb on a log starts fast."""

LEVELS = ("none", "minor", "major")
"""Levels of leakage and friction, by size."""


def condition_in_words(condition: str) -> str:
    """Return a condition's name for a reader.

    Returns
    -------
    str
        The name with spaces; two faults are joined by a plus.

    Examples
    --------
    >>> condition_in_words("minor_leakage_major_friction")
    'minor leakage + major friction'
    """
    return condition.replace("leakage_", "leakage + ").replace("_", " ")


def level_in_words(name: str, size: float) -> str:
    """Return the level of a fault in words, or the levels between which it lies.

    Parameters
    ----------
    size : float
        On the scale where 1 is minor and 2 is major [dimensionless].

    Examples
    --------
    >>> level_in_words("leakage", 0.5), level_in_words("friction", 1.0), level_in_words("friction", 2.25)
    ('leakage between none and minor', 'minor friction', 'friction above major')
    """
    below = int(size)
    if below == size and below < len(LEVELS):
        return f"{LEVELS[below]} {name}"
    if below + 1 >= len(LEVELS):
        return f"{name} above major"
    return f"{name} between {LEVELS[below]} and {LEVELS[below + 1]}"
