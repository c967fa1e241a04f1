"""`hydrostate estimate LOG...`: numerical estimates for the actuator from each log, or a sentence why not."""

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from experiments.command.log_verb import run_log_verb
from experiments.command.options import (
    SEED,
    Beside,
    BiasPressure,
    Columns,
    ConditionName,
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

Form: TypeAlias = Annotated[
    str,
    option(
        "FORM",
        "The model: flow (needs position and differential pressure; also finds leakage), motion (without pressure; "
        "also finds leakage and friction), pressure or acceleration (filters that are given leakage and friction; the "
        "latter is the published one), or auto (flow or motion, where the log allows).",
    ),
]
Method: TypeAlias = Annotated[
    str,
    option(
        "METHOD",
        "least-squares (flow, motion); chamber-ekf (flow, sample by sample, with two chambers, make-up and drain); "
        "published-ekf (equations 7.1 to 7.7); or a filter: ekf, iekf, ukf, ckf, svsf, sif, imm (is not given leakage "
        "and friction), particle, smoother, iterated-smoother, filterpy-ekf; auto: least-squares where the form "
        "allows.",
    ),
]

commands = typer.Typer()


@commands.command(
    epilog="Example: hydrostate estimate run1.csv run2.csv --condition minor_leakage --start 5e7 --start-std 1e8 --json"
)
def estimate(
    context: typer.Context,
    logs: Logs,
    form: Form = "auto",
    method: Method = "auto",
    states: Annotated[
        str,
        option(
            "NAMES",
            "What a filter estimates in addition to bulk modulus, comma-separated: leakage, friction, air, or "
            "parameters such as flow_bias.",
        ),
    ] = "",
    sensors: Annotated[
        str,
        option(
            "NAMES",
            "Use only these channels, comma-separated: position, velocity, dp; piezo-stack: stack, force, "
            "position, pressure. All by default.",
        ),
    ] = "",
    tune: Annotated[
        bool | None,
        flag(
            "--tune/--no-tune",
            "Tune the filter's noise levels to the log by maximum likelihood; the default where --form pressure has "
            "pressure.",
        ),
    ] = None,
    smooth: Annotated[bool, flag("--smooth", "Estimate each sample from the whole log (method smoother).")] = False,
    robust: Annotated[str, option("HOW", "How a filter treats gross outliers: none, huber or student-t.")] = "none",
    figure: Annotated[
        Path | None, option("PNG", "Draw the filtered estimate with its 95 % band, innovations and NIS.")
    ] = None,
    report: Report = None,
    plant: Plant = None,
    bias_pressure: BiasPressure = None,
    load: Load = None,
    healthy: Healthy = None,
    condition: ConditionName = None,
    rig: RigFile = None,
    columns: Columns = None,
    sample_time: SampleTime = None,
    beside: Beside = None,
    start: Annotated[
        float | None, option("PA", "First guess of bulk modulus [Pa]; by default that of the rig file.")
    ] = None,
    start_std: Annotated[
        float, option("PA", "Standard deviation of the first guess [Pa]; convergence needs 1e8.", show_default="3e8")
    ] = 3e8,
    no_pressure: Annotated[bool, flag("--no-pressure", "Ignore differential pressure even if it is logged.")] = False,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Estimate effective bulk modulus [Pa] from each log, with a 95 % interval and a verdict.

    With position and differential pressure, the fit also finds leakage and flow bias, and needs no friction model.
    Without pressure, it also finds leakage and friction. A filter of the pressure or acceleration form takes leakage
    and friction from the rig file, or from --condition. If drive and sensors do not determine bulk modulus (Cramér-Rao
    bound over 3 %), the outcome is not_observable and no value is printed. Nothing is random, so the seed changes
    nothing.
    """
    run_log_verb(context, "estimate", "estimating", locals())
