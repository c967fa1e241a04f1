"""`hydrostate identify LOG...`: the discrete transfer function of each log, or a model between any columns."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import typer

from experiments.command.options import (
    SEED,
    Columns,
    Json,
    Logs,
    Out,
    Report,
    RigFile,
    Seed,
    load_columns,
    load_rig,
    refuse_ineffective_options,
    split_names,
)
from experiments.command.output_paths import require_place
from experiments.identification.of_channels import INPUT, OUTPUT, ChannelFit, identify_channels
from experiments.identification.of_columns import ColumnFit, identify_columns
from experiments.identification.options import (
    ONLY_BETWEEN_COLUMNS,
    Delay,
    Figure,
    FilterHz,
    Inputs,
    Numerator,
    Order,
    Outputs,
    References,
    Resample,
    Response,
    SampleTime,
    Simulate,
    Simulated,
    StructureName,
    Validate,
)
from experiments.identification.simulate_model import simulate_model
from plant.errors import HydrostateError

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate identify prbs.csv --structure auto --order auto --out library.json")
def identify(
    logs: Logs,
    structure: StructureName = "output-error",
    order: Order = None,
    numerator: Numerator = None,
    delay: Delay = None,
    sample_time: SampleTime = None,
    resample: Resample = None,
    filter_hz: FilterHz = None,
    inputs: Inputs = None,
    outputs: Outputs = None,
    references: References = None,
    validate: Validate = None,
    simulate: Simulate = None,
    simulated: Simulated = None,
    figure: Figure = None,
    response: Response = None,
    report: Report = None,
    rig: RigFile = None,
    columns: Columns = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Identify a transfer function: from motor speed [rad/s] to velocity [m/s] of each log, or between any columns.

    With --input and --output, the model relates any columns, in any unit. Several logs are then experiments on the same
    plant, each with its own initial state, and its own offset where these differ. Free runs on held-back blocks choose
    order, dead time and structure. Fit and rms error are always those of the free run. `--columns time_s=T:ms` names
    the column of time, if it is called otherwise.

    Without them, the command makes an output-error fit with covariance; the defaults are the form of Table 6.
    Differential pressure is not used, so its absence costs nothing. Nothing is random, so the seed changes nothing.
    `--out library.json` writes one entry per log at full precision; `LinearModel.from_dict` reads it.
    """
    require_place("--figure", figure, ".png")
    require_place("--response", response, ".png")
    require_place("--simulated", simulated, logs=logs)
    asked: dict[str, Any] = {
        "structure": structure,
        "numerator": numerator,
        "sample_time": sample_time,
        "figure": figure,
        "report": report,
    }
    related = any(one is not None for one in (inputs, outputs, references, simulate))
    from plant.log.any_columns import time_alone

    mapping = load_columns(columns)
    time = time_alone(mapping)
    if (related and rig is None and (not mapping or time)) or structure in ONLY_BETWEEN_COLUMNS:
        of_channels = {"--rig": rig, "--columns": None if time else columns, "--filter-hz": filter_hz}
        refuse_ineffective_options(
            of_channels,
            "does not go with --input and --output, which take columns as they stand in the log; only the time may be "
            "named, --columns time_s=NAME:UNIT",
        )
        between = ColumnFit(
            split_names(*(inputs or ())),
            split_names(*(outputs or ())),
            split_names(*(references or ())),
            order=whole_or_auto("--order", order or "auto", 1),
            delay=whole_or_auto("--delay", delay or "auto", 0),
            resampled=resample,
            time=time,
            validate=tuple(validate or ()),
            simulated=simulated,
            response=response,
            **asked,
        )
        _relate_columns(logs, between, simulate, as_json=as_json, out=out)
    of_columns = {"--reference": references, "--simulate": simulate, "--simulated": simulated, "--validate": validate}
    of_columns |= {"--response": response, "--resample": resample}
    refuse_ineffective_options(
        of_columns, "goes with --input and --output that name columns, without --rig and --columns"
    )
    from estimation.identification.free_run.data import MOST_ORDER

    fit = ChannelFit(
        input=_one_channel("--input", inputs, INPUT),
        output=_one_channel("--output", outputs, OUTPUT),
        order=whole_or_auto("--order", order or "2", 1, MOST_ORDER),
        delay=whole_or_auto("--delay", delay or "0", 0),
        filter_hz=filter_hz,
        seed=seed,
        **asked,
    )
    identify_channels(logs, fit, load_rig(rig), mapping, as_json=as_json, out=out)


def _relate_columns(
    logs: Sequence[Path], fit: ColumnFit, model: Path | None, *, as_json: bool, out: Path | None
) -> NoReturn:
    """Fit a model between any columns, or run a saved one on the logs, and exit."""
    if model is None:
        identify_columns(logs, fit, as_json=as_json, out=out)
    of_fits: dict[str, object] = {"--validate": fit.validate or None, "--figure": fit.figure, "--report": fit.report}
    of_fits |= {"--response": fit.response, "--resample": fit.resampled}
    refuse_ineffective_options(of_fits, "goes with a fit, not with --simulate")
    simulate_model(logs, model, fit, as_json=as_json, out=out)


def _one_channel(option: str, given: list[str] | None, default: str) -> str:
    channel, *others = split_names(*(given or ())) or (default,)
    if others:
        raise HydrostateError(f"{option} takes one channel with --rig or --columns, got {channel}, {', '.join(others)}")
    return channel


def whole_or_auto(option: str, text: str, least: int, most: int | None = None) -> int | None:
    """Return a whole number, or None for ``auto``.

    Returns
    -------
    int or None
        None if the data decide.

    Raises
    ------
    HydrostateError
        If it is neither.

    Examples
    --------
    >>> whole_or_auto("--order", "3", 1), whole_or_auto("--order", "auto", 1)
    (3, None)
    """
    if text == "auto":
        return None
    if not text.isdecimal() or int(text) < least or (most is not None and int(text) > most):
        end = "on" if most is None else f"to {most}"
        raise HydrostateError(f"{option} must be a whole number from {least} {end}, or auto, got {text!r:.40}")
    return int(text)
