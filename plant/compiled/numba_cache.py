"""Numba's cache of machine code, made to heal: what is damaged, or could be another's, is compiled anew.

Numba's own takes what it finds: it stops at a file that was cut off, runs one that others wrote, and a full disk ends
the run that was only to be faster next time.
"""

import hashlib
import logging
import os
import pickle
from collections.abc import Generator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, BinaryIO

from numba.core.caching import IndexDataCacheFile
from numba.core.dispatcher import Dispatcher

from plant.atomic import replacing
from plant.compiled.kernel_folder import objection

logger = logging.getLogger("hydrostate")

_DIGEST = hashlib.sha256().digest_size


class CheckedCacheFile(IndexDataCacheFile):
    """Numba's index and data files, each behind a hash of itself."""

    def load(self, key: Any) -> Any:
        """Return what was compiled, or None where it is to be compiled anew."""
        try:
            return super().load(key)
        except (OSError, EOFError, ValueError, pickle.UnpicklingError):
            return None

    def save(self, key: Any, data: Any) -> None:
        """Keep what was compiled; where it cannot be kept, say so once and do without."""
        try:
            super().save(key, data)
        except OSError as error:
            _say_once(self._cache_path, error.strerror or str(error))

    def _load_index(self) -> Any:
        try:
            version, stamp, overloads = pickle.loads(_checked(Path(self._index_path)))  # noqa: S301  our own, checked
        except (OSError, EOFError, ValueError, pickle.UnpicklingError):
            return {}
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: Any) -> None:
        with self._open_for_write(self._index_path) as file:
            _write(file, self._dump((self._version, self._source_stamp, overloads)))

    def _load_data(self, name: str) -> Any:
        return pickle.loads(_checked(Path(self._data_path(name))))  # noqa: S301  our own, checked

    def _save_data(self, name: str, data: Any) -> None:
        with self._open_for_write(self._data_path(name)) as file:
            _write(file, self._dump(data))

    @contextmanager
    def _open_for_write(self, filepath: str) -> Generator[Any]:
        with replacing(Path(filepath)) as file:
            yield file


def _write(file: BinaryIO, content: bytes) -> None:
    if hasattr(os, "fchmod"):
        os.fchmod(file.fileno(), 0o600)
    file.write(hashlib.sha256(content).digest() + content)


def _checked(path: Path) -> bytes:
    """Return a file's content without its hash.

    Raises
    ------
    OSError
        If the file is not there, not this user's own, or damaged.
    """
    with path.open("rb") as file:
        reason = objection(os.fstat(file.fileno()))
        whole = file.read()
    content = whole[_DIGEST:]
    if reason is not None or hashlib.sha256(content).digest() != whole[:_DIGEST]:
        raise OSError(f"{path} is not used: {reason or 'it is damaged'}")
    return content


@cache
def _say_once(folder: str, reason: str) -> None:
    logger.warning("kernels cannot be cached in %s (%s); compiling for this run only", folder, reason)


def check(module: ModuleType) -> None:
    """Make the functions of a kernel file keep what they compile in files that are checked.

    Parameters
    ----------
    module : module
        The file, imported, none of its functions called yet.
    """
    for value in vars(module).values():
        file = getattr(getattr(value, "_cache", None), "_cache_file", None)
        if isinstance(value, Dispatcher) and type(file) is IndexDataCacheFile:
            file.__class__ = CheckedCacheFile
