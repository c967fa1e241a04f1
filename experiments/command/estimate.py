"""`hydrostate estimate LOG...`: effective bulk modulus of each log, or a sentence why not."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import finish, read_log, run_logs
from experiments.command.options import (
    MOTOR,
    PRESSURE,
    SEED,
    STACK,
    Columns,
    ConditionName,
    Json,
    Logs,
    Out,
    RigFile,
    Seed,
    StackBias,
    StackHealthy,
    StackLoad,
    StackPlant,
    figure_path,
    load_columns,
    load_rig,
    refuse_given,
    require_one_of,
    require_positive,
)
from experiments.command.streams import clauses, note, short_names, table
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.bulk_modulus import BulkModulusEstimate

ABSENCE_COSTS = (
    f"without {PRESSURE} the estimate rests on how the piston starts, stops and rings, so on a friction model that is "
    "right, which no foreign bench grants; while the piston sticks nothing is left (errata E13)"
)
"""What it costs an estimate that differential pressure is not there."""

MOST_MESSAGES = 3
"""Up to so many logs, everything that speaks against a result is shown."""

SENSORS = {"position": "position_m", "velocity": "velocity_m_s", "dp": PRESSURE}
"""Channels by the names of the option."""

NOTHING: Result = {
    "bulk_modulus_pa": {"value": None, "std": None, "ci95": None},
    "leakage_coefficient_m3_s_pa": None,
    "flow_bias_m3_s": None,
    "states": {},
    "noise": None,
    "nis": {},
    "method": None,
    "form": None,
    "gate": {"passed": False, "reasons": []},
    "bound_percent": None,
    "condition": None,
    "channels": [],
}
"""The entries of a log that could not be used."""

commands = typer.Typer()


@commands.command(
    epilog="Example: hydrostate estimate run1.csv run2.csv --condition minor_leakage --start 5e7 --start-std 1e8 --json"
)
def estimate(
    logs: Logs,
    form: Annotated[
        str,
        typer.Option(
            metavar="FORM",
            help="What is believed: flow (needs position and differential pressure; finds leakage too), motion "
            "(without pressure; finds leakage and friction too), pressure and acceleration (filters that are told "
            "leakage and friction; the latter is the published one), or auto: flow or motion where the log allows.",
        ),
    ] = "auto",
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="least-squares (flow, motion), or a filter: ekf, iekf, ukf, ckf, svsf, sif, smoother, "
            "iterated-smoother, filterpy-ekf; auto: least squares where the form allows.",
        ),
    ] = "auto",
    states: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="What a filter estimates beside bulk modulus, comma-separated: leakage, friction, air, or parameters "
            "such as flow_bias.",
        ),
    ] = "",
    sensors: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="Use these channels alone, comma-separated: position, velocity, dp; piezo-stack: stack, force, "
            "position, pressure. All by default.",
        ),
    ] = "",
    tune: Annotated[
        bool, typer.Option("--tune", help="Tune the filter's noise levels to the log by likelihood.")
    ] = False,
    smooth: Annotated[
        bool, typer.Option("--smooth", help="Smooth: what the whole log says of every sample (method smoother).")
    ] = False,
    robust: Annotated[
        str, typer.Option(metavar="HOW", help="How gross outliers count in a filter: none, huber or student-t.")
    ] = "none",
    figure: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="Draw the filtered estimate with its 95 % band, innovations and NIS."),
    ] = None,
    plant: StackPlant = None,
    bias_pressure: StackBias = None,
    load: StackLoad = None,
    healthy: StackHealthy = None,
    condition: ConditionName = None,
    rig: RigFile = None,
    columns: Columns = None,
    start: Annotated[
        float | None, typer.Option(metavar="PA", help="First guess of bulk modulus [Pa]; the rig's if not given.")
    ] = None,
    start_std: Annotated[
        float,
        typer.Option(
            metavar="PA", help="Standard deviation of the first guess [Pa]; convergence needs 1e8.", show_default="3e8"
        ),
    ] = 3e8,
    no_pressure: Annotated[
        bool, typer.Option("--no-pressure", help="Use position and velocity alone, even if pressure is logged.")
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
    if plant is not None:
        from experiments.command.plant_logs import plant_logs_command

        plant_logs_command(
            plant,
            logs,
            diagnosing=False,
            sensors=sensors,
            bias_pressure=bias_pressure,
            load=load,
            healthy_log=healthy,
            expected=None,
            columns=columns,
            out=out,
            as_json=as_json,
        )
    refuse_given(
        {"--bias-pressure": bias_pressure, "--load": load, "--healthy": healthy}, f"needs --plant {STACK} or {MOTOR}"
    )
    from estimation.augment import AUGMENTABLE
    from estimation.bulk_modulus import FITTED, LEAST_SQUARES, estimate_bulk_modulus
    from estimation.eha import FORMS
    from estimation.filter_estimate import GROUPS
    from estimation.run import METHODS, ROBUST
    from faults.conditions import find_condition, parameters_for

    require_one_of("--form", form, ["auto", *FITTED, *FORMS])
    require_one_of("--method", method, ["auto", LEAST_SQUARES, *METHODS])
    require_one_of("--robust", robust, list(ROBUST))
    wanted, used = _listed(states), _listed(sensors)
    for name in used:
        require_one_of("--sensors", name, list(SENSORS))
    if smooth and method not in ("auto", "ekf", "smoother"):
        raise HydrostateError(f"--smooth smooths the ekf, got --method {method}")
    method = "smoother" if smooth else method
    for name in wanted:
        require_one_of("--states", name, [*GROUPS, *AUGMENTABLE])
    require_positive("--start-std", start_std, "Pa")
    if start != 0.0:
        require_positive("--start", start, "Pa")
    bench, mapping = load_rig(rig), load_columns(columns)
    parameters = bench.parameters
    if condition is not None:
        parameters = parameters_for(find_condition(condition), parameters)
    prepare_output(out)
    chosen = {"condition": condition, "rig": bench.name, "seed": seed}

    def work(log: Path) -> Result:
        record = read_log(log, bench.columns, mapping)
        unused = {channel for name, channel in SENSORS.items() if used and name not in used}
        if no_pressure:
            unused.add(PRESSURE)
        record = record.replace(**{channel: None for channel in unused if channel in record})
        found = estimate_bulk_modulus(
            record,
            parameters,
            form=form,
            method=method,
            start=start,
            start_std=start_std,
            uncertainties=bench.uncertainties,
            states=wanted,
            tuned=tune,
            robust=robust,
        )
        path = figure_path(figure, log, len(logs))
        if path is not None:
            _draw(found, path, log)
        return {**_entries(found), **chosen}

    batch = run_logs(logs, work, {**NOTHING, **chosen}, "estimating")
    if condition is None and any(result["form"] not in (None, "flow") for result in batch.results):
        note(f"no --condition: leakage and friction were taken to be those of the rig {bench.name!r}, healthy")
    finish(batch, _screen, as_json=as_json, out=out)


def _listed(names: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in names.split(",") if name.strip())


def _draw(found: "BulkModulusEstimate", path: Path, log: Path) -> None:
    """Write the figure of a filtered log."""
    from experiments.figures.innovations import write_innovations

    if found.estimate is None:
        note(f"no figure: {log.name} was not filtered; ask for one with --method ekf")
        return
    write_innovations(found, log.name, path)


def _entries(found: "BulkModulusEstimate") -> dict[str, Any]:
    return {
        "outcome": found.outcome.value,
        "bulk_modulus_pa": {"value": found.value, "std": found.std, "ci95": found.interval},
        "leakage_coefficient_m3_s_pa": _number(found.others.get("leakage_coefficient")),
        "flow_bias_m3_s": _number(found.others.get("flow_bias")),
        "nis": dict(found.nis),
        "method": found.method,
        "states": {name: _number(value) for name, value in found.others.items()},
        "noise": None if found.tuning is None else {**found.tuning.tuned.noise, **found.tuning.tuned.variances},
        "form": found.form,
        "gate": {"passed": found.gate.passed, "reasons": list(found.gate.reasons)},
        "bound_percent": 100.0 * found.bound,
        "channels": list(found.channels),
        "message": _message(found),
    }


def _number(found: tuple[float, float] | None) -> dict[str, Any] | None:
    from estimation.bulk_modulus import NORMAL_95

    if found is None:
        return None
    value, std = found
    return {"value": value, "std": std, "ci95": [value - NORMAL_95 * std, value + NORMAL_95 * std]}


def _message(found: "BulkModulusEstimate") -> str:
    from estimation.bulk_modulus import OUTCOMES

    if found.value is not None and found.interval is not None:
        low, high = (1e-6 * end for end in found.interval)
        said = [f"bulk modulus {1e-6 * found.value:.2f} MPa, 95 % interval {low:.2f} to {high:.2f} MPa"]
        if not found.gate.passed:
            said.append(f"not to be relied on: {clauses(found.gate.reasons)}")
    else:
        said = [OUTCOMES[found.outcome]]
    return clauses([*said, *_absence(found.channels, found.form)])


def _absence(channels: Sequence[str], form: str) -> list[str]:
    """Return what is lost where differential pressure is not used, nothing where it is."""
    if PRESSURE in channels:
        return []
    if form == "acceleration":
        return [f"the acceleration form does not use {PRESSURE}, and breaks down at reversals (errata E9)"]
    return [ABSENCE_COSTS]


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table("log", "bulk modulus [MPa]", "95 % interval [MPa]", "bound [%]", "verdict")
    for name, result in zip(short_names(results), results, strict=True):
        shown.add_row(name, *_cells(result))
    yield shown
    lost = [text for result in results for text in _absence(result["channels"], result["form"])]
    doubtful = [result for result in results if not result["gate"]["passed"]]
    if len(results) <= MOST_MESSAGES:
        for result in doubtful:
            yield f"{result['file']}: {result['message'].removesuffix(f'; {lost[0]}' if lost else '')}"
    elif doubtful:
        yield f"{len(doubtful)} of {len(results)} logs gave nothing to be relied on; --json and --out give the reasons"
    if lost:
        yield f"{len(lost)} of {len(results)} logs: {lost[0]}"


def _cells(result: Result) -> list[str]:
    modulus = result["bulk_modulus_pa"]
    verdict = result["outcome"].replace("_", " ")
    bound = f"{result['bound_percent']:.2g}"
    if modulus["value"] is None:
        return ["-", "-", bound, verdict]
    low, high = (f"{1e-6 * end:.2f}" for end in modulus["ci95"])
    trusted = verdict if result["gate"]["passed"] else "doubtful"
    return [f"{1e-6 * modulus['value']:.2f}", f"{low} to {high}", bound, trusted]
