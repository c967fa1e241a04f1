"""The command ``hydrostate``: study, circuit, simulate, estimate, identify, library, diagnose and others."""

import atexit
import gc
import os
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.terminal import INTERRUPTED, HydrostateGroup, emit
from plant.compiled.native.recipes import trust_sources

SHUTDOWN_WAIT = 10.0
"""Longest wait for threads that still run when a command has finished [s]."""

OBJECTS_AT_START = 500_000
"""Threshold of the garbage collector [objects], above the number left by imports and one log."""

EPILOG = """
Exit codes: 0 all done, not_observable included; 1 some logs failed or diverged (standard error names each), or an
internal error; 2 nothing was done (wrong usage, or no log could be read); 130 interrupted.

Outcome of a log: ok; not_observable: drive and sensors do not determine the value, so none is given; mismatch: the
model does not describe the log, so no value is given; diverged: the result became infinite or not a number; failed: the
message says why.

Environment: HYDROSTATE_CACHE sets the folder of compiled kernels; HYDROSTATE_DEBUG=1 prints the traceback of an
internal error.

Example: hydrostate simulate --condition minor_leakage --out run.csv, then hydrostate diagnose run.csv
"""

VERBS: Mapping[str, Sequence[str]] = {
    "What a log says": ("verbs.inspect", "verbs.diagnose", "verbs.estimate", "verbs.identify"),
    "Many logs, and a running bench": (
        "verbs.fleet",
        "verbs.batch",
        "verbs.report",
        "verbs.compare",
        "verbs.serve",
        "verbs.watch",
        "verbs.filter_stream",
    ),
    "Before a test": (
        "verbs.rig",
        "verbs.identifiability",
        "verbs.isolability",
        "verbs.simulate",
        "verbs.conditions",
        "verbs.size_cylinder",
    ),
    "Models and controllers": ("library.command", "verbs.export"),
    "The papers and the benchmark": (
        "nine_conditions.command",
        "circuit.command",
        "piezo_stack.command",
        "diaphragm_motor.command",
        "motor_paper.command",
        "papers.command",
        "open_benchmark.command",
    ),
}
"""Modules with one verb each, by the heading in the help text, in its order."""

GROUPS = {"verbs.rig": "rig", "verbs.export": "export", "open_benchmark.command": "benchmark"}
"""Modules whose verbs follow the name of a group."""

VERBS_LOADED_ALONE = {"estimate": "verbs.estimate", "diagnose": "verbs.diagnose", "identify": "verbs.identify"}
"""Verbs for a single log. Their module is imported alone, since importing all takes a twentieth of a short run."""

if TYPE_CHECKING:
    app: typer.Typer
    """All verbs; made when it is first asked for."""


def __getattr__(name: str) -> Any:
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _full_app()


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        emit(f"hydrostate {version('hydrostate')}")
        raise typer.Exit


def _root(
    shown: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Find what is wrong inside an electro-hydrostatic actuator, from the signals that a bench already logs."""
    del shown


def _app_of_verbs(verbs: Mapping[str, Sequence[str]]) -> typer.Typer:
    """Return the command line with the verbs of some modules, under their headings."""
    made = typer.Typer(
        name="hydrostate",
        cls=HydrostateGroup,
        pretty_exceptions_enable=False,
        add_completion=False,
        no_args_is_help=True,
        rich_markup_mode="markdown",
        context_settings={"help_option_names": ["--help", "-h"]},
        epilog=EPILOG,
    )
    made.callback()(_root)
    for heading, modules in verbs.items():
        for module in modules:
            commands: typer.Typer = import_module(f"experiments.{module}").commands
            for one in commands.registered_commands:
                one.rich_help_panel = one.rich_help_panel if module in GROUPS else heading
            named: dict[str, Any] = {"name": GROUPS[module], "cls": HydrostateGroup} if module in GROUPS else {}
            made.add_typer(commands, rich_help_panel=heading, **named)
    return made


@cache
def _full_app() -> typer.Typer:
    return _app_of_verbs(VERBS)


def app_for(words: Sequence[str]) -> typer.Typer:
    """Return a command line that includes the verb that was typed."""
    alone = VERBS_LOADED_ALONE.get(words[0]) if words else None
    return _full_app() if alone is None else _app_of_verbs({"": [alone]})


def _with_streams() -> None:
    """Open standard streams that were closed at the start, as by a shell's ``>&-``, so that output can be written."""
    for name, how, mode in (("stdin", os.O_RDONLY, "r"), ("stdout", os.O_WRONLY, "w"), ("stderr", os.O_WRONLY, "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, how), mode, encoding="utf-8"))


def main() -> None:
    """Run the command line and exit with its code.

    A short run spends most of its time importing. Meanwhile no garbage is collected, and nothing is freed piece by
    piece at the end: together they would take a third of the run. Exit handlers are still called. Linear algebra uses
    one thread, as in all workers, unless the environment says otherwise: its matrices are small, so its own threads
    would cost three times what they save, and results would depend on the number of cores.
    """
    gc.set_threshold(OBJECTS_AT_START)
    _with_streams()
    trust_sources()
    os.environ["MPLBACKEND"] = "agg"  # figures go to files; a backend set by a notebook would fail here
    for name in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    if VERBS_LOADED_ALONE.keys() & set(sys.argv[1:2]):
        from experiments.command.memory import keep_freed_memory

        keep_freed_memory()
    try:
        app_for(sys.argv[1:])()
    except KeyboardInterrupt:  # while a command is loaded; a loaded command handles it itself
        emit("hydrostate: interrupted", err=True)
        os._exit(INTERRUPTED)
    except SystemExit as ended:
        if not isinstance(ended.code, int):
            raise
        for thread in threading.enumerate():
            if thread is not threading.current_thread() and not thread.daemon:
                thread.join(SHUTDOWN_WAIT)  # otherwise destructors in libraries would abort the process
        atexit._run_exitfuncs()  # pyright: ignore[reportPrivateUsage]  as the interpreter would
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(ended.code)


if __name__ == "__main__":
    main()
