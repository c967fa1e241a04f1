"""`hydrostate benchmark`: logs of the open benchmark with their truth, and what kinds there are."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.json_output import json_text
from experiments.command.options import Json, option, require_positive
from experiments.command.output_paths import require_folder
from experiments.command.study_verb import Folder, finish_study
from experiments.command.terminal import emit

commands = typer.Typer(no_args_is_help=True, help="Logs with their truth, to compare methods on.")


@commands.command(epilog="Example: hydrostate benchmark make --kind plain --kind worn_pump --count 5 --out logs")
def make(
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="A folder of each kind goes below it.")
    ] = Path("open-benchmark"),
    kind: Annotated[
        list[str] | None, option("KIND", "Kind of log. Repeat the option for more.", show_default="all")
    ] = None,
    split: Annotated[str, option("SPLIT", "training, validation or test.")] = "test",
    count: Annotated[int, option("N", "Logs of each kind.")] = 10,
    as_json: Json = False,
) -> None:
    """Write logs with truth.csv, and a rig file where the actuator is not the paper's.

    The same options write the same files. The simulator shares no model of physics, sensors or loggers with the methods
    that estimate and diagnose here.
    """
    require_folder(out)
    from experiments.open_benchmark.folders import write_set
    from experiments.open_benchmark.kinds import KINDS, VERSION

    written = [str(write_set(name, split, count, out)) for name in kind or KINDS]
    done = [{"outcome": "ok", "truth": path, "logs": count, "split": split, "version": VERSION} for path in written]
    emit(json_text(done) if as_json else "\n".join(written))


@commands.command(epilog="Example: hydrostate benchmark kinds")
def kinds(as_json: Json = False) -> None:
    """List the kinds of log: what is unusual in each, and which verdicts are right."""
    from experiments.open_benchmark.kinds import KINDS

    if as_json:
        listed = [{"kind": k.name, "strange": k.strange, "accept": k.accept, "named": k.named} for k in KINDS.values()]
        emit(json_text(listed))
        return
    widest = max(map(len, KINDS))
    emit("\n".join(f"{k.name:{widest}}  {k.strange}; right: {', '.join(k.accept)}" for k in KINDS.values()))


@commands.command(epilog="Example: hydrostate benchmark baselines --out results/open-benchmark --training 90 --test 9")
def baselines(
    out: Folder = Path("results/open-benchmark"),
    training: Annotated[int, option("N", "Plain logs to learn from.")] = 360,
    test: Annotated[int, option("N", "Logs of each kind to judge.")] = 18,
    as_json: Json = False,
) -> None:
    """Score other classifiers next to `diagnose`: RMSE as published, learners on features, random kernels.

    Takes about ten minutes. The last line of standard output is the path of the report.
    """
    require_positive("--training", training, "logs")
    require_positive("--test", test, "logs")
    from experiments.open_benchmark.study import BASELINES, BaselineSettings

    finish_study(BASELINES, BaselineSettings(training, test), out, as_json=as_json)
