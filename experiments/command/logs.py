"""Several logs, one after the other. A log that fails is reported, and the others are still processed."""

import contextlib
import inspect
import re
import warnings
from collections.abc import Callable, Collection, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, TypeVar

import typer

from experiments.command.json_output import Result, json_text, write_results
from experiments.command.progress_bar import progress
from experiments.command.terminal import INTERRUPTED, SOME_FAILED, USAGE, emit, error_sentence, note, render_text
from plant.errors import HydrostateError, LogWarning, MissingColumnError
from plant.log.notes import LogCode
from plant.notes import distinct

if TYPE_CHECKING:
    from rich.console import RenderableType

    from plant.log.record import Record
    from plant.log.table import Table

T = TypeVar("T")

OWN_SOURCES = re.compile(re.escape(str(Path(__file__).parents[2])) + r"[/\\](plant|experiments|hydrostate\.py)")
"""Files of this project in the call stack between the log reader and the caller."""

CONTEXTS = contextlib.__file__
"""File of the standard library that runs context managers."""

Work: TypeAlias = Callable[[Path], Result]
"""Processing of one log by a command."""

Screen: TypeAlias = Callable[[Sequence[Result]], Iterable["RenderableType"]]
"""Terminal output of a command for the logs that did not fail."""


@dataclass(frozen=True)
class Batch:
    """The results of several logs."""

    results: tuple[Result, ...]
    total: int

    @property
    def done(self) -> tuple[Result, ...]:
        """The results of logs that could be used."""
        return tuple(result for result in self.results if result["outcome"] != "failed")

    @property
    def exit_code(self) -> int:
        """0 if all are done, 1 if some failed or diverged, 2 if nothing could be done, 130 if interrupted."""
        if len(self.results) < self.total:
            return INTERRUPTED
        if not self.done:
            return USAGE
        fine = all(result["outcome"] not in {"failed", "diverged"} for result in self.results)
        return 0 if fine else SOME_FAILED


def run_logs(logs: Sequence[Path], work: Work, blank: Result, what: str) -> Batch:
    """Process every log, until interrupted.

    Failures and warnings go to standard error as they occur, after the log's name.
    """
    results: list[Result] = []
    try:
        with progress(len(logs), what) as advance:
            for log in logs:
                results.append(_process_log(log, work, blank))
                advance()
    except KeyboardInterrupt:
        note(f"interrupted after {len(results)} of {len(logs)} logs")
    return Batch(tuple(results), len(logs))


@contextmanager
def catch_log_warnings() -> Generator[list[LogWarning]]:
    """Catch warnings about a log; the list contains them after the block has ended."""
    said: list[LogWarning] = []
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", LogWarning)
        try:
            yield said
        finally:
            said += [one.message for one in raised if isinstance(one.message, LogWarning)]


@contextmanager
def catch_and_repeat_warnings() -> Generator[list[LogWarning]]:
    """Catch warnings about a log as `catch_log_warnings` does, and issue them again for listeners outside."""
    said: list[LogWarning] = []
    try:
        with catch_log_warnings() as said:
            yield said
    finally:
        for one in said:
            warnings.warn(one, stacklevel=_reader_stack_level())


def _reader_stack_level() -> int:
    """Return the stack level from a warning here to the line of code that read the log."""
    frame, level = inspect.currentframe(), 0
    while frame is not None and (OWN_SOURCES.match(frame.f_code.co_filename) or frame.f_code.co_filename == CONTEXTS):
        frame, level = frame.f_back, level + 1
    return level


def read_and_warn(source: str, read: Callable[[], T]) -> T:
    """Return the log that is read; remarks on it go to standard error."""
    with catch_log_warnings() as said:
        found = read()
    for one in distinct(warning.note for warning in said):
        note(f"{source}: warning: {one}")
    return found


def with_remarks(result: Result, said: Iterable[LogWarning]) -> dict[str, Any]:
    """Return the entries of a log, with the remarks from reading it before its other warnings and notes.

    Parameters
    ----------
    result : Mapping
        Entries, with ``warnings`` and ``notes`` or without.
    said : iterable of LogWarning
        Warnings from reading; duplicates count once.
    """
    raised = distinct(one.note for one in said)
    told = list(dict.fromkeys([*map(str, raised), *result.get("warnings", ())]))
    return {**result, "warnings": told, "notes": [*(one.to_dict() for one in raised), *result.get("notes", ())]}


def _process_log(log: Path, work: Work, blank: Result) -> Result:
    names_a_file = False
    with catch_log_warnings() as said_of_it:
        try:
            result = dict(work(log))
        except HydrostateError as error:
            names_a_file = error.source not in {None, str(log)}
            result = _failure(blank, str(error) if names_a_file else error.message)
        except Exception as error:  # an error in one log must not lose the results of the others
            result = _failure(blank, error_sentence(error))
    result = with_remarks(result, said_of_it)
    for sentence in result["warnings"]:
        note(f"{log}: warning: {sentence}")
    if result["outcome"] in {"failed", "diverged"}:
        note(result["message"] if names_a_file else f"{log}: {result['message']}")
    return {"file": str(log), **result}


def _failure(blank: Result, message: str) -> dict[str, Any]:
    return {"outcome": "failed", **blank, "message": message}


def finish(batch: Batch, screen: Screen, *, as_json: bool, out: Path | None, lost: bool = False) -> NoReturn:
    """Print the results, write them if requested, and exit with the exit code.

    Parameters
    ----------
    out : Path or None
        Path to which results are also written, if there are any.
    lost : bool
        Whether another requested file could not be written, which counts as a failure.

    Raises
    ------
    typer.Exit
        Always, with the exit code.
    """
    if as_json:
        emit(json_text(batch.results))
    elif batch.done:
        emit(render_text(*screen(batch.done)))
    code = batch.exit_code or (SOME_FAILED if lost else 0)
    if out is not None and batch.results:  # if interrupted before the first log, keep the earlier results
        try:
            note(f"written: {', '.join(str(path) for path in write_results(batch.results, out))}")
        except HydrostateError as error:
            note(str(error))
            code = code or SOME_FAILED
    raise typer.Exit(code)


SAME_SAMPLE_TIME = 0.01
"""Relative difference of a given sample time from the log's up to which both are one [fraction]."""


def read_log(
    path: "Path | Table | tuple[Table, ...]",
    rig_columns: Mapping[str, str],
    columns: Mapping[str, str],
    required: Collection[str] | None = None,
    *,
    sample_time: float | None = None,
    beside: Sequence[Path] = (),
    most_missing: float | None = None,
    of_model: bool = False,
) -> "Record":
    """Read a log by the column names of a rig and of the command line, which take precedence.

    A rig names the columns of a test bench, not of every log. If a log lacks a rig's column, the channel is looked for
    under its own name, with a warning. A column given on the command line must exist.

    Parameters
    ----------
    path : Path, Table or tuple of Table
        The log's file, or an open log.
    rig_columns, columns : Mapping[str, str]
        Foreign column by channel, from the rig file and from the command line.
    required : collection of str, optional
        Channels that must exist; those of the gear-pump actuator if not given.
    sample_time : float, optional
        Time between rows [s], for a log without a time column or with times that do not increase.
    beside : sequence of Path
        Files from other loggers in the same test.
    most_missing : float, optional
        Share of the samples that may be missing [fraction]; 5 % if not given.
    of_model : bool
        Whether the sample time is that of a model to fit, which may differ from the log's.

    Raises
    ------
    LogError
        If it cannot be read or trusted.

    Warns
    -----
    LogWarning
        If a column of the rig is not in the log, or the log's time contradicts the sample time.
    """
    import warnings

    from plant.errors import LogWarning
    from plant.log.checks import REQUIRED
    from plant.log.columns import TIME
    from plant.log.files import read_record, source_of
    from plant.log.notes import LogCode
    from plant.log.plausibility import require_measurable

    wanted = REQUIRED if required is None else required
    more: dict[str, Any] = {"required": wanted}
    if sample_time is not None:
        more["sample_time"] = sample_time
    if beside:
        more["beside"] = beside
    if most_missing is not None:
        more["most_missing"] = most_missing
    record = with_rig_columns(lambda given: read_record(path, columns=given, **more), rig_columns, columns)
    require_measurable(record.channels, source_of(path))
    if sample_time is not None and not of_model and abs(record.sample_time / sample_time - 1.0) > SAME_SAMPLE_TIME:
        said = LogCode.TIME_KEPT.note(channel=TIME, asked_s=sample_time, sample_time_s=record.sample_time)
        warnings.warn(LogWarning(said, source_of(path)), stacklevel=2)
    return record


def with_rig_columns(
    read: Callable[[Mapping[str, str]], T], rig_columns: Mapping[str, str], columns: Mapping[str, str]
) -> T:
    """Read by the columns of a rig and of the command line, leaving out columns of the rig that do not exist.

    Parameters
    ----------
    read : callable
        Reads by a mapping from channels to foreign columns.
    rig_columns, columns : Mapping[str, str]
        Foreign column by channel, from the rig file and from the command line.

    Raises
    ------
    LogError
        If a column given on the command line is absent, or `read` fails for any other reason.

    Warns
    -----
    LogWarning
        If a column of the rig is absent.
    """
    absent: list[str] = []
    try:
        while True:
            kept = {channel: name for channel, name in rig_columns.items() if channel not in absent}
            try:
                return read({**kept, **columns})
            except MissingColumnError as error:
                if error.channel not in kept or error.channel in columns:
                    raise
                absent.append(error.channel)
    finally:
        if absent:
            missed = LogCode.COLUMNS_ABSENT.note(columns=", ".join(rig_columns[channel] for channel in absent))
            warnings.warn(LogWarning(missed), stacklevel=2)
