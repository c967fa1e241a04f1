"""The logs that a study names, each counted once even if several names lead to it."""

import os
from collections.abc import Collection, Mapping
from glob import escape, has_magic
from pathlib import Path
from typing import Any, NamedTuple

from experiments.batch.log_files import matching_files
from experiments.batch.series import Log, content_of
from experiments.batch.study_file import Logs, StudyError
from experiments.command.logs import read_log
from experiments.command.visible_text import valid_text
from plant.eha.rig import Rig
from plant.log.record import Record


class ListedLogs(NamedTuple):
    """Logs of one `[[logs]]` of a study.

    Parameters
    ----------
    links : Mapping[str, str]
        Alternative names of logs, each with the name under which the log is counted.
    """

    logs: tuple[Log, ...]
    links: Mapping[str, str]


def listed_logs(logs: Logs, place: int, folder: Path, rigs: Mapping[str, Rig[Any]]) -> ListedLogs:
    """List the logs that a pattern finds, and hash them.

    Parameters
    ----------
    place : int
        Index of the `[[logs]]` in the study, for the error message.
    folder : Path
        Folder in which the pattern starts.
    rigs : Mapping[str, Rig]
        Rigs of the folders that have their own.

    Returns
    -------
    ListedLogs
        The logs. If a file has several names, its own name counts, else the first; names whose folders have different
        rig files all count.

    Raises
    ------
    StudyError
        If no file is found.
    """
    pattern = os.path.join(escape(str(folder)), logs.glob)  # noqa: PTH118 -- which keeps a pattern that is absolute
    found = matching_files(pattern)
    if not found:
        said = "no file matches" if has_magic(logs.glob) else "there is no such file as"
        raise StudyError(
            f"logs[{place}].glob must match at least one file, got {logs.glob!r}: {said} {folder / logs.glob}"
        )
    there = [_log(Path(name), folder, logs, rigs) for name in found]
    itself = folder.resolve()
    there.sort(key=lambda one: one.path != str(itself / one.file))  # a file before any link to it
    counted: dict[tuple[object, ...], Log] = {}
    links: dict[str, str] = {}
    for one in there:
        first = counted.setdefault((_identity(one.path), one.content, one.folder), one)
        if first is not one:
            links[one.file] = first.file
    return ListedLogs(tuple(sorted(counted.values(), key=lambda one: one.file)), links)


def _log(path: Path, folder: Path, logs: Logs, rigs: Mapping[str, Rig[Any]]) -> Log:
    relative = path.relative_to(folder) if path.is_relative_to(folder) else path
    file, itself = valid_text(relative.as_posix()), path.resolve()
    try:
        size = itself.stat().st_size
    except OSError:  # the file was just deleted, so its case will fail
        size = 0
    columns = tuple(sorted(logs.columns.items()))
    return Log(file, str(itself), content_of(itself), size, columns, logs.sample_time_s, nearest_folder(file, rigs))


def _identity(path: str) -> object:
    """Return the identity of a file, which does not depend on its name."""
    try:
        found = Path(path).stat()
    except OSError:
        return path
    return (found.st_dev, found.st_ino) if found.st_ino else path


def nearest_folder(file: str, folders: Collection[str]) -> str:
    """Return which of several folders is the nearest above a file, or an empty text if none is.

    Parameters
    ----------
    file : str
        Path with slashes, like the folders.

    Examples
    --------
    >>> nearest_folder("a/b/c/run.csv", ["a", "a/b"]), nearest_folder("ab/run.csv", ["a"])
    ('a/b', '')
    """
    return max((one for one in folders if file.startswith(f"{one.rstrip('/')}/")), key=len, default="")


def read_listed(log: Log, rig: Rig[Any], required: Collection[str]) -> Record:
    """Return the run in a listed log, read with the settings of its study.

    Parameters
    ----------
    required : collection of str
        Channels that the actuator's kind needs.

    Raises
    ------
    LogError
        If it is no log, or lacks a channel.
    """
    return read_log(Path(log.path), rig.columns, dict(log.columns), required, sample_time=log.sample_time_s)
