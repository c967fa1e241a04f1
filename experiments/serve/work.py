"""The work on a log, in a process that may be killed at any time: it writes a complete page, or none at all."""

import errno
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from experiments.actuators import infer_kind
from experiments.command.json_output import plain
from experiments.command.log_verb import page_of
from experiments.command.logs import catch_and_repeat_warnings, catch_log_warnings, read_log, with_remarks
from experiments.command.terminal import clauses, error_sentence
from experiments.log_pages.comparison import plain_words
from experiments.page.sentences import sentence
from experiments.serve.process import bind_to_server
from experiments.serve.rigs import load_actuator_of_log, rig_of
from plant.atomic import replacing
from plant.errors import HydrostateError, MissingColumnError, NoChannelError

if TYPE_CHECKING:
    from experiments.actuator_kind import ActuatorKind, LogVerb
    from plant.eha.rig import Rig

    _Tools: TypeAlias = tuple[ActuatorKind, Rig[Any], LogVerb, Rig[Any], Any]

READING, WORKING, WRITING = "reading the log", "working it out", "writing the page"
"""Steps of the work on a log."""

OTHER_NAMES_ADVICE = (
    "if the log has them under other names, choose inspect and drop it again: its page gives the lines that the rig "
    "file on the server must have"
)
"""Advice for a log rejected because of its columns, for users without a command line."""

INSPECTION_MESSAGES: Mapping[bool, str] = {
    True: "The log can be read with the columns that its page names.",
    False: "The columns that could be guessed are too few to read the log; its page shows them.",
}
"""Result of an inspection, by whether the log can be read with the guessed columns."""

DISK_FULL = "the disk of the server is full: make room, then choose Again"

PAGE_MISSING = "Its page could not be written, because the disk of the server is full: make room, then choose Again."

NO_MEMORY = 77
"""Exit code of a process whose log needed more memory than there is. The process ends, since the memory that it still
holds would be missing for the next log."""


@dataclass(frozen=True)
class Task:
    """A log to be processed.

    Parameters
    ----------
    log : Path
        File of the log.
    name : str
        Name given by the client.
    page : Path
        Path for its page.
    phase : Path
        File that holds the current step of the work.
    plant, rig, columns : str or None, Path or None, tuple of tuple
        From the server's settings; columns are pairs of channel and foreign column.
    rigs, pattern : Path or None, str or None
        Likewise: folder of rig files, and the pattern of log names.
    """

    log: Path
    name: str
    verb: str
    page: Path
    phase: Path
    plant: str | None
    rig: Path | None
    columns: tuple[tuple[str, str], ...]
    rigs: Path | None = None
    pattern: str | None = None


@dataclass(frozen=True)
class LogResult:
    """The result of a log.

    Parameters
    ----------
    result : Mapping
        Entries of the JSON contract.
    entries : Mapping or None
        Entries of a batch row, if the log was diagnosed.
    said : str
        The result in one sentence, if it differs from its ``message``.
    """

    result: Mapping[str, Any]
    entries: Mapping[str, Any] | None
    said: str = ""


def begin_worker(server: int, memory: int) -> None:
    """Make a process end with its server, and limit its memory.

    Parameters
    ----------
    server : int
        Process ID of the server.
    memory : int
        Largest memory that the process may request [bytes].
    """
    bind_to_server(server)
    os.environ["ARROW_DEFAULT_MEMORY_POOL"] = "system"  # other pools reserve 1 GiB, which counts towards the limit
    if sys.platform == "linux":
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def process_log(task: Task) -> LogResult:
    """Analyse a log and write its page.

    Returns
    -------
    LogResult
        With the outcome ``failed`` if the log cannot be used. If memory is insufficient, the process ends with
        `NO_MEMORY` instead.
    """
    blank: Mapping[str, Any] = {}
    with catch_log_warnings() as said:
        try:
            tell_phase(task.phase, READING)
            blank = _blank_entries(task)
            worked = _inspect(task) if task.verb == "inspect" else _analyse(task)
        except MemoryError:
            os._exit(NO_MEMORY)
        except (MissingColumnError, NoChannelError) as error:
            worked = _failed(task, blank, f"{error.bare}; {OTHER_NAMES_ADVICE}")
        except HydrostateError as error:
            worked = _failed(task, blank, error.message if error.source == str(task.log) else str(error))
        except Exception as error:  # report any error of a log to its sender
            worked = _failed(task, blank, DISK_FULL if _is_full(error) else error_sentence(error))
    result = plain({"file": task.name, **with_remarks(worked.result, said)})
    said = worked.said or plain_words(result) or sentence(str(result.get("message") or ""))
    if result["outcome"] != "failed" and not task.page.exists():
        said = f"{said} {PAGE_MISSING}"
    entries = _without_path(plain(worked.entries), task)
    return LogResult(_without_path(result, task), entries, _without_path(said, task))


def tell_phase(path: Path, step: str) -> None:
    """Tell the server the current step of the work on a log.

    The file is changed but never made: if the log was deleted meanwhile, nothing is left of it.
    """
    with suppress(OSError), path.open("r+b") as file:
        file.write(step.encode())
        file.truncate()


def _analyse(task: Task) -> LogResult:
    own = _rig(task)
    kind, bench, chosen, rig, prepared = _tools_of(task, own)
    with catch_and_repeat_warnings() as said:
        try:
            record = read_log(task.log, bench.columns, dict(task.columns), kind.required)
        except NoChannelError as error:
            meant = infer_kind(error, task.plant, own)
            kind, bench, chosen, rig, prepared = _prepared_tools(meant, None, None, 0, task.verb)
            record = read_log(task.log, bench.columns, dict(task.columns), kind.required)
    tell_phase(task.phase, WORKING)
    found = chosen.run(record, rig, prepared)
    result = {**chosen.blank, "plant": kind.name, "rig": bench.name, **chosen.entries(found)}
    tell_phase(task.phase, WRITING)
    _write(task, page_of(chosen, with_remarks({"file": task.name, **result}, said), found, record, bench))
    if task.verb != "diagnose":
        return LogResult(result, None)
    if kind.name == "eha":
        from experiments.batch.diagnosis import class_row as row
    else:
        from experiments.batch.other_actuators import finding_row as row
    return LogResult(result, dict(row(found)))


def _inspect(task: Task) -> LogResult:
    from experiments.log_pages.inspect_page import inspect_page
    from experiments.log_pages.inspected import inspect_log

    found, tables = inspect_log(task.log, task.plant)
    tell_phase(task.phase, WRITING)
    _write(task, inspect_page({"file": task.name, **found}, tables))
    return LogResult({"outcome": "ok", **found}, None, INSPECTION_MESSAGES[bool(found["reads"])])


def _rig(task: Task) -> Path | None:
    return rig_of(task.name, task.pattern, task.rigs, task.rig)


def _tools_of(task: Task, rig: Path | None) -> "_Tools":
    try:
        changed = 0 if rig is None else rig.stat().st_mtime_ns
    except OSError:  # reading it will report the reason
        changed = 0
    return _prepared_tools(task.plant, rig, task.rig, changed, task.verb)


@lru_cache(maxsize=128)
def _prepared_tools(plant: str | None, rig: Path | None, others: Path | None, changed: int, verb: str) -> "_Tools":
    """Return the function that processes a log; a rig file is identified by when it was `changed` [ns since 1970]."""
    del changed
    from experiments.actuators import verb_of_kind

    kind, bench = load_actuator_of_log(plant, rig, others)
    chosen = verb_of_kind(kind, verb)
    return kind, bench, chosen, *chosen.prepare(bench, {**chosen.options, "seed": 0})


def _blank_entries(task: Task) -> Mapping[str, Any]:
    if task.verb == "inspect":
        from experiments.log_pages.inspected import BLANK

        return BLANK
    kind, bench, chosen, *_ = _tools_of(task, _rig(task))
    return {**chosen.blank, "plant": kind.name, "rig": bench.name}


def _failed(task: Task, blank: Mapping[str, Any], message: str) -> LogResult:
    entries = {"outcome": "failed", "reason": message} if task.verb == "diagnose" else None
    return LogResult({**blank, "outcome": "failed", "message": clauses([message])}, entries)


def _is_full(error: Exception) -> bool:
    return isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT)


def _write(task: Task, page: str) -> None:
    """Write the page of a log. If the disk is full, it is left out, and the result is kept."""
    try:
        with replacing(task.page) as file:
            file.write(page.encode())
    except OSError as error:
        if not _is_full(error):
            raise
        task.page.unlink(missing_ok=True)  # it would be that of an earlier result
    if not task.log.exists():  # the log and its results were deleted meanwhile
        task.page.unlink(missing_ok=True)


def _without_path(value: Any, task: Task) -> Any:
    """Return entries in which the log has the client's name, and no path on this machine."""
    if isinstance(value, str):
        for folder in {one for one in (task.rig and task.rig.parent, task.rigs) if one}:
            value = value.replace(f"{folder}{os.sep}", "")
        return value.replace(str(task.log), task.name).replace(task.log.name, task.name)
    if isinstance(value, dict):
        return {key: _without_path(one, task) for key, one in value.items()}
    return [_without_path(one, task) for one in value] if isinstance(value, list) else value
