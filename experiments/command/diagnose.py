"""`hydrostate diagnose LOG...`: which condition or fault each log shows, and how bad it is."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.log_verb import run_log_verb
from experiments.command.options import (
    SEED,
    Beside,
    BiasPressure,
    Columns,
    Healthy,
    Json,
    Load,
    Logs,
    Out,
    Plant,
    RigFile,
    SampleTime,
    Seed,
    flag,
    option,
)

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate diagnose run*.csv --rig rig.toml --out diagnosis")
def diagnose(
    context: typer.Context,
    logs: Logs,
    condition: Annotated[
        str | None, option("NAME", "The condition that you expect; the result says if it agrees.")
    ] = None,
    rig: RigFile = None,
    columns: Columns = None,
    sample_time: SampleTime = None,
    beside: Beside = None,
    transfer_functions: Annotated[
        bool | None,
        flag(
            "--transfer-functions/--no-transfer-functions",
            "Show a table of nine transfer functions' errors (identified first for a rig of your own: 20 s), or leave "
            "out the line on them that the paper's rig gets.",
        ),
    ] = None,
    scores: Annotated[
        bool, flag("--scores/--no-scores", "Also show every condition's model error in a table.")
    ] = False,
    report: Annotated[Path | None, option("FILE", "Write a page (HTML); of several logs, one each.")] = None,
    no_pressure: Annotated[
        bool, flag("--no-pressure", "Use velocity alone, even if differential pressure is logged.")
    ] = False,
    plant: Plant = None,
    bias_pressure: BiasPressure = None,
    load: Load = None,
    healthy: Healthy = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Say what is wrong: which of nine conditions, how probable, how bad, or that it is none of them.

    A hydraulic circuit is fitted to each log and compared with the nine conditions of leakage and friction; the
    errors of nine models and nine filters count too. The probabilities were calibrated on simulated logs. Severities
    come with 95 % intervals. In the table of scores a model's error is in velocity [m/s], or relative to the signals
    [dimensionless] where differential pressure counts too. The seed draws the tests behind the transfer functions.
    """
    run_log_verb(context, "diagnose", "diagnosing", locals())
