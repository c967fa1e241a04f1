"""`hydrostate library`: the nine-condition library, shown, or built anew with a report on how it was chosen."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.command.json_output import Result, json_text
from experiments.command.logs import Batch, finish
from experiments.command.options import SEED, Json, Seed
from experiments.command.streams import emit, table
from plant.errors import HydrostateError

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console, RenderableType

    from estimation.identification.linear_model import LinearModel

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate library --out results/library --seed 2024")
def library(
    file: Annotated[
        Path | None,
        typer.Argument(metavar="FILE", help="A library to show; the one that ships unless given.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="DIR", help="Build it anew, into this folder.")
    ] = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Show the library of nine transfer functions beside Table 6, or build it anew with its report.

    From motor speed [rad/s] to velocity [m/s] at 1 ms, one a condition, identified on the circuit plant. With `--out`
    the folder gets `library.json`, and a report that compares ARX, ARMAX, output error and Box-Jenkins on all nine,
    orders and break frequencies beside the paper's, and clocks of the test; its path is the last line of standard
    output. That takes half a minute; the seed changes nothing else.
    """
    if out is None:
        _show(file, seed, as_json)
        return
    if file is not None:
        raise HydrostateError(f"a library is shown or built, got both {file} and --out {out}")
    from rich.console import Console

    begin = perf_counter()
    report = build_report(out, seed, Console(stderr=True))
    done = {"outcome": "ok", "report": str(report), "seconds": perf_counter() - begin}
    emit(json_text([done]) if as_json else str(report))


def _show(file: Path | None, seed: int, as_json: bool) -> None:
    from experiments.studies.identification_library import read_library
    from experiments.studies.library_tables import library_table

    models = read_library(file)
    rows = library_table(models).to_dict("records")
    results = tuple(
        {"outcome": "ok", **{str(key): value for key, value in row.items()}, **model.to_dict(), "seed": seed}
        for row, model in zip(rows, models.values(), strict=True)
    )
    finish(Batch(results, len(results)), _screen, as_json=as_json, out=None)


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table(
        "condition", "order [count]", "gain [mm/s per rad/s]", "Table 6", "3 dB down [Hz]", "Table 6", "fit [%]"
    )
    for row in results:
        printed = f"{1e3 * row['published_gain_low']:.3f} to {1e3 * row['published_gain_high']:.3f}"
        published = row["published_bandwidth_hz"]
        shown.add_row(
            row["condition"],
            str(len(row["denominator"]) - 1),
            f"{1e3 * row['dc_gain']:.4f} ± {1e3 * row['dc_gain_std']:.4f}",
            printed,
            f"{row['bandwidth_hz']:.3g}",
            "-" if published is None or published != published else f"{published:.3g}",
            f"{row['fit_percent']:.1f}",
        )
    yield shown
    yield "Gains ± one standard deviation; Table 6's as its four digits leave them open, at the inferred 1 ms."


def library_tables(models: "dict[str, LinearModel]", seed: int, console: "Console") -> "dict[str, pd.DataFrame]":
    """Return what is said of a library, table by table.

    Parameters
    ----------
    models : dict[str, LinearModel]
        By condition.
    seed : int
        Seed of every random stream.
    console : rich.console.Console
        Where progress goes.

    Returns
    -------
    dict[str, pandas.DataFrame]
        ``library``, ``roots``, ``responses``, ``structures``, ``orders`` and ``clocks``.
    """
    from rich.progress import track

    from estimation.identification.input_design import Limits
    from experiments.studies.identification_structures import clock_table, order_and_bandwidth, structure_table
    from experiments.studies.library_tables import library_table, response_table, root_table
    from plant.circuit_parameters import CircuitParameters

    rig = CircuitParameters()
    limits = Limits(rig.rated_speed, stroke=rig.stroke)
    makers = {
        "library": lambda: library_table(models),
        "roots": lambda: root_table(models),
        "responses": lambda: response_table(models),
        "structures": lambda: structure_table(rig, models, seed),
        "orders": lambda: order_and_bandwidth(rig, models, seed),
        "clocks": lambda: clock_table(models["major_leakage"], limits, seed).reset_index(),
    }
    return {name: make() for name, make in track(makers.items(), "looking at it", console=console)}


def build_report(out: Path, seed: int, console: "Console") -> Path:
    """Build the library, and write it with its tables, figures and report.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced whole if it holds an earlier study.
    seed : int
        Seed of every random stream.
    console : rich.console.Console
        Where progress goes.

    Returns
    -------
    Path
        The report.

    Raises
    ------
    HydrostateError
        If the folder cannot be written, or holds something that is not a study.
    """
    from experiments.figures.library import LIBRARY_FIGURES
    from experiments.figures.tables import figure_files
    from experiments.report.library import render_library_report
    from experiments.store import check_target, write_tables
    from experiments.studies.identification_library import build_library, library_models, library_text

    check_target(out)
    with console.status("identifying nine conditions"):
        built = build_library(seed)
    tables = library_tables(library_models(built), seed, console)
    figures = figure_files(LIBRARY_FIGURES, tables)
    files = {
        "library.json": library_text(built).encode(),
        "report.html": render_library_report(tables, figures["svg"], seed).encode(),
        **{f"figures/{name}.{kind}": image for kind, images in figures.items() for name, image in images.items()},
    }
    write_tables(tables, {"study": "library", "settings": {"seed": seed}}, out, files)
    return out / "report.html"
