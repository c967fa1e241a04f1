"""`hydrostate simulate --out run.csv`: a run of the actuator, as its sensors would have logged it."""

import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import json_text
from experiments.command.options import (
    PRESSURE,
    SEED,
    ConditionName,
    Json,
    RigFile,
    Seed,
    load_rig,
    require_one_of,
    require_positive,
)
from experiments.command.streams import emit, note
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from plant.eha import EhaParameters
    from plant.record import Record

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
            metavar="PLANT", help="lumped (5.8 to 5.10, it sticks), reduced (5.14), or circuit (the whole rig)."
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
    duration: Annotated[float, typer.Option(metavar="S", help="Length of the run [s].")] = 10.0,
    sample_time: Annotated[float, typer.Option(metavar="S", help="Time between samples [s].")] = 1e-4,
    sensors: Annotated[
        str,
        typer.Option(
            metavar="SENSORS", help="bench, rig (velocity from the encoder), paper (no differential pressure) or ideal."
        ),
    ] = "bench",
    rig: RigFile = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Simulate a run and write it as a log in SI, with what made it: parameters, condition, seed, versions.

    Columns have the project's own names, whatever the rig calls its logs' columns.
    """
    import numpy as np

    from plant.record_files import write_record
    from plant.sensors import SENSORS
    from plant.signals import DRIVES, make_drive
    from plant.simulate import PLANTS
    from plant.simulate import simulate as simulate_plant

    for option, value, known in (
        ("--plant", plant, PLANTS),
        ("--drive", drive, DRIVES),
        ("--sensors", sensors, SENSORS),
    ):
        require_one_of(option, value, list(known))
    require_positive("--duration", duration, "s")
    require_positive("--sample-time", sample_time, "s")
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
    if PRESSURE not in record:
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
