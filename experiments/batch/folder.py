"""Folder of a store: local, or any place that fsspec reaches; a file is written completely or not at all."""

import os
import re
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import Any

from plant.atomic import replacing
from plant.errors import HydrostateError

TEMPORARY = ".tmp"
"""Suffix of a file that is not yet complete."""

LOCK = "lock"


class Folder:
    """A folder on a disk, created at the first write; a subclass keeps its files elsewhere."""

    locks = True
    """Whether the place can restrict writing to one process."""

    def __init__(self, name: str) -> None:
        self.name = name

    def read(self, file: str) -> bytes:
        """Return a file's content.

        Raises
        ------
        OSError
            If there is none (FileNotFoundError), or it cannot be read.
        """
        return Path(self.name, file).read_bytes()

    def write(self, file: str, content: bytes) -> None:
        """Write a file under a temporary name and rename it.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        target = Path(self.name, file)
        target.parent.mkdir(parents=True, exist_ok=True)
        with replacing(target) as temporary:
            temporary.write(content)

    def files(self, below: str = "") -> list[str]:
        """Return the names of the files directly in a sub-folder, sorted and including temporary files."""
        place = Path(self.name, below)
        return sorted(one.name for one in place.iterdir() if one.is_file()) if place.is_dir() else []

    def move(self, file: str, to: str) -> None:
        """Rename a file; do nothing if it no longer exists."""
        target = Path(self.name, to)
        target.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileNotFoundError):
            Path(self.name, file).replace(target)

    def remove(self, file: str) -> None:
        """Remove a file; do nothing if it no longer exists."""
        Path(self.name, file).unlink(missing_ok=True)

    @contextmanager
    def writer(self) -> Generator[None]:
        """Hold the right to write, if the place can restrict it to one process.

        Raises
        ------
        HydrostateError
            If another process holds it.
        """
        Path(self.name).mkdir(parents=True, exist_ok=True)
        with Path(self.name, LOCK).open("a+b") as file:
            try:
                _lock(file.fileno())
            except OSError as error:
                raise HydrostateError(
                    f"store {self.name} is being written by another process: wait until it is done, or choose another"
                ) from error
            yield  # the system releases the lock however the process ends


def _lock(number: int) -> None:
    """Take a lock that the system releases when the process ends."""
    if os.name == "nt":  # pragma: no cover -- the other system's way
        import msvcrt

        msvcrt.locking(number, msvcrt.LK_NBLCK, 1)  # pyright: ignore[reportAttributeAccessIssue] -- on Windows alone
        return
    import fcntl

    fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)


class _RemoteFolder(Folder):
    """A place that fsspec reaches. It has no lock: two writers write the same parts under the same names."""

    locks = False

    def __init__(self, url: str) -> None:
        super().__init__(url)
        try:
            import fsspec

            self._system, self._root = fsspec.core.url_to_fs(url)
        except ImportError as error:
            raise HydrostateError(
                f"store {url} needs fsspec and the package for its protocol (pip install 'hydrostate[remote]'): {error}"
            ) from error
        except ValueError as error:
            raise HydrostateError(f"store {url} must be a folder or a URL that fsspec knows: {error}") from error

    def _path(self, file: str) -> str:
        return f"{self._root.rstrip('/')}/{file}"

    def read(self, file: str) -> bytes:
        self._system.invalidate_cache()
        content: Any = self._system.cat_file(self._path(file))
        return bytes(content)

    def write(self, file: str, content: bytes) -> None:
        temporary = f"{file}.{token_hex(4)}{TEMPORARY}"
        self._system.makedirs(self._path(file).rsplit("/", 1)[0], exist_ok=True)
        self._system.pipe_file(self._path(temporary), content)
        self._system.mv(self._path(temporary), self._path(file))

    def files(self, below: str = "") -> list[str]:
        self._system.invalidate_cache()
        try:
            found: Any = self._system.ls(self._path(below).rstrip("/"), detail=True)
        except FileNotFoundError:
            return []
        return sorted(str(one["name"]).rsplit("/", 1)[-1] for one in found if one["type"] == "file")

    def move(self, file: str, to: str) -> None:
        self._system.makedirs(self._path(to).rsplit("/", 1)[0], exist_ok=True)
        with suppress(FileNotFoundError):
            self._system.mv(self._path(file), self._path(to))

    def remove(self, file: str) -> None:
        with suppress(FileNotFoundError):
            self._system.rm_file(self._path(file))

    @contextmanager
    def writer(self) -> Generator[None]:
        yield


def open_folder(place: str | Path) -> Folder:
    """Return the folder of a path or a URL.

    Parameters
    ----------
    place : str or Path
        A local path, or a URL such as ``s3://bucket/study``.

    Returns
    -------
    Folder
        The folder; nothing is created yet.

    Raises
    ------
    HydrostateError
        If the URL cannot be used.

    Examples
    --------
    >>> open_folder("results/night").name
    'results/night'
    """
    remote = re.match(r"[A-Za-z][A-Za-z0-9+.-]+://", str(place))
    return _RemoteFolder(str(place)) if remote else Folder(str(Path(place)))
