"""`hydrostate conditions`: the nine conditions and the parameters of each."""

from dataclasses import asdict
from typing import TYPE_CHECKING

import typer

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import Batch, finish
from experiments.command.options import SEED, Json, Out, RigFile, Seed, load_rig
from experiments.command.terminal import table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rich.console import RenderableType

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate conditions --rig rig.toml")
def conditions(rig: RigFile = None, out: Out = None, seed: Seed = SEED, as_json: Json = False) -> None:
    """List the nine conditions of Table 1 and the parameters of each, in SI.

    For a rig that is not the paper's, the changes of Tables 3 and 4 are scaled to its flow and area. The seed changes
    nothing.
    """
    from faults.conditions import CONDITIONS, parameters_for

    bench = load_rig(rig)
    prepare_output(out)
    results = tuple(
        {
            "condition": condition.name,
            "outcome": "ok",
            "leakage": condition.leakage,
            "friction": condition.friction,
            "parameters": asdict(parameters_for(condition, bench.parameters)),
            "rig": bench.name,
            "seed": seed,
        }
        for condition in CONDITIONS.values()
    )
    finish(Batch(results, len(results)), _screen, as_json=as_json, out=out)


def _screen(results: "Sequence[Result]") -> "Iterable[RenderableType]":
    from plant.eha.model import EhaParameters
    from plant.units import notes

    shown_names = ("leakage_coefficient", "flow_bias", "friction_quadratic", "friction_linear", "friction_coulomb")
    units = notes(EhaParameters)
    headings = [f"{units[name].meaning.rsplit(' ', 1)[-1]} [{units[name].unit}]" for name in shown_names]
    shown = table("condition", "leakage", "friction", *headings)
    for result in results:
        numbers = [f"{result['parameters'][name]:.4g}" for name in shown_names]
        shown.add_row(result["condition"], result["leakage"], result["friction"], *numbers)
    yield shown
