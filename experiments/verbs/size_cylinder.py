"""`hydrostate size-cylinder`: sizes a double-acting cylinder with its pump, valves and pipes for a required task."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import Batch, finish
from experiments.command.options import Json, Out, option
from experiments.command.terminal import table
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from rich.console import RenderableType

commands = typer.Typer()

SHOP_UNITS = {
    "m": ("mm", 1e3),
    "m^2": ("mm²", 1e6),
    "Pa": ("bar", 1e-5),
    "m^3/s": ("L/min", 6e4),
    "m^3/(s Pa^0.5)": ("L/min at 1 bar", 6e4 * 1e5**0.5),
}
"""Units on the screen, and the factor from the SI units of the results."""


@commands.command(
    "size-cylinder", epilog="Example: hydrostate size-cylinder --force 10000 --speed 0.1 --stroke 0.5 --pressure 1e7"
)
def size_cylinder(
    force: Annotated[float, option("N", "Force while the rod goes out [N].", show_default=False)],
    speed: Annotated[float, option("M_S", "Speed going out [m/s].", show_default=False)],
    stroke: Annotated[float, option("M", "Stroke [m].", show_default=False)],
    pressure: Annotated[float, option("PA", "Pressure at the valve, above tank [Pa].", show_default=False)],
    retract_force: Annotated[float, option("N", "Force going in [N].")] = 0.0,
    retract_speed: Annotated[float | None, option("M_S", "Speed going in [m/s].", show_default="as going out")] = None,
    bore: Annotated[float | None, option("M", "Bore [m], with --rod.", show_default="smallest of ISO 3320")] = None,
    rod: Annotated[float | None, option("M", "Rod [m], with --bore.", show_default=False)] = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Size a double-acting cylinder and its circuit: bore, rod, flows of the ports, pump, relief valve, valves, pipes.

    Section 5.1 of the diaphragm-motor paper as a small calculator, with steady balances. With --bore and --rod it says
    what that cylinder gives; a cylinder that is too weak for its load is an error.
    """
    from plant.eha.cylinder_sizing import Duty, cylinder_circuit
    from plant.eha.cylinder_sizing import size_cylinder as smallest_standard

    prepare_output(out)
    duty = Duty(
        extend_force=force,
        extend_speed=speed,
        stroke=stroke,
        supply_pressure=pressure,
        retract_force=retract_force,
        retract_speed=speed if retract_speed is None else retract_speed,
    )
    if bore is None and rod is None:
        found = smallest_standard(duty)
    elif bore is None or rod is None:
        raise HydrostateError("--bore and --rod are given together or not at all")
    else:
        found = cylinder_circuit(duty, bore, rod)
        if found.extend_force < force or found.retract_force < retract_force:
            raise HydrostateError(
                f"a bore of {bore:g} m with a rod of {rod:g} m gives {found.extend_force:.4g} N out and "
                f"{found.retract_force:.4g} N in at {pressure:g} Pa, wanted {force:g} and {retract_force:g}"
            )
    result: dict[str, Any] = {"outcome": "ok", **asdict(found), "duty": asdict(duty)}
    finish(Batch((result,), 1), _screen, as_json=as_json, out=out)


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    from plant.eha.cylinder_sizing import CylinderCircuit
    from plant.units import notes

    shown = table("quantity", "value", "unit")
    for name, note in notes(CylinderCircuit).items():
        unit, scale = SHOP_UNITS.get(note.unit, (note.unit, 1.0))
        shown.add_row(note.meaning, f"{scale * results[0][name]:.4g}", unit)
    yield shown
