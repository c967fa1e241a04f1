"""`hydrostate piezo-stack`: the piezo-stack actuator's flow study, as a folder with a report."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import SEED, Json, Seed, flag, option, require_positive
from experiments.command.study_verb import Folder, finish_study

commands = typer.Typer()


@commands.command("piezo-stack", epilog="Example: hydrostate piezo-stack --out results/piezo-stack --quick")
def piezo_stack(
    out: Folder = Path("results/piezo-stack"),
    quick: Annotated[bool, flag("--quick", "A small design map, in seconds.")] = False,
    voltage_limit: Annotated[float, option("V", "Largest swing of the best operating points [V].")] = 140.0,
    power_limit: Annotated[float, option("W", "Largest power of the stack at the best operating points [W].")] = 30.0,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Repeat the flow experiments of the piezo-stack paper (Figures 10 to 14); maps, limits and best operating points.

    Also shows which runs identify the stack's hysteresis and which do not. Takes about a minute.
    The last line of standard output is the path of the report.
    """
    require_positive("--voltage-limit", voltage_limit, "V")
    require_positive("--power-limit", power_limit, "W")
    from experiments.piezo_stack.study import PIEZO_STACK, StackSettings

    finish_study(PIEZO_STACK, StackSettings(seed, quick, voltage_limit, power_limit), out, as_json=as_json)
