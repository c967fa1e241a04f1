"""`hydrostate simulate --out run.csv`: a run of the actuator, as its sensors would have logged it."""

import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import json_text
from experiments.command.options import (
    MOTOR,
    PRESSURE,
    SEED,
    STACK,
    ConditionName,
    Json,
    RigFile,
    Seed,
    load_rig,
    refuse_given,
    require_one_of,
    require_positive,
)
from experiments.command.streams import emit, note
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from plant.eha import EhaParameters
    from plant.record import Record

_DURATION, _SAMPLE_TIME = 10.0, 1e-4

commands = typer.Typer()


@commands.command(
    epilog="Example: hydrostate simulate --condition major_leakage --drive steps --duration 10 --out run.parquet"
)
def simulate(
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", metavar="FILE", help="File to write: .csv, .csv.gz, .parquet or .mat.", show_default=False
        ),
    ],
    plant: Annotated[
        str,
        typer.Option(
            metavar="PLANT",
            help="lumped (5.8 to 5.10, it sticks), reduced (5.14), circuit (the whole rig), or piezo-stack and "
            "diaphragm-motor, which have a sine drive and the options marked so.",
        ),
    ] = "lumped",
    condition: ConditionName = None,
    leakage_severity: Annotated[
        float | None,
        typer.Option(
            metavar="NUMBER", help="In place of a condition: 0 none, 1 minor, 2 major, up to 5 [dimensionless]."
        ),
    ] = None,
    friction_severity: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Likewise, of friction [dimensionless].")
    ] = None,
    drive: Annotated[
        str, typer.Option(metavar="DRIVE", help="sine, prbs, steps, chirp or multisine, of 4 V or up to it.")
    ] = "steps",
    duration: Annotated[
        float | None,
        typer.Option(
            metavar="S", help="Length of the run [s].", show_default="10, piezo-stack 0.16, diaphragm-motor 0.2"
        ),
    ] = None,
    sample_time: Annotated[
        float | None,
        typer.Option(
            metavar="S", help="Time between samples [s].", show_default="1e-4, piezo-stack 5e-5, diaphragm-motor 2e-5"
        ),
    ] = None,
    sensors: Annotated[
        str,
        typer.Option(
            metavar="SENSORS", help="bench, rig (velocity from the encoder), paper (no differential pressure) or ideal."
        ),
    ] = "bench",
    rig: RigFile = None,
    seed: Seed = SEED,
    frequency: Annotated[
        float | None,
        typer.Option(
            metavar="HZ",
            help="piezo-stack: frequency, up to 450 Hz; diaphragm-motor: up to 1000 Hz.",
            show_default="275, diaphragm-motor 480",
        ),
    ] = None,
    voltage: Annotated[
        float | None,
        typer.Option(
            metavar="V",
            help="piezo-stack: peak to peak, on half of it as bias; diaphragm-motor: peak to peak, up to 300 V.",
            show_default="140, diaphragm-motor 200",
        ),
    ] = None,
    bias_pressure: Annotated[
        float | None, typer.Option(metavar="PA", help="piezo-stack: absolute bias pressure.", show_default="1e6")
    ] = None,
    load: Annotated[
        float | None,
        typer.Option(
            metavar="KG|N", help="piezo-stack: mass lifted [kg]; diaphragm-motor: force [N].", show_default="0"
        ),
    ] = None,
    fault: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="piezo-stack: a condition, or such as air_doubled; diaphragm-motor: such as valve_4_leak=0.1.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Simulate a run and write it as a log in SI, with what made it: parameters, condition, seed, versions.

    Columns have the project's own names, whatever the rig calls its logs' columns.
    """
    import numpy as np

    from experiments.command.simulate_motor import simulated_motor
    from experiments.command.simulate_stack import simulated_stack
    from plant.record_files import write_record
    from plant.sensors import SENSORS
    from plant.signals import DRIVES, make_drive
    from plant.simulate import PLANTS
    from plant.simulate import simulate as simulate_plant

    stack_options = {
        "--frequency": frequency,
        "--voltage": voltage,
        "--bias-pressure": bias_pressure,
        "--load": load,
        "--fault": fault,
    }
    require_positive("--duration", duration, "s")
    require_positive("--sample-time", sample_time, "s")
    if plant in (STACK, MOTOR):
        shared = {"--leakage-severity": leakage_severity, "--friction-severity": friction_severity, "--rig": rig}
        if plant == MOTOR:
            shared |= {"--condition": condition, "--bias-pressure": bias_pressure}
        refuse_given(shared, f"does not apply to --plant {plant}")
        if plant == STACK:
            record, said = simulated_stack(stack_options, condition, duration, sample_time, sensors, seed)
        else:
            record, said = simulated_motor(stack_options, duration, sample_time, sensors, seed)
        _prepare(out)
        write_record(record.annotate(versions=_versions()), out)
        _report(record, out, said, as_json)
        return
    duration, sample_time = duration or _DURATION, sample_time or _SAMPLE_TIME
    refuse_given(stack_options, f"needs --plant {STACK} or {MOTOR}")
    for option, value, known in (
        ("--plant", plant, [*PLANTS, STACK, MOTOR]),
        ("--drive", drive, DRIVES),
        ("--sensors", sensors, SENSORS),
    ):
        require_one_of(option, value, list(known))
    bench = load_rig(rig)
    parameters, made_of = _actuator(bench.parameters, condition, leakage_severity, friction_severity)
    _prepare(out)
    drive_rng, sensor_rng = np.random.default_rng(seed).spawn(2)
    speed = make_drive(drive, duration, sample_time, parameters, drive_rng)
    record = simulate_plant(
        PLANTS[plant], speed, sample_time, parameters, sensors=SENSORS[sensors], rng=sensor_rng
    ).annotate(**made_of, drive=drive, rig=bench.name, seed=seed, versions=_versions())
    write_record(record, out)
    _report(record, out, {"plant": plant, **made_of, "drive": drive, "sensors": sensors, "seed": seed}, as_json)


def _actuator(
    rig: "EhaParameters", condition: str | None, leakage: float | None, friction: float | None
) -> "tuple[EhaParameters, dict[str, Any]]":
    """Return the faulty actuator, and what made it so."""
    from faults.conditions import LEVELS, find_condition, severity

    name = condition
    if leakage is None and friction is None:
        found = find_condition(condition or "normal")
        name, leakage, friction = found.name, float(LEVELS.index(found.leakage)), float(LEVELS.index(found.friction))
    elif condition is not None:
        raise HydrostateError("a --condition or severities are wanted, got both")
    leaking, rubbing = leakage or 0.0, friction or 0.0
    made_of = {"condition": name, "leakage_severity": leaking, "friction_severity": rubbing}
    return severity(leaking, rubbing, rig), made_of


def _prepare(out: Path) -> None:
    """Refuse a file that cannot be written before the work, not after it."""
    from plant.record_files import SUFFIXES

    if out.suffix.lower() not in SUFFIXES:
        raise HydrostateError(f"--out must end in {', '.join(SUFFIXES)}, got {str(out)!r}")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise HydrostateError(f"--out {out}: the folder cannot be made: {error.strerror or error}") from error
    if out.is_dir():
        raise HydrostateError(f"--out {out}: a file is wanted, got a directory")


def _versions() -> dict[str, str]:
    packages = {name: version(name) for name in ("hydrostate", "numpy", "numba")}
    return {"python": platform.python_version(), **packages}


def _report(record: "Record", out: Path, made_of: Mapping[str, Any], as_json: bool) -> None:
    said = f"{len(record)} samples, {record.duration:g} s at {1.0 / record.sample_time:g} Hz, {', '.join(record)}"
    if PRESSURE not in record and made_of["plant"] not in (STACK, MOTOR):
        note(f"{PRESSURE} is not logged by these sensors: estimate and diagnose will be less certain")
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
        "message": said,
    }
    emit(json_text([entries]))
