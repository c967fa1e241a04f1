"""What `hydrostate motor-paper` does: the diaphragm-motor paper's tables, regression and linear models, checked."""

from dataclasses import asdict
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.command.json_output import json_text
from experiments.command.options import SEED, Json, Seed
from experiments.command.streams import emit

if TYPE_CHECKING:
    from rich.console import Console

commands = typer.Typer()


@commands.command("motor-paper", epilog="Example: hydrostate motor-paper --out results/motor-paper")
def motor_paper(
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Folder of the report.")] = Path(
        "results/motor-paper"
    ),
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Check the diaphragm-motor paper: Tables 1, 2, 4, 5, its regression (Figure 12), its linear models and hysteresis.

    Says what holds, what holds in one reading only, and what does not. Takes some seconds.
    The last line of standard output is the manifest's path.
    """
    from rich.console import Console

    begin = perf_counter()
    manifest = motor_paper_command(out, seed, Console(stderr=True))
    if as_json:
        emit(json_text([{"outcome": "ok", "manifest": str(manifest), "seconds": perf_counter() - begin}]))
    else:
        emit(str(manifest))


def motor_paper_command(out: Path, seed: int, console: "Console") -> Path:
    """Check the paper's numbers and write tables, figures and report.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced whole if it holds an earlier study.
    seed : int
        Seed of every noise.
    console : rich.console.Console
        Where progress goes.

    Returns
    -------
    Path
        The manifest, ``manifest.json``; the report stands beside it as ``report.html``.

    Raises
    ------
    HydrostateError
        If the folder cannot be written, or holds something that is not a study.
    """
    from experiments.figures.tables import figure_files
    from experiments.report.motor_paper import MOTOR_PAPER_FIGURES, render_motor_paper
    from experiments.store import check_target, write_tables
    from experiments.studies.motor_paper import motor_paper_tables
    from plant.diaphragm_motor_parameters import DiaphragmMotorParameters
    from plant.hysteresis_model import HysteresisParameters
    from plant.vibration_model import VibrationParameters

    check_target(out)
    with console.status("computing the paper's numbers anew"):
        tables = motor_paper_tables(seed)
        figures = figure_files(MOTOR_PAPER_FIGURES, tables)
    files = {"report.html": render_motor_paper(tables, figures["svg"]).encode()}
    files |= {f"figures/{name}.{kind}": image for kind, images in figures.items() for name, image in images.items()}
    manifest = {
        "study": "motor-paper",
        "settings": {"seed": seed},
        "parameters": {
            "motor": asdict(DiaphragmMotorParameters()),
            "vibration": asdict(VibrationParameters()),
            "hysteresis": asdict(HysteresisParameters()),
        },
    }
    return write_tables(tables, manifest, out, files)
