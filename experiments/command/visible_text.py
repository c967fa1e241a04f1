"""Text from files and file names, escaped where it could control a terminal or appear as other text."""

import re

_DIRECTIONS = (0x061C, 0x200E, 0x200F, *range(0x2028, 0x202F), *range(0x2066, 0x206A))
"""Line ends and characters that change the text direction: these can make a name look like another."""

_NO_TEXT = {code: f"\\u{code:04x}" for code in range(0xD800, 0xE000)} | {
    0xDC00 + byte: f"\\x{byte:02x}" for byte in range(128, 256)
}
"""Lone surrogates: Python's characters for bytes that are not UTF-8, and those without a meaning."""

_CONTROLS = {
    **{code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160))},
    **{code: f"\\u{code:04x}" for code in _DIRECTIONS},
    **_NO_TEXT,
}

_UNPRINTED = re.compile(f"[{re.escape(''.join(chr(code) for code in _CONTROLS if code not in (9, 10, 13)))}]")


def valid_text(text: str) -> str:
    """Return a text or a path as text valid in every format: bytes that are not UTF-8 are escaped.

    Parameters
    ----------
    text : str
        As given by Python, with such bytes as lone surrogates.

    Examples
    --------
    >>> len(valid_text("l" + chr(0xDCF6) + "g.csv"))
    10
    """
    return text.translate(_NO_TEXT)


def visible(text: str) -> str:
    """Return text from a file with its control characters escaped, so that none reaches a terminal.

    Parameters
    ----------
    text : str
        Any text; lines are kept. Characters that change the text direction, and bytes that are not UTF-8, are escaped
        too.

    Examples
    --------
    >>> len(visible("run" + chr(27) + "[2J.csv"))
    14
    """
    return "\n".join(line.translate(_CONTROLS) for line in text.split("\n"))


def visible_name(file: object) -> str:
    """Return a file name, escaped as by `visible`, on one line."""
    return visible(str(file)).replace("\n", "\\x0a")


def visible_page(page: str) -> str:
    """Return a page, escaped as by `visible`, with its lines and tabs unchanged."""
    return _UNPRINTED.sub(lambda found: _CONTROLS[ord(found.group())], page)
