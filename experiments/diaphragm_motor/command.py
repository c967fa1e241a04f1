"""`hydrostate diaphragm-motor`: the diaphragm motor's study, as a folder with a report."""

from pathlib import Path

import typer

from experiments.command.options import SEED, Json, Seed
from experiments.command.study_verb import Folder, finish_study

commands = typer.Typer()


@commands.command("diaphragm-motor", epilog="Example: hydrostate diaphragm-motor --out results/diaphragm-motor")
def diaphragm_motor(out: Folder = Path("results/diaphragm-motor"), seed: Seed = SEED, as_json: Json = False) -> None:
    """Repeat sections 7.1 to 7.3 of the paper on the seven-chamber diaphragm motor: reversal, control, and what fails.

    Takes about ten seconds. The last line of standard output is the path of the report.
    """
    from experiments.diaphragm_motor.study import DIAPHRAGM_MOTOR
    from experiments.running.study import SeedSettings

    finish_study(DIAPHRAGM_MOTOR, SeedSettings(seed), out, as_json=as_json)
