"""Text of files and their names, spelt out where it would command a terminal or be shown as another text."""

import re

_DIRECTIONS = (0x061C, 0x200E, 0x200F, *range(0x2028, 0x202F), *range(0x2066, 0x206A))
"""Ends of lines, and signs that change the direction of text: with them a name can be shown as another."""

_NO_TEXT = {code: f"\\u{code:04x}" for code in range(0xD800, 0xE000)} | {
    0xDC00 + byte: f"\\x{byte:02x}" for byte in range(128, 256)
}
"""Surrogates that stand alone: signs of Python for bytes that are no UTF-8, and those that stand for nothing."""

_CONTROLS = {
    **{code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160))},
    **{code: f"\\u{code:04x}" for code in _DIRECTIONS},
    **_NO_TEXT,
}

_UNPRINTED = re.compile(f"[{re.escape(''.join(chr(code) for code in _CONTROLS if code not in (9, 10, 13)))}]")


def spelt(text: str) -> str:
    """Return a text or a path as text that every format can hold: bytes of a name that are no UTF-8 are spelt out.

    Parameters
    ----------
    text : str
        As Python gives it, with such bytes as lone surrogates.

    Examples
    --------
    >>> len(spelt("l" + chr(0xDCF6) + "g.csv"))
    10
    """
    return text.translate(_NO_TEXT)


def visible(text: str) -> str:
    """Return a text of a file's with its control characters spelt out, so that none reaches a terminal.

    Parameters
    ----------
    text : str
        Any text; lines stay lines. Signs that change its direction are spelt out too, and bytes that are no UTF-8.

    Examples
    --------
    >>> len(visible("run" + chr(27) + "[2J.csv"))
    14
    """
    return "\n".join(line.translate(_CONTROLS) for line in text.split("\n"))


def visible_name(file: object) -> str:
    """Return the name of a file as `visible` does, on one line."""
    return visible(str(file)).replace("\n", "\\x0a")


def visible_page(page: str) -> str:
    """Return a page as `visible` does, its lines and tabs as they are."""
    return _UNPRINTED.sub(lambda found: _CONTROLS[ord(found.group())], page)
