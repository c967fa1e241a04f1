"""`hydrostate library`: shows the nine-condition library, or rebuilds it with a report on how it was chosen."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.command.json_output import Result
from experiments.command.logs import Batch, finish
from experiments.command.options import SEED, Json, Seed, argument, option
from experiments.command.study_verb import finish_study
from experiments.command.terminal import table
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from rich.console import RenderableType

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate library --out results/library --seed 2024")
def library(
    file: Annotated[Path | None, argument("FILE", "Library to show; by default the one that ships.")] = None,
    out: Annotated[Path | None, option("DIR", "Build a new library into this folder.", "--out", "-o")] = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Show the library of nine transfer functions next to Table 6, or build a new one with its report.

    Each is from motor speed [rad/s] to velocity [m/s] at 1 ms, one per condition, identified on the circuit plant.
    With `--out` the folder gets `library.json` and a report. The report compares ARX, ARMAX, output error and
    Box-Jenkins on all nine conditions, shows orders and break frequencies beside the paper's, and says how fast the
    test signal should switch. This takes about a minute; the last line of standard output is the path of the report.
    """
    if out is None:
        _show(file, seed, as_json)
        return
    if file is not None:
        raise HydrostateError(f"a library is shown or built, got both {file} and --out {out}")
    from experiments.library.study import LIBRARY
    from experiments.running.study import SeedSettings

    finish_study(LIBRARY, SeedSettings(seed), out, as_json=as_json)


def _show(file: Path | None, seed: int, as_json: bool) -> None:
    from experiments.library.tables import library_table
    from experiments.published.library import read_library

    models = read_library(file)
    rows = library_table(models).to_dict("records")
    results = tuple(
        {"outcome": "ok", **{str(key): value for key, value in row.items()}, **model.to_dict(), "seed": seed}
        for row, model in zip(rows, models.values(), strict=True)
    )
    finish(Batch(results, len(results)), _screen, as_json=as_json, out=None)


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    headings = ("order [count]", "gain [mm/s per rad/s]", "Table 6", "3 dB down [Hz]", "Table 6", "fit [%]")
    shown = table("condition", *headings)
    for row in results:
        gain = f"{1e3 * row['dc_gain']:.4f} ± {1e3 * row['dc_gain_std']:.4f}"
        printed = f"{1e3 * row['published_gain_low']:.3f} to {1e3 * row['published_gain_high']:.3f}"
        published = row["published_bandwidth_hz"]
        told = "-" if published is None or published != published else f"{published:.3g}"
        order = str(len(row["denominator"]) - 1)
        bandwidths = (f"{row['bandwidth_hz']:.3g}", told)
        shown.add_row(row["condition"], order, gain, printed, *bandwidths, f"{row['fit_percent']:.1f}")
    yield shown
    yield "Gains ± one standard deviation; those of Table 6 are what its four digits allow, at the inferred 1 ms."
