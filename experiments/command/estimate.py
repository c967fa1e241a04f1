"""`hydrostate estimate LOG...`: what each log says of the actuator in numbers, or a sentence why not."""

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
        "What is believed: flow (needs position and differential pressure; finds leakage too), motion "
        "(without pressure; finds leakage and friction too), pressure and acceleration (filters that are told "
        "leakage and friction; the latter is the published one), or auto: flow or motion where the log allows.",
    ),
]
Method: TypeAlias = Annotated[
    str,
    option(
        "METHOD",
        "least-squares (flow, motion); chamber-ekf (flow, sample by sample: two chambers, make-up and drain); "
        "published-ekf (equations 7.1 to 7.7); or a filter: ekf, iekf, ukf, ckf, svsf, sif, imm (is not told leakage "
        "and friction), particle, smoother, iterated-smoother, filterpy-ekf; auto: least squares where the form "
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
            "What a filter estimates beside bulk modulus, comma-separated: leakage, friction, air, or parameters "
            "such as flow_bias.",
        ),
    ] = "",
    sensors: Annotated[
        str,
        option(
            "NAMES",
            "Use these channels alone, comma-separated: position, velocity, dp; piezo-stack: stack, force, "
            "position, pressure. All by default.",
        ),
    ] = "",
    tune: Annotated[
        bool | None,
        flag(
            "--tune/--no-tune",
            "Tune the filter's noise levels to the log by likelihood; by default where --form pressure has pressure.",
        ),
    ] = None,
    smooth: Annotated[
        bool, flag("--smooth", "Smooth: what the whole log says of every sample (method smoother).")
    ] = False,
    robust: Annotated[str, option("HOW", "How gross outliers count in a filter: none, huber or student-t.")] = "none",
    figure: Annotated[
        Path | None, option("PNG", "Draw the filtered estimate with its 95 % band, innovations and NIS.")
    ] = None,
    report: Annotated[Path | None, option("FILE", "Write a page (HTML); of several logs, one each.")] = None,
    plant: Plant = None,
    bias_pressure: BiasPressure = None,
    load: Load = None,
    healthy: Healthy = None,
    condition: ConditionName = None,
    rig: RigFile = None,
    columns: Columns = None,
    sample_time: SampleTime = None,
    beside: Beside = None,
    start: Annotated[float | None, option("PA", "First guess of bulk modulus [Pa]; the rig's if not given.")] = None,
    start_std: Annotated[
        float, option("PA", "Standard deviation of the first guess [Pa]; convergence needs 1e8.", show_default="3e8")
    ] = 3e8,
    no_pressure: Annotated[
        bool, flag("--no-pressure", "Use position and velocity alone, even if pressure is logged.")
    ] = False,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Estimate effective bulk modulus [Pa] from each log, with a 95 % interval and a verdict.

    With position and differential pressure logged, leakage and flow bias are found along with it and friction plays no
    part.
    Without, leakage and friction are taken from the rig, or from the condition if one is given. Where drive and
    sensors hold too little (Cramér-Rao bound over 3 %), the outcome is not_observable and no number is printed.
    Nothing here is random, so the seed changes nothing.
    """
    run_log_verb(context, "estimate", "estimating", locals())
