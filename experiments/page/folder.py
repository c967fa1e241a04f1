"""One result folder a study, written whole or not at all."""

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
from experiments.running.refusal import refused
from plant.errors import HydrostateError

SERIES_FORMAT = "%.9g"
"""Digits of the curves; tables keep all."""

UNWRITABLE = "result folder {} must be in a place that can be written, got"

_TRIES = 10
"""Times that a result is moved to its name while other studies take it [count]."""

_HERE, _EXCHANGE = -100, 2
"""AT_FDCWD, by which a path is taken from the current folder, and RENAME_EXCHANGE, of Linux."""

DESKTOP_FILES = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
"""Files that file managers leave behind, which are nobody's work."""


def write_tables(
    tables: Tables,
    manifest: Mapping[str, Any],
    folder: Path,
    files: Mapping[str, bytes] = MappingProxyType({}),
    series: Tables = MappingProxyType({}),
) -> Path:
    """Write a study's tables, and what was made of them, as one folder, replacing an earlier study's.

    All is written beside the folder first, reaches the disk, and takes its name at the end: an earlier result stays
    whole until then, also where the power fails.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        What was found, by name.
    manifest : Mapping[str, Any]
        What it takes to run it again; its ``study`` names it.
    folder : Path
        The folder; new, empty, or an earlier study's result.
    files : Mapping[str, bytes]
        Report, figures and others, by their path within the folder.
    series : Mapping[str, pandas.DataFrame]
        Curves, which keep nine digits.

    Returns
    -------
    Path
        The manifest, ``manifest.json``.

    Raises
    ------
    HydrostateError
        If the folder holds anything that no study wrote, or cannot be written.
    """
    target = check_target(folder)
    contents = {**csv_files("tables", tables), **csv_files("series", series, SERIES_FORMAT), **files}
    contents["manifest.json"] = json_file({**manifest, "files": sorted([*contents, "manifest.json"])})
    temporary = target.with_name(f".{target.name}.{token_hex(4)}.tmp")
    with refused(UNWRITABLE.format(folder)):
        try:
            temporary.mkdir(parents=True)
            with held(temporary):
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
        By name; rows that have a name are conditions.
    float_format : str, optional
        How numbers are written; all their digits unless told.
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
    """Tell whether a study may be written to a folder, before the study is run.

    What a run left beside it that was killed is removed; an earlier result that it had moved gets its name back.

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
    with refused(UNWRITABLE.format(folder)):
        _tidy(folder.resolve())
        return _checked(folder)


def _checked(folder: Path) -> Path:
    target = folder.resolve()
    if Path.cwd().is_relative_to(target):
        raise HydrostateError(
            f"result folder must be one of its own, got {folder}, which is or holds the current folder"
        )
    if target.exists() and not target.is_dir():
        raise HydrostateError(f"result folder must be a folder or not exist yet, got the file {folder}")
    strangers = sorted(_strangers(target)) if target.exists() else []
    if strangers:
        raise HydrostateError(
            f"result folder must be new, empty, or an earlier study's result, got {folder}, "
            f"which holds {strangers[0]}: choose another folder"
        )
    nearest = next(parent for parent in target.parents if parent.exists())
    if not (nearest.is_dir() and os.access(nearest, os.W_OK | os.X_OK)):
        raise HydrostateError(f"result folder {folder} must be in a place that can be written, got {nearest}")
    return target


def _strangers(folder: Path) -> set[str]:
    """Return the files in a folder that no study wrote."""
    present = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}
    with suppress(FileNotFoundError, ValueError, TypeError, KeyError):
        manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        present -= set(manifest["files"] if "study" in manifest else ())
    return {name for name in present if Path(name).name not in DESKTOP_FILES}


def _swap(temporary: Path, target: Path) -> None:
    if target.exists() and _exchanged(temporary, target):
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
                shutil.rmtree(old, ignore_errors=True)  # another study took the name first, and this was before it
            else:
                return
        raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))
    finally:
        if old.exists() and not target.exists():
            old.rename(target)
        shutil.rmtree(old, ignore_errors=True)


def _exchanged(first: Path, second: Path) -> bool:
    """Exchange the names of two folders in one step, so that each name always has a whole one.

    Returns
    -------
    bool
        False where the system or the file system cannot do it; then nothing has changed.

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
    """Remove what a writer left that was killed, and give a result back its name that it had moved."""
    if not target.parent.is_dir() or not os.access(target.parent, os.W_OK | os.X_OK):
        return
    left = re.compile(rf"\.{re.escape(target.name)}\.[0-9a-f]{{8}}\.(?:tmp|old)")
    for place in sorted(one for one in target.parent.iterdir() if left.fullmatch(one.name) and one.is_dir()):
        with suppress(OSError), held(place) as free:
            if free and place.suffix == ".old" and not target.exists():
                place.rename(target)
            elif free:
                shutil.rmtree(place, ignore_errors=True)


@contextmanager
def held(folder: Path) -> Generator[bool]:
    """Hold a folder as one that is written to, until the block or the process ends.

    Yields
    ------
    bool
        False where another process holds it, or no system can tell.
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
        yield free  # the lock goes with the process, whatever ends it
    finally:
        os.close(number)
