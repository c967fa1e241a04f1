"""Names that look alike are one name."""

import unicodedata


def one_form(name: str) -> str:
    """Return a name with each accented letter as one character: macOS writes letter and accent apart.

    Examples
    --------
    >>> one_form("e\N{COMBINING ACUTE ACCENT}") == "\N{LATIN SMALL LETTER E WITH ACUTE}"
    True
    """
    return unicodedata.normalize("NFC", name)
