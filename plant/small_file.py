"""Files that a person wrote, rig and study files: regular and small, whatever the path names."""

import errno
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

LARGEST = 1 << 20
"""Bytes of the largest one that is read."""

_SLIPS = {
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
"""Slips in a line of TOML, and how to tell them."""

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
        If it is no TOML; a sign, a quote or a comma that is none of TOML is named.
    """
    text = ""
    try:
        text = small_file(path).decode("utf-8-sig")
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        place = re.search(r"at line (\d+)", str(error))
        hint = _slip(text.splitlines()[int(place[1]) - 1]) if place else ""
        raise ValueError(f"{error}{hint}") from error


def _slip(line: str) -> str:
    """Return what is wrong with a line that is no TOML, where it is a slip that a person makes; else empty."""
    entry = line.partition("#")[0].strip()
    slip = next((slip for slip, form in _SLIPS.items() if form.search(entry)), "")
    return f"; {entry[:SHOWN]} {slip}" if slip else ""


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
