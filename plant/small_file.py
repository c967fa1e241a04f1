"""Files that a person wrote, rig and study files: regular and small, whatever the path names."""

import errno
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

LARGEST = 1 << 20
"""Bytes of the largest one that is read."""

SHOWN = 120
"""Characters that an error shows of an entry [count]."""


def small_file(path: Path, most: int = LARGEST) -> bytes:
    """Return the content of a small regular file; a pipe would wait for ever, and a device has no end.

    Parameters
    ----------
    most : int
        Bytes that it may have.

    Raises
    ------
    OSError
        If it cannot be read, is no regular file, or is larger.
    """
    about = path.stat()
    if not stat.S_ISREG(about.st_mode):
        raise OSError(errno.EINVAL, "a regular file is needed")
    if about.st_size > most:
        raise OSError(errno.EFBIG, f"it has more than {most / 2**20:g} MB")
    return path.read_bytes()


def small_toml(path: Path) -> dict[str, Any]:
    """Return the content of a small TOML file.

    Returns
    -------
    dict[str, Any]
        By name.

    Raises
    ------
    OSError
        As of `small_file`.
    ValueError
        If it is no TOML; a number with a decimal comma is named.
    """
    text = ""
    try:
        text = small_file(path).decode("utf-8-sig")
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        commas = re.search(r"^\s*(\w+)\s*=\s*([-+]?\d+,\d+(?:[eE][-+]?\d+)?)\s*(?:#|$)", text, re.MULTILINE)
        hint = f"; {commas[1]} = {commas[2]} has a decimal comma, write a point" if commas else ""
        raise ValueError(f"{error}{hint}") from error


def shown(entry: object) -> str:
    """Return an entry of a file as an error shows it: as it would be written, and not all of a long one.

    Returns
    -------
    str
        At most `SHOWN` characters.

    Examples
    --------
    >>> shown("x"), len(shown("x" * 5000))
    ("'x'", 120)
    """
    return repr(entry)[:SHOWN]
