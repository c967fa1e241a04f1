"""`hydrostate inspect FILE...`: what a strange log holds, which column is which, and the block that names them."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import Result, plain, prepare_output, write_whole
from experiments.command.logs import caught, finish, read_log, run_logs
from experiments.command.options import Beside, Json, Out, Plant, SampleTime, argument, load_actuator, option
from experiments.command.output_paths import own_paths, page_place, require_place
from experiments.command.terminal import note, sparkline, table, visible
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.log_checks.channel_guess import ChannelGuess
    from experiments.actuator_kind import ActuatorKind
    from plant.eha.rig import Rig
    from plant.log.inspection import TableFacts

BLANK: Result = dict.fromkeys(("tables", "columns", "options", "reads"))

PLOTTED = 24
"""Characters of a plot on the terminal."""

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate inspect bench.tdms --report bench.html --write rig.toml")
def inspect(
    logs: Annotated[
        list[Path],
        argument(
            "FILE",
            "Logs: text with any delimiter, Parquet, Feather, MAT; with hydrostate[bench] XLSX, TDMS, MDF, HDF5.",
        ),
    ],
    report: Annotated[
        Path | None,
        option(
            "FILE",
            "Write a page (HTML) with a drawing of every column; several logs get one page each.",
            "--report",
            "--html",
        ),
    ] = None,
    write: Annotated[Path | None, option("FILE", "Write a new rig file that names the columns.")] = None,
    beside: Beside = None,
    sample_time: SampleTime = None,
    plant: Plant = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Show what a log contains: columns with unit, range and gaps, the clock, and the likely channel of each column.

    The guess uses names, units and physics: time increases, the slope of position is velocity, pressure follows the
    motion. Each guess has a probability and reasons. Copy the block at the end into a rig file (or use --write), or add
    the printed options to one command. Check every unit that is marked as guessed.
    """
    kind, rig = load_actuator(plant, None)

    def work(log: Path) -> Result:
        found, tables = looked_into(log, kind, rig, sample_time, beside or ())
        if log in pages:
            from experiments.log_pages.inspect_page import inspect_page

            write_whole(pages[log], inspect_page({"file": str(log), **found}, tables), "--report")
        if write is not None:
            _write_rig(write, found["columns"], kind)
            note(f"{write}: check units and parameters, then run: hydrostate diagnose {log} --rig {write}")
        return {"outcome": "ok", **found}

    if (write is not None or beside) and len(logs) > 1:
        raise HydrostateError("--write and --with go with one file, got several")
    pages = own_paths(page_place(report), logs)
    require_place("--write", write)
    prepare_output(out)
    batch = run_logs(logs, work, BLANK, "looking")
    finish(batch, _screen, as_json=as_json, out=out)


def looked_into(
    log: Path, kind: "ActuatorKind", rig: "Rig[Any]", sample_time: float | None = None, beside: Sequence[Path] = ()
) -> "tuple[dict[str, Any], list[TableFacts]]":
    """Return what a log holds, as entries of the JSON contract, and its tables.

    Parameters
    ----------
    sample_time : float, optional
        Time between rows [s] of a log that has no time.
    beside : sequence of Path
        Files of other loggers of the same test.

    Raises
    ------
    LogError
        If a file cannot be opened.
    """
    tables, guesses = _looked_at([log, *beside], kind, rig)
    columns = {one.guess.channel: one.guess.spec for one in guesses if one.guess.sure >= 0.5}
    reads = _reads(log, columns, kind, sample_time, beside)
    found = _entries(tables, guesses, columns) | {"reads": reads["reads"], "message": reads["message"]}
    found["options"] = _options(columns, sample_time, beside)
    return found, tables


def _looked_at(
    paths: Sequence[Path], kind: "ActuatorKind", rig: "Rig[Any]"
) -> "tuple[list[TableFacts], list[ChannelGuess]]":
    """Return what the files hold, and the surest guess of each channel over all their tables."""
    from estimation.log_checks.channel_guess import guess_channels
    from plant.eha.model import EhaParameters
    from plant.log.columns import TIME
    from plant.log.formats import open_tables
    from plant.log.inspection import inspect_table

    p = rig.parameters if isinstance(rig.parameters, EhaParameters) else EhaParameters()
    tables = [inspect_table(one) for path in paths for one in open_tables(path)]
    best: dict[str, ChannelGuess] = {}
    for facts in tables:
        headings = [one.heading for one in facts.columns]
        for one in guess_channels(headings, facts.numbers, p, (TIME, *kind.channels)):
            known = best.get(one.guess.channel)
            if known is None or one.guess.sure > known.guess.sure:
                best[one.guess.channel] = one
    return tables, list(best.values())


def inspected(paths: Sequence[Path], plant: str | None = None) -> dict[str, Any]:
    """Return what files of one test hold, as JSON values.

    Parameters
    ----------
    paths : sequence of Path
        The files, one a logger.
    plant : str, optional
        The kind of actuator; the gear-pump actuator if not given.

    Raises
    ------
    LogError
        If one cannot be opened.
    """
    kind, rig = load_actuator(plant, None)
    tables, guesses = _looked_at(paths, kind, rig)
    return plain(_entries(tables, guesses, {one.guess.channel: one.guess.spec for one in guesses}))


def _reads(
    log: Path, columns: Mapping[str, str], kind: "ActuatorKind", sample_time: float | None, beside: Sequence[Path]
) -> dict[str, Any]:
    """Return whether the log is read by the block of columns, and what is said then."""
    try:
        with caught() as said:
            record = read_log(log, {}, columns, kind.required, sample_time=sample_time, beside=beside)
    except HydrostateError as error:
        return {"reads": False, "message": f"with these columns the log cannot be read: {error.message}"}
    notes = "; ".join(dict.fromkeys(str(one.note) for one in said))
    about = f"{record.duration:g} s at {1.0 / record.sample_time:g} Hz, {', '.join(record)}"
    return {"reads": True, "message": f"with these columns the log reads: {about}" + (f"; {notes}" if notes else "")}


def _entries(
    tables: "Sequence[TableFacts]", guesses: "Sequence[ChannelGuess]", columns: Mapping[str, str]
) -> dict[str, Any]:
    from plant.log.columns import TIME
    from plant.log.inspection import clock_facts

    by_name = {one.guess.name: one for one in guesses}
    shown: list[dict[str, Any]] = []
    for facts in tables:
        rows: list[dict[str, Any]] = []
        for number, one in enumerate(facts.columns, start=1):
            guess = by_name.get(one.heading.name)
            rows.append(
                {
                    "number": number,
                    "name": one.heading.name,
                    "unit": one.heading.unit,
                    "range": one.span,
                    "missing": one.missing,
                    "kind": "text" if one.values is None else "times" if one.heading.stamped else "numbers",
                    "plot": sparkline(one.present.tolist(), PLOTTED),
                    "channel": None if guess is None else guess.guess.channel,
                    "probability": None if guess is None else guess.guess.sure,
                    "why": [] if guess is None else [one.to_dict() for one in guess.why],
                }
            )
        time = next((one for one in guesses if one.guess.channel == TIME), None)
        stamps = None if time is None else facts.numbers.get(time.guess.place)
        clock = None if stamps is None else clock_facts(stamps)
        shown.append(
            {
                "label": facts.table.label,
                "rows": facts.rows,
                "step_s": facts.table.step,
                "clock": None if clock is None else vars(clock),
                "columns": rows,
            }
        )
    return {"tables": shown, "columns": dict(columns)}


def _options(columns: Mapping[str, str], sample_time: float | None, beside: Sequence[Path]) -> str:
    """Return the options that read the log as the block does."""
    import shlex

    parts = [shlex.quote(f"{channel}={spec}") for channel, spec in columns.items()]
    told = [f"--columns {part}" for part in parts] + [f"--with {shlex.quote(str(one))}" for one in beside]
    return " ".join(told + ([] if sample_time is None else [f"--sample-time {sample_time:g}"]))


def block_of(columns: Mapping[str, str]) -> str:
    """Return the ``[columns]`` block of a rig file.

    Parameters
    ----------
    columns : Mapping[str, str]
        Column with its unit, by channel.

    Returns
    -------
    str
        TOML.
    """
    return "\n".join(
        ["[columns]", *(f"{channel} = {json.dumps(spec, ensure_ascii=True)}" for channel, spec in columns.items())]
    )


def _write_rig(path: Path, columns: Mapping[str, str], kind: "ActuatorKind") -> None:
    from plant.eha.rig import rig_template, write_rig_template

    text = rig_template(kind.parameters, kind.name, {})
    write_rig_template(path, text.replace("[columns]", block_of(columns)))


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    for result in results:
        yield visible(str(result["file"]))
        for one in result["tables"]:
            yield _shown(one)
            yield _clock_sentence(one)
        yield ""
        yield (
            visible(block_of(result["columns"]))
            if result["columns"]
            else "no column was recognised; name the columns yourself"
        )
        yield ""
        if result["options"]:
            yield visible(f"or add to one command: {result['options']}")
        yield visible(str(result["message"]))


def _shown(one: Mapping[str, Any]) -> "RenderableType":
    title = visible(f"{one['label'] or 'columns'}: {one['rows']} rows")
    made = table(
        "no.", "column", "unit", "from", "to", "missing", "plot", "channel?", "sure [%]", "because", title=title
    )
    for row in one["columns"]:
        low, high = ("", "") if row["range"] is None else (f"{end:.5g}" for end in row["range"])
        low = row["kind"] if row["kind"] != "numbers" else low
        sure = "" if row["probability"] is None else f"{100.0 * row['probability']:.0f}"
        why = "; ".join(one["text"] for one in row["why"])
        cells = (row["name"][:60], row["unit"] or "", low, high, str(row["missing"] or ""), row["plot"])
        made.add_row(str(row["number"]), *map(visible, cells), row["channel"] or "", sure, visible(why))
    return made


def _clock_sentence(one: Mapping[str, Any]) -> str:
    clock = one["clock"]
    if clock is None:
        step = one["step_s"]
        without = "no column holds the time: give the time between rows with --sample-time S"
        return f"the file gives a step of {step:g} s" if step else without
    flaws = [f"{clock[name]} {said}" for name, said in (("gaps", "gaps"), ("repeats", "repeats")) if clock[name]]
    if clock["backward"]:
        flaws.append(f"{clock['backward']} steps back")
    if clock["jitter"] > 1e-3:
        flaws.append(f"jitter of {100.0 * clock['jitter']:.2g} % of a step")
    return f"clock: steps of {clock['step']:.6g} in the column's unit; {', '.join(flaws) or 'no gaps'}"
