"""`hydrostate circuit`: the paper's experiments on the circuit plant, as a folder with a report."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import SEED, Json, Seed, flag
from experiments.command.study_verb import Folder, finish_study

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate circuit --out results/circuit --seed 2024")
def circuit(
    out: Folder = Path("results/circuit"),
    seed: Seed = SEED,
    quick: Annotated[bool, flag("--quick", "Fewer first guesses and shorter runs of Figures 10 and 11.")] = False,
    as_json: Json = False,
) -> None:
    """Repeat the paper's experiments (Figures 3 to 11, section 4) on the circuit plant; write tables, figures, report.

    The circuit plant has two chambers, make-up valves, relief valve, throttles, presliding friction and motor lag.
    Takes one to six minutes, a quick one half a minute. The last line of standard output is the report's path.
    """
    from experiments.circuit.study import CIRCUIT
    from experiments.nine_conditions.settings import StudySettings, quick_settings

    settings = quick_settings(seed) if quick else StudySettings(seed=seed)
    finish_study(CIRCUIT, settings, out, as_json=as_json)
