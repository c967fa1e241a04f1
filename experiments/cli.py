"""The command ``hydrostate``: study, circuit, simulate, estimate, identify, library, diagnose and others."""

from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Annotated

import typer

from experiments.command import (
    batch,
    compare,
    conditions,
    diagnose,
    estimate,
    identifiability,
    identify,
    isolability,
    library,
    motor_paper,
    simulate,
    size_cylinder,
    watch,
)
from experiments.command.json_output import json_text
from experiments.command.options import SEED, Json, Seed, require_positive
from experiments.command.streams import HydrostateGroup, emit

EPILOG = """
Exit codes: 0 all done, not_observable included; 1 some logs failed or diverged, each named on standard error, or an
internal error; 2 nothing could be done (usage, no log that can be read); 130 interrupted.

Outcome of a log: ok; not_observable, drive and sensors hold too little, so no number is given; mismatch, the model does
not describe the log, so no number is given; diverged, the result stopped being finite; failed, the message says why.

Environment: HYDROSTATE_CACHE is the folder of compiled kernels, HYDROSTATE_DEBUG=1 shows where an internal error arose.

Example: hydrostate simulate --condition minor_leakage --out run.csv, then hydrostate diagnose run.csv
"""

app = typer.Typer(
    name="hydrostate",
    cls=HydrostateGroup,
    pretty_exceptions_enable=False,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["--help", "-h"]},
    epilog=EPILOG,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        emit(f"hydrostate {version('hydrostate')}")
        raise typer.Exit


@app.callback()
def root(
    shown: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Say what is wrong inside an electro-hydrostatic actuator, from the signals that a bench already logs."""
    del shown


@app.command(epilog="Example: hydrostate study --out results/nine-conditions --seed 2024")
def study(
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Folder of the report.")] = Path(
        "results/nine-conditions"
    ),
    seed: Seed = SEED,
    quick: Annotated[
        bool, typer.Option("--quick", help="A smaller study, in under 20 s once kernels are compiled.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Simulate, estimate, identify and diagnose the nine conditions; write a report beside the published results.

    The last line of standard output is the report's path.
    """
    from rich.console import Console

    from experiments.command.study import study_command

    begin = perf_counter()
    report = study_command(out, seed, quick, Console(stderr=True))
    if as_json:
        emit(json_text([{"outcome": "ok", "report": str(report), "seconds": perf_counter() - begin}]))
    else:
        emit(str(report))


@app.command(epilog="Example: hydrostate circuit --out results/circuit --seed 2024")
def circuit(
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Folder of the tables.")] = Path(
        "results/circuit"
    ),
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Repeat the paper's experiments (Figures 3 to 11, section 4) on the circuit plant; write tables, figures, report.

    The circuit plant has two chambers, make-up, relief, throttles, presliding friction and motor lag, which no filter
    here assumes. Takes one to four minutes. The last line of standard output is the manifest's path.
    """
    from rich.console import Console

    from experiments.command.circuit import circuit_command

    begin = perf_counter()
    manifest = circuit_command(out, seed, Console(stderr=True))
    if as_json:
        emit(json_text([{"outcome": "ok", "manifest": str(manifest), "seconds": perf_counter() - begin}]))
    else:
        emit(str(manifest))


@app.command("piezo-stack", epilog="Example: hydrostate piezo-stack --out results/piezo-stack --quick")
def piezo_stack(
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Folder of the report.")] = Path(
        "results/piezo-stack"
    ),
    quick: Annotated[bool, typer.Option("--quick", help="A small design map, in seconds.")] = False,
    voltage_limit: Annotated[
        float, typer.Option(metavar="V", help="Largest swing of the best operating points [V].")
    ] = 140.0,
    power_limit: Annotated[
        float, typer.Option(metavar="W", help="Largest power of the stack at the best operating points [W].")
    ] = 30.0,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Repeat the flow experiments of the piezo-stack paper (Figures 10 to 14); maps, limits and best operating points.

    Also what identifies the stack's hysteresis, and what does not. Takes about a minute.
    The last line of standard output is the manifest's path.
    """
    from rich.console import Console

    from experiments.command.piezo_stack import stack_study_command

    require_positive("--voltage-limit", voltage_limit, "V")
    require_positive("--power-limit", power_limit, "W")
    begin = perf_counter()
    manifest = stack_study_command(out, quick, voltage_limit, power_limit, seed, Console(stderr=True))
    if as_json:
        emit(json_text([{"outcome": "ok", "manifest": str(manifest), "seconds": perf_counter() - begin}]))
    else:
        emit(str(manifest))


@app.command("diaphragm-motor", epilog="Example: hydrostate diaphragm-motor --out results/diaphragm-motor")
def diaphragm_motor(
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Folder of the report.")] = Path(
        "results/diaphragm-motor"
    ),
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Repeat sections 7.1 to 7.3 of the seven-chamber diaphragm motor's paper; reversal, control, and what fails.

    Takes some ten seconds. The last line of standard output is the manifest's path.
    """
    from rich.console import Console

    from experiments.command.diaphragm_motor import motor_study_command

    begin = perf_counter()
    manifest = motor_study_command(out, seed, Console(stderr=True))
    if as_json:
        emit(json_text([{"outcome": "ok", "manifest": str(manifest), "seconds": perf_counter() - begin}]))
    else:
        emit(str(manifest))


VERBS = (
    simulate,
    estimate,
    identify,
    library,
    diagnose,
    watch,
    identifiability,
    isolability,
    conditions,
    batch,
    compare,
    motor_paper,
    size_cylinder,
)
for module in VERBS:
    app.add_typer(module.commands)
app.add_typer(conditions.rig_commands, name="rig")


def main() -> None:
    """Run the command line and exit with its code."""
    app()


if __name__ == "__main__":
    main()
