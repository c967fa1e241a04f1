"""Machine code in the cache folder: written atomically, and run only if it is ours, undamaged and of this kernel."""

import hashlib
import json
import logging
import os
import stat
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from plant.atomic import replacing
from plant.compiled.kernel_folder import cache_folder, objection

logger = logging.getLogger("hydrostate")

MAGIC = b"hydrostate machine code 1\n"

LARGEST = 1 << 26
"""Largest size of a kernel's machine code [bytes]."""


def path_of(name: str, key: str) -> Path:
    """Return the file of a kernel.

    Parameters
    ----------
    name : str
        Name of the kernel.
    key : str
        Hash of everything that determines its machine code.
    """
    return cache_folder() / f"hydrostate_{name}_{key[:16]}.machine"


def load_kernel(name: str, key: str) -> tuple[Mapping[str, Any], bytes] | None:
    """Return description and machine code of a kernel, or None if they must be compiled.

    A file is ignored if it is empty, truncated, damaged, of another kernel, not a regular file, or owned by another
    user.

    Parameters
    ----------
    name, key : str
        See `path_of`.
    """
    if _is_refused(cache_folder()):
        return None
    content = _trusted_content(path_of(name, key))
    size = len(MAGIC) + 64
    if content is None or not content.startswith(MAGIC) or len(content) < size:
        return None
    body = content[size:]
    if content[len(MAGIC) : size] != hashlib.sha256(body).hexdigest().encode():
        return None
    head, _, code = body.partition(b"\n")
    description = json.loads(head)
    return (description, code) if description.get("key") == key else None


def _trusted_content(path: Path) -> bytes | None:
    """Return the content of a regular file that belongs to this user and that nobody else may write to."""
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    try:
        handle = os.open(path, flags)
    except OSError:
        return None
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode) or found.st_size > LARGEST or objection(found) is not None:
        os.close(handle)
        return None
    with os.fdopen(handle, "rb") as file:
        try:
            return file.read(LARGEST)
        except OSError:
            return None


@cache
def _is_refused(folder: Path) -> bool:
    """Return whether the kernels in a folder must not be run, with one warning if so."""
    try:
        found = folder.stat()
    except OSError:
        return False
    reason = objection(found)
    if reason is not None:
        logger.warning("compiled kernels in %s are not used, for %s: compiling for this run only", folder, reason)
    return reason is not None


def store_kernel(name: str, key: str, description: Mapping[str, Any], code: bytes) -> None:
    """Keep a kernel for later runs; if the folder cannot be written, warn once and continue without it.

    Parameters
    ----------
    name, key : str
        See `path_of`.
    description : Mapping[str, Any]
        Data that belong to the machine code.
    code : bytes
        An object file.
    """
    folder = cache_folder()
    if _is_refused(folder):
        return
    body = json.dumps({**description, "key": key}).encode() + b"\n" + code
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with replacing(path_of(name, key)) as file:
            if hasattr(os, "fchmod"):
                os.fchmod(file.fileno(), 0o600)
            file.write(MAGIC + hashlib.sha256(body).hexdigest().encode() + body)
    except OSError as error:
        _warn_once(folder, error.strerror or str(error))


@cache
def _warn_once(folder: Path, reason: str) -> None:
    logger.warning("kernels cannot be cached in %s (%s); compiling for this run only", folder, reason)
