"""The common part of `estimate` and `diagnose` for all kinds of actuator."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from experiments.actuators import DEFAULT, infer_kind
from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import catch_and_repeat_warnings, finish, read_log, run_logs, with_remarks
from experiments.command.options import load_actuator, load_columns, options_of_kind, require_positive
from experiments.command.output_paths import page_place, paths_by_owner, require_place
from experiments.command.pages import Pages
from experiments.command.terminal import clauses, note
from plant.errors import HydrostateError, NoChannelError, require_known

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.finding import Finding
    from experiments.actuator_kind import LogVerb
    from plant.eha.rig import Rig
    from plant.log.record import Record

COMMON_OPTIONS = frozenset(
    {"logs", "plant", "rig", "columns", "report", "out", "seed", "as_json", "sample_time", "beside"}
)
"""Options that apply to every kind of actuator."""

DEFAULT_RIG_ADVICE = (
    "no --rig: the paper's actuator is assumed; if yours is another one, `hydrostate rig init rig.toml{plant}` writes "
    "a file to fill in"
)
UNFILLED_RIG_ADVICE = "{rig}: its parameters are those of the paper's actuator; if yours is another one, enter them"


@dataclass(frozen=True)
class _Question:
    """A verb, applied to the logs of one kind of actuator.

    Parameters
    ----------
    options : Mapping[str, Any]
        Options in the form used by the kind.
    rig, prepared : Rig, Any
        The kind's prepared rig and options.
    about : Mapping[str, Any]
        Entries common to all logs.
    of_the_paper : bool
        Whether no details of the actuator were given, neither a rig file nor its contents.
    """

    chosen: "LogVerb"
    options: Mapping[str, Any]
    rig: "Rig[Any]"
    prepared: Any
    read: "Callable[..., Record]"
    about: Mapping[str, Any]
    of_the_paper: bool

    @classmethod
    def of(cls, context: typer.Context, verb: str, asked: Mapping[str, Any], plant: str | None) -> "_Question":
        """Return the verb for a kind of actuator; raises a HydrostateError if an option does not apply to it."""
        diagnosing = verb == "diagnose"
        kind, bench = load_actuator(plant, asked["rig"])
        options = options_of_kind(context, asked, kind, verb, COMMON_OPTIONS | ({"condition"} if diagnosing else set()))
        require_place("--figure", options.get("figure"), ".png")
        expected: str | None = asked["condition"] if diagnosing else None
        if expected is not None:
            require_known("--condition", expected, kind.conditions)
        columns, sample_time = load_columns(asked["columns"]), asked.get("sample_time")
        require_positive("--sample-time", sample_time, "s")
        read = partial(
            read_log, rig_columns=bench.columns, columns=columns, required=kind.required, sample_time=sample_time
        )
        if options.get("healthy") is not None:
            options["healthy"] = read(options["healthy"])
        chosen: LogVerb = getattr(kind, verb)
        rig, prepared = chosen.prepare(bench, {**options, "seed": asked["seed"]})
        about = {"plant": kind.name, "rig": bench.name, "seed": asked["seed"], "expected": expected}
        about |= {"condition": options["condition"]} if "condition" in options else {}
        return cls(chosen, options, rig, prepared, read, about, bench.parameters == type(bench.parameters)())


def run_log_verb(context: typer.Context, verb: str, doing: str, asked: Mapping[str, Any]) -> NoReturn:
    """Run the verb on the logs, print the results, and exit with the exit code.

    Raises
    ------
    HydrostateError
        If an option is unknown, does not apply to the kind of actuator, or is not usable.
    """
    question = _Question.of(context, verb, asked, asked["plant"])
    logs, beside = asked["logs"], asked.get("beside") or ()
    if beside and len(logs) > 1:
        raise HydrostateError("--with goes with one log, got several")
    report = page_place(asked.get("report"))
    prepare_output(asked["out"], logs)
    figures, pages = paths_by_owner(question.options.get("figure"), logs), Pages(paths_by_owner(report, logs))
    questions = {question.about["plant"]: question}

    def read(log: Path) -> "tuple[_Question, Record]":
        from plant.log.files import open_log

        tables = open_log(log)
        try:
            return question, question.read(tables, beside=beside)
        except NoChannelError as error:
            name = infer_kind(error, asked["plant"], asked["rig"])
            if name != question.about["plant"]:
                note(f"{log}: read as a log of the kind {name}, by its columns; --plant names another kind")
            if name not in questions:
                questions[name] = _Question.of(context, verb, asked, name)
            return questions[name], questions[name].read(tables, beside=beside)

    def work(log: Path) -> Result:
        with catch_and_repeat_warnings() as said:
            of, record = read(log)
        found = of.chosen.run(record, of.rig, of.prepared)
        result: dict[str, Any] = {**of.chosen.blank, **of.about, **of.chosen.entries(found)}
        result["message"] = clauses([result["message"], *_agreement(result, found)])
        if log in figures and of.chosen.figure is not None:
            of.chosen.figure(found, log.name, figures[log])
        if log in pages.places:
            told = with_remarks({"file": str(log), **result}, said)
            pages.write(log, page_of(of.chosen, told, found, record, of.rig))
        return result

    def of_each_kind(results: Sequence[Result]) -> "Iterator[tuple[_Question, list[Result]]]":
        for name, one in questions.items():
            if own := [result for result in results if result["plant"] == name]:
                yield one, own

    batch = run_logs(logs, work, {**question.chosen.blank, **question.about}, doing)
    for one, results in of_each_kind(batch.results):
        if one.of_the_paper and any(result["outcome"] != "failed" for result in results):
            note(_rig_advice(asked["rig"], one.about["plant"]))
        for remark in one.chosen.remarks(results):
            note(remark)
    pages.tell()

    def screen(results: Sequence[Result]) -> "Iterator[RenderableType]":
        for one, own in of_each_kind(results):
            yield from one.chosen.screen(own, one.options)

    finish(batch, screen, as_json=asked["as_json"], out=asked["out"], lost=bool(pages.unwritten))


def _rig_advice(rig: "Path | None", plant: str) -> str:
    """Return advice for a log without a rig file."""
    if rig is not None:
        return UNFILLED_RIG_ADVICE.format(rig=rig)
    return DEFAULT_RIG_ADVICE.format(plant="" if plant == DEFAULT else f" --plant {plant}")


def _agreement(result: Result, found: "Finding") -> list[str]:
    """Return whether the condition is the expected one, if one was given."""
    if result["expected"] is None or result["condition"] is None:
        return []
    return ["as expected" if result["expected"] in found.named else f"{result['expected']} was expected"]


def page_of(chosen: "LogVerb", result: Result, found: "Finding", record: "Record", bench: "Rig[Any]") -> str:
    """Return the page of a log: that of its kind of actuator, or the common one.

    Parameters
    ----------
    result : Mapping
        Entries of the log, with ``file`` and ``rig``.
    bench : Rig
        What the log was compared with; the page lists its entries.
    """
    from experiments.log_pages.finding_page import finding_page
    from experiments.page.rig_table import rig_rows

    return (chosen.page or finding_page)({**result, "rig_rows": rig_rows(bench)}, found, record)
