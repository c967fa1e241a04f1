"""`hydrostate export`: filters and plants as C99 for a controller, and as FMUs for co-simulation."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from experiments.command.json_output import json_text, prepare_output
from experiments.command.logs import read_and_warn, read_log
from experiments.command.options import (
    Columns,
    Json,
    RigFile,
    argument,
    flag,
    load_columns,
    load_rig,
    option,
    require_positive,
    split_names,
)
from experiments.command.output_paths import require_folder, require_place
from experiments.command.terminal import emit, note
from experiments.running.refusal import os_errors_as
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from plant.eha.rig import Rig
    from plant.log.record import Record

SAMPLE_TIME = 1e-4
"""Default sample time of a plant and of a simulated test bench [s]."""

commands = typer.Typer(help="Export a filter, a plant or a model: C99, FMU, MATLAB.", no_args_is_help=True)

Folder: TypeAlias = Annotated[Path, option("DIR", "Folder for the files.", "--out", "-o")]
Log: TypeAlias = Annotated[
    Path | None,
    argument(
        "LOG",
        "A log of the bench, which gives the filter its sample rate, channels and sensor noise. Without one, those of "
        "a simulated healthy bench at 10 kHz are used.",
    ),
]
Form: TypeAlias = Annotated[
    str,
    option("FORM", "Model of the filter: pressure, acceleration, flow, chambers, chambers_by_mass or chambers_held."),
]
Method: TypeAlias = Annotated[
    str, option("METHOD", "ekf, iekf, ukf, ckf, svsf, sif, or imm: nine interacting filters, of leakage and friction.")
]
PlantName: TypeAlias = Annotated[
    str | None, option("PLANT", "Export the step of a plant instead of a filter: reduced, lumped or circuit.")
]
Tune: TypeAlias = Annotated[bool, flag("--tune", "Tune the filter's noise levels to the log by maximum likelihood.")]
States: TypeAlias = Annotated[
    str,
    option(
        "NAMES",
        "Parameters to estimate in addition to bulk modulus, comma-separated: leakage, friction, air, or names.",
    ),
]
NoPressure: TypeAlias = Annotated[bool, flag("--no-pressure", "Ignore differential pressure even if it is logged.")]
Step: TypeAlias = Annotated[float | None, option("S", "Time between samples [s].", show_default="the log's, else 1e-4")]


@commands.command(
    epilog="Example: hydrostate export c bench.csv --rig rig.toml --form pressure --tune --out controller"
)
def c(
    log: Log = None,
    out: Folder = Path("controller"),
    form: Form = "pressure",
    method: Method = "ekf",
    plant: PlantName = None,
    states: States = "",
    tune: Tune = False,
    precision: Annotated[str, option("TYPE", "double or float.")] = "double",
    name: Annotated[
        str | None, option("NAME", "Name of the files, types and functions.", show_default="the form and method")
    ] = None,
    no_pressure: NoPressure = False,
    sample_time: Step = None,
    rig: RigFile = None,
    columns: Columns = None,
    as_json: Json = False,
) -> None:
    """Write a filter, or a plant's step, as C99: a header, a source, an example and a Makefile.

    The C code does the same arithmetic as Python, line by line. It allocates nothing, every loop is bounded, and the
    header states the largest number of operations per step.
    """
    require_folder(out)
    prepare_output(out)
    require_positive("--sample-time", sample_time, "s")
    bench = load_rig(rig)
    if plant is not None:
        files, about = _plant(bench, plant, sample_time or SAMPLE_TIME, name, precision)
    else:
        record = _bench_log(log, bench, load_columns(columns), sample_time, no_pressure=no_pressure)
        files, about = _filter(bench, record, form, method, _states(states), name, precision, tune=tune)
    written = write_files(out, files)
    found: dict[str, Any] = {"outcome": "ok", "folder": str(out), "files": written, **about}
    emit(json_text([found]) if as_json else f"{out}: {', '.join(written)}")


@commands.command(epilog="Example: hydrostate export fmu --plant lumped --sample-time 1e-3 --fmi 3.0 --out plant.fmu")
def fmu(
    log: Log = None,
    out: Annotated[Path, option("FILE", "FMU to write.", "--out", "-o")] = Path("hydrostate.fmu"),
    fmi: Annotated[str, option("VERSION", "Version of FMI: 2.0 or 3.0.")] = "2.0",
    form: Form = "pressure",
    method: Method = "ekf",
    plant: PlantName = None,
    states: States = "",
    tune: Tune = False,
    name: Annotated[
        str | None, option("NAME", "Model identifier; must be a valid C name.", show_default="the form and method")
    ] = None,
    no_pressure: NoPressure = False,
    sample_time: Step = None,
    rig: RigFile = None,
    columns: Columns = None,
    as_json: Json = False,
) -> None:
    """Write a plant, or a filter, as an FMU for co-simulation: the binary for this Linux, the sources for all others.

    Parameters and variables have the units and meanings of the parameter notes. A plant advances by whole samples,
    a filter by one sample per step.
    """
    require_place("--out", out, ".fmu")
    require_positive("--sample-time", sample_time, "s")
    bench = load_rig(rig)
    if plant is not None:
        content = _plant_fmu(bench, plant, sample_time or SAMPLE_TIME, name, fmi)
    else:
        from estimation.export.fmu_filter import filter_fmu
        from estimation.export.task import filter_task

        record = _bench_log(log, bench, load_columns(columns), sample_time, no_pressure=no_pressure)
        problem = filter_task(record, bench.parameters, form, states=_states(states), tuned=tune)
        content = filter_fmu(problem, method, fmi, name=name if name is not None else f"{form}_{method}")
    write_files(out.parent, {out.name: content})
    found = {"outcome": "ok", "file": str(out), "fmi": fmi}
    emit(json_text([found]) if as_json else str(out))


def _plant_fmu(bench: "Rig", plant: str, sample_time: float, name: str | None, fmi: str) -> bytes:
    from plant.eha.simulate import PLANTS
    from plant.errors import require_known
    from plant.export.fmu import plant_fmu

    require_known("--plant", plant, PLANTS)
    called = name if name is not None else f"{plant}_plant"
    return plant_fmu(PLANTS[plant], bench.parameters, sample_time, fmi, name=called)


Kind: TypeAlias = Annotated[str, option("KIND", "c, or mat for MATLAB.", "--to")]


@commands.command(epilog="Example: hydrostate export model speed_to_pressure.json --to c --out controller")
def model(
    saved: Annotated[
        Path, typer.Argument(metavar="MODEL", help="A model from `hydrostate identify --input U --output Y --out`.")
    ],
    out: Folder = Path("controller"),
    to: Kind = "c",
    precision: Annotated[str, option("TYPE", "double or float.")] = "double",
    name: Annotated[str | None, option("NAME", "Name of the files, types and functions.", show_default="model")] = None,
    as_json: Json = False,
) -> None:
    """Write an identified linear model as C99 (a difference equation) or as a MAT file.

    In MATLAB, for a model of one input: load model.mat, then tf(numerator, denominator, sample_time_s, 'Variable',
    'z^-1').
    """
    require_folder(out)
    from estimation.export.c_model import model_in_c
    from estimation.export.mat_model import model_in_mat
    from estimation.identification.free_run.saved import load_models
    from plant.errors import require_known

    require_known("--to", to, ("c", "mat"))
    (found, *more) = load_models(saved)
    if more:
        raise HydrostateError(f"one model is needed, got {1 + len(more)}", str(saved))
    called = "model" if name is None else name
    files: Mapping[str, str | bytes]
    files = model_in_c(found, name=called, precision=precision) if to == "c" else model_in_mat(found, name=called)
    prepare_output(out)
    written = write_files(out, files)
    emit(
        json_text([{"outcome": "ok", "folder": str(out), "files": written}])
        if as_json
        else f"{out}: {', '.join(written)}"
    )


def _states(names: str) -> tuple[str, ...]:
    from estimation.eha.by_filter import FilterOptions

    return FilterOptions(states=split_names(names)).names


def _filter(
    bench: "Rig",
    record: "Record",
    form: str,
    method: str,
    states: tuple[str, ...],
    name: str | None,
    precision: str,
    *,
    tune: bool,
) -> tuple[Mapping[str, str], dict[str, Any]]:
    from estimation.export.c_filter import filter_in_c
    from estimation.export.task import filter_task

    problem = filter_task(record, bench.parameters, form, states=states, tuned=tune)
    if precision == "float" and form != "pressure":
        note(f"warning: the {form} form needs double: in float its estimates were off by 1 % to more than their size")
    called = name if name is not None else f"{form}_{method}"
    about = {"form": form, "method": method, "channels": list(problem.channels), "sample_time_s": problem.sample_time}
    return filter_in_c(problem, method, name=called, precision=precision), about


def _plant(
    bench: "Rig", plant: str, sample_time: float, name: str | None, precision: str
) -> tuple[Mapping[str, str], dict[str, Any]]:
    from plant.eha.simulate import PLANTS
    from plant.errors import require_known
    from plant.export.c_plant import plant_in_c

    require_known("--plant", plant, PLANTS)
    called = name if name is not None else f"{plant}_plant"
    files = plant_in_c(PLANTS[plant], bench.parameters, sample_time, name=called, precision=precision)
    return files, {"plant": plant, "sample_time_s": sample_time}


def _bench_log(
    log: Path | None, bench: "Rig", columns: Mapping[str, str], sample_time: float | None, *, no_pressure: bool
) -> "Record":
    """Return the log for which a filter is made; a simulated one if none is given."""
    if log is None:
        record = _simulated_bench(bench, sample_time or SAMPLE_TIME)
    else:
        record = read_and_warn(str(log), lambda: read_log(log, bench.columns, columns, sample_time=sample_time))
    return record.replace(differential_pressure_pa=None) if no_pressure else record


def _simulated_bench(bench: "Rig", sample_time: float) -> "Record":
    import numpy as np

    from plant.eha.drives import sine
    from plant.eha.simulate import LUMPED, simulate
    from plant.sensors.sensors import BENCH

    drive = sine(10_000 * sample_time, sample_time, bench.parameters.rated_speed, 5e-4 / sample_time)
    return simulate(LUMPED, drive, sample_time, bench.parameters, sensors=BENCH, rng=np.random.default_rng(0))


def write_files(folder: Path, files: Mapping[str, str | bytes]) -> list[str]:
    """Write files into a folder; no partial file is left behind.

    Raises
    ------
    HydrostateError
        If one cannot be written.
    """
    from plant.atomic import replacing

    for name, content in files.items():
        with os_errors_as(f"{folder / name}: it cannot be written"), replacing(folder / name) as file:
            file.write(content if isinstance(content, bytes) else content.encode())
    return list(files)
