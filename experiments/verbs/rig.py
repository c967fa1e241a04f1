"""`hydrostate rig init`: a rig file to fill in."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import load_actuator, option
from experiments.command.output_paths import require_place
from experiments.command.terminal import emit

commands = typer.Typer(no_args_is_help=True, help="Write a file that describes your own actuator.")


@commands.command("init", epilog="Example: hydrostate rig init bench2.toml")
def rig_init(
    path: Annotated[
        Path, typer.Argument(metavar="PATH", help="File to write; an existing file is not overwritten.")
    ] = Path("rig.toml"),
    plant: Annotated[
        str | None,
        option("PLANT", "Kind of actuator: eha (gear pump), piezo-stack or diaphragm-motor.", show_default="eha"),
    ] = None,
) -> None:
    """Write a commented rig file (TOML, SI) of the paper's actuator, for you to change into yours."""
    from plant.eha.rig import EHA, rig_template, write_rig_template

    kind, _ = load_actuator(plant, None)
    columns = {name: f"NAME:{unit}" for name, unit in kind.channels.items()}
    require_place("PATH", path, ".toml")
    write_rig_template(path, None if kind.name == EHA else rig_template(kind.parameters, kind.name, columns))
    emit(f"{path}: fill in your actuator's parameters, then pass it as --rig {path}")
