"""`hydrostate study`: the nine-condition study, as a folder with a report."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import SEED, Json, Seed, flag
from experiments.command.study_verb import Folder, finish_study

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate study --out results/nine-conditions --seed 2024")
def study(
    out: Folder = Path("results/nine-conditions"),
    seed: Seed = SEED,
    quick: Annotated[bool, flag("--quick", "A smaller study, in under 20 s once kernels are compiled.")] = False,
    as_json: Json = False,
) -> None:
    """Simulate, estimate, identify and diagnose the nine conditions; report the results next to the published ones.

    The last line of standard output is the path of the report.
    """
    from experiments.nine_conditions.settings import StudySettings, quick_settings
    from experiments.nine_conditions.study import NINE_CONDITIONS

    settings = quick_settings(seed) if quick else StudySettings(seed=seed)
    finish_study(NINE_CONDITIONS, settings, out, as_json=as_json)
