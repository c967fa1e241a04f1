"""One result folder for each study; no partial folder is left behind."""

import errno
import json
import os
import re
import shutil
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from types import MappingProxyType
from typing import Any

import pandas as pd

from experiments.page.frames import Tables
from experiments.running.refusal import os_errors_as
from plant.errors import HydrostateError

SERIES_FORMAT = "%.9g"
"""Number format of curves; tables keep all digits."""

UNWRITABLE = "result folder {} must be in a place that can be written, got"

_TRIES = 10
"""Number of attempts to rename a result while other studies take its name [count]."""

_HERE, _EXCHANGE = -100, 2
"""Linux constants: AT_FDCWD, for paths relative to the current folder, and RENAME_EXCHANGE."""

DESKTOP_FILES = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
"""Files that file managers create, which contain nobody's work."""


def write_tables(
    tables: Tables,
    manifest: Mapping[str, Any],
    folder: Path,
    files: Mapping[str, bytes] = MappingProxyType({}),
    series: Tables = MappingProxyType({}),
) -> Path:
    """Write a study's tables, and everything made from them, as one folder, replacing an earlier study's.

    All files are first written to a temporary folder beside it and flushed to disk, and only then renamed. Until then
    an earlier result stays complete, even if the power fails.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        Results, by name.
    manifest : Mapping[str, Any]
        All that is needed to run the study again; its ``study`` names the study.
    folder : Path
        The folder; new, empty, or an earlier study's result.
    files : Mapping[str, bytes]
        Report, figures and others, by their path within the folder.
    series : Mapping[str, pandas.DataFrame]
        Curves, written with nine digits.

    Returns
    -------
    Path
        The manifest, ``manifest.json``.

    Raises
    ------
    HydrostateError
        If the folder contains anything not written by a study, or cannot be written.
    """
    target = check_target(folder)
    contents = {**csv_files("tables", tables), **csv_files("series", series, SERIES_FORMAT), **files}
    contents["manifest.json"] = json_file({**manifest, "files": sorted([*contents, "manifest.json"])})
    temporary = target.with_name(f".{target.name}.{token_hex(4)}.tmp")
    with os_errors_as(UNWRITABLE.format(folder)):
        try:
            temporary.mkdir(parents=True)
            with folder_lock(temporary):
                for name, content in contents.items():
                    (temporary / name).parent.mkdir(parents=True, exist_ok=True)
                    with (temporary / name).open("wb") as file:
                        file.write(content)
                        file.flush()
                        os.fsync(file.fileno())
                _swap(temporary, target)
        except BaseException:
            shutil.rmtree(temporary, ignore_errors=True)
            raise
    return folder / "manifest.json"


def csv_files(place: str, frames: Tables, float_format: str | None = None) -> dict[str, bytes]:
    """Return data frames as CSV files.

    Parameters
    ----------
    frames : Mapping[str, pandas.DataFrame]
        By name; rows with a label are conditions.
    float_format : str, optional
        Number format; by default all digits.
    """
    files: dict[str, bytes] = {}
    for name, frame in frames.items():
        numbered = pd.api.types.is_integer_dtype(frame.index)
        rows = frame if numbered else frame.rename_axis(index="condition").reset_index()
        path = f"{place}/{name.replace(',', '').replace(' ', '_')}.csv"
        files[path] = rows.to_csv(index=False, float_format=float_format).encode()
    return files


def json_file(values: Mapping[str, Any]) -> bytes:
    """Return plain, finite values as a JSON file."""
    return (json.dumps(values, indent=2, allow_nan=False) + "\n").encode()


def check_target(folder: Path) -> Path:
    """Check whether a study may be written to a folder, before the study is run.

    Remains of a killed run beside the folder are removed. An earlier result that this run had moved gets its name back.

    Returns
    -------
    Path
        The folder without symbolic links.

    Raises
    ------
    HydrostateError
        If it is a file, is or holds the current folder, or holds anything that no study wrote, or if nothing can be
        written there.
    """
    with os_errors_as(UNWRITABLE.format(folder)):
        _tidy(folder.resolve())
        return _checked_target(folder)


def _checked_target(folder: Path) -> Path:
    target = folder.resolve()
    if Path.cwd().is_relative_to(target):
        raise HydrostateError(
            f"result folder must be one of its own, got {folder}, which is or holds the current folder"
        )
    if target.exists() and not target.is_dir():
        raise HydrostateError(f"result folder must be a folder or not exist yet, got the file {folder}")
    strangers = sorted(_foreign_files(target)) if target.exists() else []
    if strangers:
        raise HydrostateError(
            f"result folder must be new, empty, or an earlier study's result, got {folder}, "
            f"which holds {strangers[0]}: choose another folder"
        )
    nearest = next(parent for parent in target.parents if parent.exists())
    if not (nearest.is_dir() and os.access(nearest, os.W_OK | os.X_OK)):
        raise HydrostateError(f"result folder {folder} must be in a place that can be written, got {nearest}")
    return target


def _foreign_files(folder: Path) -> set[str]:
    """Return the files in a folder that were not written by a study."""
    present = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}
    with suppress(FileNotFoundError, ValueError, TypeError, KeyError):
        manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        present -= set(manifest["files"] if "study" in manifest else ())
    return {name for name in present if Path(name).name not in DESKTOP_FILES}


def _swap(temporary: Path, target: Path) -> None:
    if target.exists() and _exchange_names(temporary, target):
        shutil.rmtree(temporary, ignore_errors=True)
        return
    old = target.with_name(f".{target.name}.{token_hex(4)}.old")
    try:
        for _ in range(_TRIES):
            with suppress(FileNotFoundError):
                target.rename(old)
            try:
                temporary.rename(target)
            except OSError as error:
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
                shutil.rmtree(old, ignore_errors=True)  # another study took the name, so the earlier result can go
            else:
                return
        raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))
    finally:
        if old.exists() and not target.exists():
            old.rename(target)
        shutil.rmtree(old, ignore_errors=True)


def _exchange_names(first: Path, second: Path) -> bool:
    """Exchange the names of two folders in one step, so that both names always have a complete folder.

    Returns
    -------
    bool
        False if the system or the file system does not support it; then nothing has changed.

    References
    ----------
    renameat2(2) of Linux, ``RENAME_EXCHANGE``.
    """
    import ctypes

    try:
        rename = ctypes.CDLL(None).renameat2
    except (OSError, TypeError, AttributeError):  # pragma: no cover -- Windows, macOS, an old C library
        return False
    return rename(_HERE, os.fsencode(first), _HERE, os.fsencode(second), _EXCHANGE) == 0


def _tidy(target: Path) -> None:
    """Remove the remains of a killed writer, and restore the name of a result that it had moved."""
    if not target.parent.is_dir() or not os.access(target.parent, os.W_OK | os.X_OK):
        return
    left = re.compile(rf"\.{re.escape(target.name)}\.[0-9a-f]{{8}}\.(?:tmp|old)")
    for place in sorted(one for one in target.parent.iterdir() if left.fullmatch(one.name) and one.is_dir()):
        with suppress(OSError), folder_lock(place) as free:
            if free and place.suffix == ".old" and not target.exists():
                place.rename(target)
            elif free:
                shutil.rmtree(place, ignore_errors=True)


@contextmanager
def folder_lock(folder: Path) -> Generator[bool]:
    """Lock a folder for writing until the block or the process ends.

    Yields
    ------
    bool
        False if another process holds the lock, or the system cannot determine this.
    """
    if os.name == "nt":  # pragma: no cover -- folders have no locks there, and nothing is tidied
        yield False
        return
    import fcntl

    number = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
            free = True
        except OSError:
            free = False
        yield free  # the system releases the lock however the process ends
    finally:
        os.close(number)
