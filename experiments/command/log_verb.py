"""The body of `estimate` and `diagnose`, the same for every kind of actuator."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from experiments.command.json_output import Result, prepare_output, write_whole
from experiments.command.logs import finish, overheard, read_log, run_logs, with_remarks
from experiments.command.options import load_actuator, load_columns, understood
from experiments.command.output_paths import own_paths, page_place, pages_sentence, require_place
from experiments.command.terminal import clauses, note
from plant.errors import HydrostateError, require_known

if TYPE_CHECKING:
    from estimation.finding import Finding
    from experiments.actuator_kind import LogVerb
    from plant.log.record import Record

COMMON = frozenset({"logs", "plant", "rig", "columns", "report", "out", "seed", "as_json", "sample_time", "beside"})
"""Options of every kind of actuator."""


class _Pages:
    """Pages of logs: where each goes, which are written, and why others are not."""

    def __init__(self, places: Mapping[Path, Path]) -> None:
        self.places = places
        self.written: list[Path] = []
        self.unwritten: list[str] = []

    def write(self, log: Path, page: str) -> None:
        """Write a log's page; what cannot be written is told in the end, for the answer is shown all the same."""
        try:
            write_whole(self.places[log], page, "--report")
            self.written.append(self.places[log])
        except HydrostateError as error:
            self.unwritten.append(str(error))

    def told(self) -> list[str]:
        """Return what to tell of them: where they are, then each that is missing."""
        return [*([pages_sentence(self.written)] if self.written else []), *self.unwritten]


def run_log_verb(context: typer.Context, verb: str, doing: str, asked: Mapping[str, Any]) -> NoReturn:
    """Find what logs say, print it, and leave with the exit code.

    Parameters
    ----------
    verb : str
        ``estimate`` or ``diagnose``.
    asked : Mapping[str, Any]
        The verb's arguments by name.

    Raises
    ------
    HydrostateError
        If an option is unknown, does not go with the kind of actuator, or is not usable.
    """
    diagnosing = verb == "diagnose"
    kind, bench = load_actuator(asked["plant"], asked["rig"])
    options = understood(context, asked, kind, verb, COMMON | ({"condition"} if diagnosing else set()))
    require_place("--figure", options.get("figure"), ".png")
    chosen: LogVerb = getattr(kind, verb)
    logs, beside = asked["logs"], asked.get("beside") or ()
    read = partial(
        read_log,
        rig_columns=bench.columns,
        columns=load_columns(asked["columns"]),
        required=kind.required,
        sample_time=asked.get("sample_time"),
    )
    expected: str | None = asked["condition"] if diagnosing else None
    report = page_place(asked.get("report"))
    if expected is not None:
        require_known("--condition", expected, kind.conditions)
    if beside and len(logs) > 1:
        raise HydrostateError("--with goes with one log, got several")
    if options.get("healthy") is not None:
        options["healthy"] = read(options["healthy"])
    rig, prepared = chosen.prepare(bench, {**options, "seed": asked["seed"]})
    prepare_output(asked["out"])
    figures, pages = own_paths(options.get("figure"), logs), _Pages(own_paths(report, logs))
    about = {"plant": kind.name, "rig": bench.name, "seed": asked["seed"], "expected": expected}
    about |= {"condition": options["condition"]} if "condition" in options else {}

    def work(log: Path) -> Result:
        with overheard() as said:
            record = read(log, beside=beside)
        found = chosen.run(record, rig, prepared)
        result: dict[str, Any] = {**chosen.blank, **about, **chosen.entries(found)}
        result["message"] = clauses([result["message"], *_agreement(result, found)])
        if log in figures and chosen.figure is not None:
            chosen.figure(found, log.name, figures[log])
        if log in pages.places:
            pages.write(log, page_of(chosen, with_remarks({"file": str(log), **result}, said), found, record))
        return result

    batch = run_logs(logs, work, {**chosen.blank, **about}, doing)
    for remark in chosen.remarks(batch.results):
        note(remark)
    for sentence in pages.told():
        note(sentence)
    form: dict[str, Any] = {"as_json": asked["as_json"], "out": asked["out"], "lost": bool(pages.unwritten)}
    finish(batch, lambda results: chosen.screen(results, options), **form)


def _agreement(result: Result, found: "Finding") -> list[str]:
    """Return whether the condition is the one that was expected, where one was."""
    if result["expected"] is None or result["condition"] is None:
        return []
    return ["as expected" if result["expected"] in found.named else f"{result['expected']} was expected"]


def page_of(chosen: "LogVerb", result: Result, found: "Finding", record: "Record") -> str:
    """Return the page of a log: that of its kind of actuator, or the one that all have.

    Parameters
    ----------
    result : Mapping
        Entries of the log, with ``file`` and ``rig``.
    """
    from experiments.log_pages.finding_page import finding_page

    return (chosen.page or finding_page)(result, found, record)
