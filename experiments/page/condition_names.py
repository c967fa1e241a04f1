"""Names of conditions for a reader; imports nothing, so that a verb on a log starts fast."""


def in_words(condition: str) -> str:
    """Return a condition's name for a reader.

    Returns
    -------
    str
        The same with spaces, both faults joined by a plus.

    Examples
    --------
    >>> in_words("minor_leakage_major_friction")
    'minor leakage + major friction'
    """
    return condition.replace("leakage_", "leakage + ").replace("_", " ")
