"""Files that a person wrote, such as rig and study files: only small regular files are read."""

import errno
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

LARGEST = 1 << 20
"""Size of the largest file that is read [bytes]."""

_COMMON_MISTAKES = {
    "has a minus sign that is none of TOML, write a hyphen (-)": re.compile("[\u2212\u2013\u2014]"),
    'has quotes that are none of TOML, write "': re.compile("[\u201c\u201d\u201e\u00ab\u00bb\u2018\u2019]"),
    "has a decimal comma, write a point": re.compile(r"=\s*[-+]?\d+,\d+(?:[eE][-+]?\d+)?$"),
    "has commas, write nothing between thousands": re.compile(r"=\s*[-+]?\d+(?:,\d+){2,}"),
    "has a unit, write the number and its unit in quotes": re.compile(
        r"=\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*(?![eE][-+]?\d)[^\W\d_]"
    ),
    "has a space in its name, write an underscore (_)": re.compile(r"^[^\W\d]\w*\s+\w[\w\s]*="),
    "has a colon, write an equals sign (=)": re.compile(r"^\w+\s*:"),
}
"""Common mistakes in a line of TOML, and the patterns that find them."""

MOST_SHOWN = 120
"""Largest number of characters of an entry in an error [count]."""


def small_file(path: Path, most: int = LARGEST) -> bytes:
    """Return the content of a small regular file; a pipe would block for ever, and a device has no end.

    Parameters
    ----------
    most : int
        Largest size [bytes].

    Raises
    ------
    OSError
        If it cannot be read, is not a regular file, or is larger than the limit.
    """
    about = path.stat()
    if not stat.S_ISREG(about.st_mode):
        folder = stat.S_ISDIR(about.st_mode)
        raise OSError(errno.EINVAL, "it is a folder" if folder else "a regular file is needed")
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
        As for `small_file`.
    ValueError
        If it is not TOML; the message names a sign, a quote or a comma that is not valid TOML.
    """
    text = ""
    try:
        text = small_file(path).decode("utf-8-sig")
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        place = re.search(r"at line (\d+)", str(error))
        hint = _common_mistake(text.splitlines()[int(place[1]) - 1]) if place else ""
        raise ValueError(f"{error}{hint}") from error


def _common_mistake(line: str) -> str:
    """Return the mistake in an invalid line of TOML if it is a common one, else an empty text."""
    entry = line.partition("#")[0].strip()
    slip = next((slip for slip, form in _COMMON_MISTAKES.items() if form.search(entry)), "")
    return f"; {entry[:MOST_SHOWN]} {slip}" if slip else ""


def entry_text(entry: object) -> str:
    """Return an entry of a file for an error message, as it would be written; a long one is cut.

    Returns
    -------
    str
        At most `MOST_SHOWN` characters.

    Examples
    --------
    >>> entry_text("x"), len(entry_text("x" * 5000))
    ("'x'", 120)
    """
    return repr(entry)[:MOST_SHOWN]
