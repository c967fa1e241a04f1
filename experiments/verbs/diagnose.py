"""`hydrostate diagnose LOG...`: which condition or fault each log shows, and how bad it is."""

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
    Report,
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
        str | None, option("NAME", "The condition that you expect; the result says whether it agrees.")
    ] = None,
    rig: RigFile = None,
    columns: Columns = None,
    sample_time: SampleTime = None,
    beside: Beside = None,
    transfer_functions: Annotated[
        bool | None,
        flag(
            "--transfer-functions/--no-transfer-functions",
            "Print the errors of nine transfer functions (for your own rig they are identified first: 20 s), or leave "
            "out the line that sums them up for the paper's rig.",
        ),
    ] = None,
    scores: Annotated[
        bool, flag("--scores/--no-scores", "Also print a table with the model error of every condition.")
    ] = False,
    report: Report = None,
    no_pressure: Annotated[bool, flag("--no-pressure", "Ignore differential pressure even if it is logged.")] = False,
    plant: Plant = None,
    bias_pressure: BiasPressure = None,
    load: Load = None,
    healthy: Healthy = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Find what is wrong: which of nine conditions, how probable, how severe; or that none of the nine fits.

    The nine conditions are no, minor or major leakage, each with no, minor or major friction. The command fits a
    hydraulic circuit to each log and compares it with the nine; the errors of nine models and nine filters also count.
    Probabilities were calibrated on simulated logs. Severities have 95 % intervals; the wider ones ("with rig error")
    include the uncertainty of the rig file. In the table of --scores, a model error is in velocity [m/s], or
    relative to the signals [dimensionless] if differential pressure is used. The seed sets the simulated runs from
    which transfer functions of your own rig are identified.
    """
    run_log_verb(context, "diagnose", "diagnosing", locals())
