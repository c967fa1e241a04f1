"""`hydrostate simulate --out run.csv`: a run of an actuator, as its sensors would have logged it."""

import platform
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import json_text
from experiments.command.options import (
    SEED,
    BiasPressure,
    Columns,
    ConditionName,
    Frequency,
    Json,
    Load,
    RigFile,
    Seed,
    Voltage,
    load_actuator,
    option,
    options_of_kind,
    require_positive,
)
from experiments.command.terminal import emit, note
from experiments.running.refusal import os_errors_as
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from experiments.actuator_kind import Run, Simulation

COMMON_OPTIONS = frozenset({"plant", "rig", "out", "seed", "as_json"})
"""Options that apply to every kind of actuator."""

commands = typer.Typer()


@commands.command(
    epilog="Example: hydrostate simulate --condition major_leakage --drive steps --duration 10 --out run.parquet"
)
def simulate(
    context: typer.Context,
    out: Annotated[
        Path, option("FILE", "File to write: .csv, .csv.gz, .parquet or .mat.", "--out", "-o", show_default=False)
    ],
    plant: Annotated[
        str | None,
        option(
            "PLANT",
            "circuit (two chambers with valves), lumped (the paper's equations 5.8 to 5.10; under major friction "
            "diagnose calls it unknown), reduced (equation 5.14), or piezo-stack and diaphragm-motor, which have a "
            "sine drive and the options marked so.",
            show_default="that of the rig file, else circuit",
        ),
    ] = None,
    condition: ConditionName = None,
    leakage_severity: Annotated[
        float | None,
        option("NUMBER", "Leakage instead of a condition: 0 none, 1 minor, 2 major, up to 5 [dimensionless]."),
    ] = None,
    friction_severity: Annotated[float | None, option("NUMBER", "Friction, likewise [dimensionless].")] = None,
    drive: Annotated[str, option("DRIVE", "sine, prbs, steps, chirp or multisine, of at most 4 V.")] = "steps",
    duration: Annotated[
        float | None, option("S", "Length of the run [s].", show_default="10, piezo-stack 0.16, diaphragm-motor 0.2")
    ] = None,
    sample_time: Annotated[
        float | None,
        option("S", "Time between samples [s].", show_default="1e-4, piezo-stack 5e-5, diaphragm-motor 2e-5"),
    ] = None,
    sensors: Annotated[
        str, option("SENSORS", "bench, rig (velocity from the encoder), paper (no differential pressure) or ideal.")
    ] = "bench",
    rig: RigFile = None,
    seed: Seed = SEED,
    frequency: Frequency = None,
    voltage: Voltage = None,
    bias_pressure: BiasPressure = None,
    load: Load = None,
    fault: Annotated[
        str | None,
        option(
            "NAME",
            "piezo-stack: a condition, or for example air_doubled; diaphragm-motor: for example valve_4_leak=0.1.",
        ),
    ] = None,
    fmu: Annotated[
        Path | None,
        option(
            "FILE",
            "Simulate another tool's co-simulation FMU instead of a plant of ours; it needs a binary for this machine.",
        ),
    ] = None,
    columns: Columns = None,
    parameter: Annotated[
        list[str] | None, option("NAME=VALUE", "Start value of an FMU variable, in its own unit. Repeat the option.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Simulate a run and write it as a log in SI, together with its parameters, condition, seed and versions.

    The columns have Hydrostate's own names, also if the rig file names others. For an FMU, --columns names the
    variables, and a condition sets the variables that are named like its parameters. An FMU is a program: do not run
    one that you do not trust.
    """
    from experiments.actuators import verb_of_kind
    from plant.log.files import write_record

    asked = locals()
    require_positive("--duration", duration, "s")
    require_positive("--sample-time", sample_time, "s")
    kind, bench = load_actuator(plant, rig)
    options = {**options_of_kind(context, asked, kind, "simulate", COMMON_OPTIONS), "seed": seed, "plant": plant}
    simulation: Simulation = verb_of_kind(kind, "simulate")
    _prepare(out)
    run = simulation.run(bench, options)
    for one in run.notes:
        note(str(one))
    write_record(run.record.annotate(versions=_versions()), out)
    _report(run, out, {"plant": kind.name, **run.about}, as_json)


def _prepare(out: Path) -> None:
    """Raise an error before the work, not after it, if a file cannot be written."""
    from plant.log.files import SUFFIXES

    if out.suffix.lower() not in SUFFIXES:
        raise HydrostateError(f"--out must end in {', '.join(SUFFIXES)}, got {str(out)!r}")
    with os_errors_as(f"--out {out}: the folder cannot be made"):
        out.parent.mkdir(parents=True, exist_ok=True)
    if out.is_dir():
        raise HydrostateError(f"--out {out}: a file is needed, got a folder")


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    packages = {name: version(name) for name in ("hydrostate", "numpy", "llvmlite")}
    return {"python": platform.python_version(), **packages}


def _report(run: "Run", out: Path, made_of: Mapping[str, Any], as_json: bool) -> None:
    record = run.record
    said = f"{len(record)} samples, {record.duration:g} s at {1.0 / record.sample_time:g} Hz, {', '.join(record)}"
    if not as_json:
        emit(f"{out}: {said}")
        return
    entries = {
        "file": str(out),
        "outcome": "ok",
        **made_of,
        "samples": len(record),
        "sample_time_s": record.sample_time,
        "duration_s": record.duration,
        "channels": list(record),
        "warnings": [],
        "notes": [one.to_dict() for one in run.notes],
        "message": said,
    }
    emit(json_text([entries]))
