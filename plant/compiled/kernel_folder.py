"""The folder of compiled kernels, and whether its contents may be run."""

import os
import stat
from pathlib import Path


def cache_folder() -> Path:
    """Return the folder of generated kernels: ``HYDROSTATE_CACHE``, or the user's cache directory."""
    chosen = os.environ.get("HYDROSTATE_CACHE")
    if chosen:
        return Path(chosen)
    import platformdirs

    return Path(platformdirs.user_cache_dir("hydrostate"))


def objection(found: os.stat_result) -> str | None:
    """Return why code in a folder or a file may not be run, or None if it may.

    Returns
    -------
    str or None
        A part of a sentence.
    """
    if not hasattr(os, "geteuid"):
        return None
    if found.st_uid != os.geteuid():
        return "it belongs to another user"
    if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "others may write to it (chmod go-w makes it yours alone)"
    return None
