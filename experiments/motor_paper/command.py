"""`hydrostate motor-paper`: the diaphragm-motor paper's tables, regression and linear models, checked."""

from pathlib import Path

import typer

from experiments.command.options import SEED, Json, Seed
from experiments.command.study_verb import Folder, finish_study

commands = typer.Typer()


@commands.command("motor-paper", epilog="Example: hydrostate motor-paper --out results/motor-paper")
def motor_paper(out: Folder = Path("results/motor-paper"), seed: Seed = SEED, as_json: Json = False) -> None:
    """Check the diaphragm-motor paper: Tables 1, 2, 4, 5, its regression (Figure 12), its linear models and hysteresis.

    Says what holds, what holds in one reading only, and what does not. Takes a few seconds.
    The last line of standard output is the path of the report.
    """
    from experiments.motor_paper.study import MOTOR_PAPER
    from experiments.running.study import SeedSettings

    finish_study(MOTOR_PAPER, SeedSettings(seed), out, as_json=as_json)
