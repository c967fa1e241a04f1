"""`hydrostate inspect FILE...`: contents of an unknown log, the meaning of its columns, and a block that names them."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.actuators import actuator
from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import finish, run_logs
from experiments.command.options import Beside, Json, Out, Plant, SampleTime, argument, option
from experiments.command.output_paths import page_place, paths_by_owner, require_place
from experiments.command.pages import Pages
from experiments.command.terminal import note, table
from experiments.command.visible_text import visible, visible_name
from experiments.log_pages.inspected import BLANK, clock_sentence, columns_block, guessed_units, inspect_log
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from experiments.actuator_kind import ActuatorKind

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
    the printed options to one command. Check the units that the file does not give.
    """
    if plant is not None:
        actuator(plant)

    def work(log: Path) -> Result:
        found, tables = inspect_log(log, plant, sample_time, beside or ())
        if log in pages.places:
            from experiments.log_pages.inspect_page import inspect_page

            pages.write(log, inspect_page({"file": str(log), **found}, tables))
        if write is not None:
            _write_rig(write, found, actuator(found["plant"]))
            run = f"check units and parameters, then run: hydrostate diagnose {log} --rig {write}"
            note(f"{write}: {run if found['reads'] else 'the log cannot be diagnosed with it; the last line says why'}")
        return {"outcome": "ok", **found}

    if (write is not None or beside) and len(logs) > 1:
        raise HydrostateError("--write and --with go with one file, got several")
    pages = Pages(paths_by_owner(page_place(report), logs))
    require_place("--write", write, ".toml")
    if write is not None and write.exists():
        raise HydrostateError(f"--write {write}: the file exists already and is not overwritten; give another name")
    prepare_output(out, logs)
    batch = run_logs(logs, work, BLANK, "looking")
    pages.tell()
    finish(batch, _screen, as_json=as_json, out=out, lost=bool(pages.unwritten))


def _write_rig(path: Path, found: Mapping[str, Any], kind: "ActuatorKind") -> None:
    from plant.eha.rig import rig_template, write_rig_template

    text = rig_template(kind.parameters, kind.name, {})
    write_rig_template(path, text.replace("[columns]", _columns_block(found)))


def _columns_block(found: Mapping[str, Any]) -> str:
    return columns_block(found["columns"], guessed_units(found["tables"]))


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    for result in results:
        yield visible_name(result["file"])
        for one in result["tables"]:
            yield _columns_table(one)
            yield clock_sentence(one)
        yield ""
        yield (
            visible(_columns_block(result))
            if result["columns"]
            else "no column was recognised; name the columns yourself"
        )
        if named := guessed_units(result["tables"]):
            yield visible(f"check the unit of {', '.join(name for _, name in named)}: the file gives no known one")
        yield ""
        if result["options"]:
            yield visible(f"or add to one command: {result['options']}")
        yield visible(str(result["message"]))


def _columns_table(one: Mapping[str, Any]) -> "RenderableType":
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
