"""The command ``hydrostate``: study, circuit, simulate, estimate, identify, library, diagnose and others."""

import atexit
import gc
import os
import sys
import threading
from contextlib import suppress
from typing import Annotated

import typer

from experiments.circuit import command as circuit
from experiments.command import (
    batch,
    compare,
    conditions,
    diagnose,
    estimate,
    export,
    filter_stream,
    fleet,
    identifiability,
    identify,
    inspect,
    isolability,
    serve,
    simulate,
    size_cylinder,
    watch,
)
from experiments.command.terminal import HydrostateGroup, emit
from experiments.diaphragm_motor import command as diaphragm_motor
from experiments.library import command as library
from experiments.motor_paper import command as motor_paper
from experiments.nine_conditions import command as nine_conditions
from experiments.open_benchmark import command as open_benchmark
from experiments.papers import command as papers
from experiments.piezo_stack import command as piezo_stack
from plant.compiled.native.recipes import trust_sources

LEFT_TO_END = 10.0
"""How long a thread that still runs when a command is done is waited for [s]."""

OBJECTS_AT_START = 500_000
"""More objects than imports and one log leave behind; garbage is looked for after so many [objects]."""

EPILOG = """
Exit codes: 0 all done, not_observable included; 1 some logs failed or diverged (standard error names each), or an
internal error; 2 nothing was done (wrong usage, or no log could be read); 130 interrupted.

Outcome of a log: ok; not_observable: drive and sensors do not determine the value, so none is given; mismatch: the
model does not describe the log, so no value is given; diverged: the result stopped being finite; failed: the message
says why.

Environment: HYDROSTATE_CACHE sets the folder of compiled kernels; HYDROSTATE_DEBUG=1 prints the traceback of an
internal error.

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
        from importlib.metadata import version

        emit(f"hydrostate {version('hydrostate')}")
        raise typer.Exit


@app.callback()
def root(
    shown: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Find what is wrong inside an electro-hydrostatic actuator, from the signals that a bench already logs."""
    del shown


VERBS = (
    nine_conditions,
    circuit,
    piezo_stack,
    diaphragm_motor,
    simulate,
    estimate,
    identify,
    library,
    diagnose,
    inspect,
    watch,
    filter_stream,
    identifiability,
    isolability,
    conditions,
    batch,
    compare,
    fleet,
    serve,
    motor_paper,
    papers,
    size_cylinder,
)
for module in VERBS:
    app.add_typer(module.commands)
app.add_typer(conditions.rig_commands, name="rig")
app.add_typer(export.commands, name="export")
app.add_typer(open_benchmark.commands, name="benchmark")


def main() -> None:
    """Run the command line and exit with its code.

    A short run is spent importing: no garbage is looked for meanwhile, and in the end nothing is freed piece by piece,
    which by themselves take a third of it. What asked to be called at the exit is called. Linear algebra has one
    thread, as in all workers, unless the environment says otherwise: its matrices are small, its own threads would take
    three times as long as they save, and results would depend on the count of cores.
    """
    gc.set_threshold(OBJECTS_AT_START)
    trust_sources()
    for name in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    try:
        app()
    except SystemExit as ended:
        if not isinstance(ended.code, int):
            raise
        for thread in threading.enumerate():
            if thread is not threading.current_thread() and not thread.daemon:
                thread.join(LEFT_TO_END)  # libraries' own destructors would end the process while one runs
        atexit._run_exitfuncs()  # pyright: ignore[reportPrivateUsage]  as the interpreter would
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(ended.code)


if __name__ == "__main__":
    main()
