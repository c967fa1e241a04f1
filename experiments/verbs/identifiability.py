"""`hydrostate identifiability`: predicts what an experiment can determine, before it is run."""

from typing import TYPE_CHECKING, Annotated

import typer

from experiments.command.json_output import prepare_output
from experiments.command.logs import Batch, finish
from experiments.command.options import (
    SEED,
    BiasPressure,
    ConditionName,
    Drive,
    Frequency,
    Json,
    Load,
    Noise,
    Out,
    Plant,
    Ranked,
    RigFile,
    Seed,
    Voltage,
    load_actuator,
    option,
    options_of_kind,
)

if TYPE_CHECKING:
    from experiments.actuator_kind import Experiment

COMMON_OPTIONS = frozenset({"plant", "rig", "out", "seed", "as_json"})
"""Options that apply to every kind of actuator."""

commands = typer.Typer()


@commands.command(
    epilog="Example: hydrostate identifiability --sensors position,velocity --drive sine --seconds 10 --rate 1000"
)
def identifiability(
    context: typer.Context,
    plant: Plant = None,
    sensors: Annotated[
        str,
        option(
            "LIST",
            "Sensors besides the drive, comma-separated: position, velocity, dp; piezo-stack: stack, force, position, "
            "pressure. All by default.",
            show_default=False,
        ),
    ] = "",
    noise: Noise = "bench",
    drive: Drive = "steps",
    seconds: Annotated[
        float,
        option("S", "Length of the experiment [s].", "--seconds", "--duration", show_default="10, piezo-stack 0.1"),
    ] = 10.0,
    rate: Annotated[float, option("HZ", "Sample rate [Hz].", show_default="1000, piezo-stack 20000")] = 1000.0,
    ranked: Ranked = False,
    condition: ConditionName = None,
    frequency: Frequency = None,
    voltage: Voltage = None,
    bias_pressure: BiasPressure = None,
    load: Load = None,
    rig: RigFile = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Predict how well an experiment can determine bulk modulus, leakage, flow bias and friction, before you run it.

    Prints the least relative standard deviation that any method can reach (the Cramér-Rao bound of the lumped plant, in
    percent), the parameters that cannot be separated, and what the uncertainties in the rig file add: only the ratio
    of chamber volume to bulk modulus matters. For other actuators it prints the same for what their logs determine. The
    seed is that of random drives.
    """
    from experiments.actuators import verb_of_kind

    asked = locals()
    kind, bench = load_actuator(plant, rig)
    options = {**options_of_kind(context, asked, kind, "identifiability", COMMON_OPTIONS), "seed": seed}
    experiment: Experiment = verb_of_kind(kind, "identifiability")
    prepare_output(out)
    about = {"plant": kind.name, "rig": bench.name, "seed": seed}
    results = tuple({**about, **experiment.entries(one)} for one in experiment.run(bench, options))

    batch = Batch(results, len(results))
    finish(batch, lambda shown: experiment.screen(shown, options), as_json=as_json, out=out)
