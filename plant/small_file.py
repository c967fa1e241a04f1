"""Files that a person wrote, rig and study files: regular and small, whatever the path names."""

import errno
import stat
from pathlib import Path

LARGEST = 1 << 20
"""Bytes of the largest one that is read."""


def small_file(path: Path, most: int = LARGEST) -> bytes:
    """Return the content of a small regular file; a pipe would wait for ever, and a device has no end.

    Parameters
    ----------
    path : Path
        The file.
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
