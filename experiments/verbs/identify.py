"""`hydrostate identify LOG...`: the discrete transfer function of each log, or a model between any columns."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import (
    SEED,
    Columns,
    Json,
    Logs,
    Out,
    RigFile,
    Seed,
    listed,
    load_columns,
    load_rig,
    option,
    refuse_given,
)
from experiments.command.output_paths import require_place
from experiments.identification.of_channels import INPUT, OUTPUT, STRUCTURES, ChannelFit, identify_channels
from experiments.identification.of_columns import ColumnFit, identify_columns
from experiments.identification.simulate_model import simulate_model
from plant.errors import HydrostateError

ONLY_BETWEEN_COLUMNS = ("narx", "hammerstein", "state-space")
"""Structures that are fitted between any columns only."""

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate identify prbs.csv --structure auto --order auto --out library.json")
def identify(
    logs: Logs,
    structure: Annotated[
        str,
        option(
            "NAME",
            f"{', '.join([*STRUCTURES, *ONLY_BETWEEN_COLUMNS])}; auto takes the best on held-back data. "
            "With --input and --output also: narx (polynomial), hammerstein (dead zone, saturation or backlash before "
            "a linear model), state-space (one model of all outputs; its order is the number of states).",
        ),
    ] = "output-error",
    order: Annotated[
        str | None,
        option(
            "INT|auto",
            "Order of the denominator; auto takes the best by BIC, or with --input and --output the best free run on "
            "held-back blocks.",
            show_default="2; auto with --input",
        ),
    ] = None,
    numerator: Annotated[
        int | None, option("INT", "Number of numerator coefficients; by default one more than the order.", min=1)
    ] = None,
    delay: Annotated[
        str | None, option("INT|auto", "Dead time [samples of the model].", show_default="0; auto with --input")
    ] = None,
    sample_time: Annotated[
        float | None,
        option(
            "S",
            "Sample time of the model [s], and of a log without a time column; by default 1e-3 (Table 6), or the log's "
            "if that is longer. With --input, only of logs without a time column.",
        ),
    ] = None,
    resample: Annotated[
        float | None, option("S", "With --input: sample time of the model [s]; by default the log's.")
    ] = None,
    filter_hz: Annotated[
        float | None,
        option("HZ", "Cut-off of a zero-phase low-pass on input and output before the fit [Hz]; none by default."),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        option(
            "COLUMN",
            "Input: any column in any unit; repeat the option, or separate several by commas.",
            "--input",
            show_default="motor_speed_rad_s",
        ),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        option("COLUMN", "Output, likewise; one model per output.", "--output", show_default="velocity_m_s"),
    ] = None,
    references: Annotated[
        list[str] | None,
        option("COLUMN", "With --input, of a closed loop: what drives it, such as its set-point.", "--reference"),
    ] = None,
    validate: Annotated[
        list[Path] | None, option("LOG", "With --input: a log to test the model on; it is not used for the fit.")
    ] = None,
    simulate: Annotated[
        Path | None,
        option("MODEL", "Simulate this saved model (a file from --out) on the logs instead of fitting one."),
    ] = None,
    simulated: Annotated[
        Path | None, option("CSV", "With --input or --simulate: write time, inputs, measured and simulated output.")
    ] = None,
    figure: Annotated[
        Path | None, option("PNG", "Draw measured and simulated output, the residual, its correlations, and the gain.")
    ] = None,
    response: Annotated[
        Path | None,
        option(
            "PNG",
            "With --input: draw the frequency response; --json also prints it, with the distortion levels of a "
            "multisine.",
        ),
    ] = None,
    rig: RigFile = None,
    columns: Columns = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Identify a transfer function: from motor speed [rad/s] to velocity [m/s] of each log, or between any columns.

    With --input and --output, the model relates any columns, in any unit. Several logs are then experiments on the same
    plant, each with its own offset and initial state. Free runs on held-back blocks choose order, dead time and
    structure. Fit and rms error are always those of the free run.

    Without them, the command makes an output-error fit with covariance; the defaults are the form of Table 6.
    Differential pressure is not used, so its absence costs nothing. Nothing is random, so the seed changes nothing.
    `--out library.json` writes one entry per log at full precision; `LinearModel.from_dict` reads it.
    """
    require_place("--figure", figure, ".png")
    require_place("--response", response, ".png")
    require_place("--simulated", simulated)
    related = any(one is not None for one in (inputs, outputs, references, simulate))
    if (related and rig is None and not columns) or structure in ONLY_BETWEEN_COLUMNS:
        of_channels = {"--rig": rig, "--columns": columns, "--filter-hz": filter_hz}
        refuse_given(of_channels, "does not go with --input and --output, which take columns as they stand in the log")
        between = ColumnFit(
            listed(*(inputs or ())),
            listed(*(outputs or ())),
            listed(*(references or ())),
            structure=structure,
            order=whole_or_auto("--order", "auto" if order is None else order, 1),
            delay=whole_or_auto("--delay", "auto" if delay is None else delay, 0),
            numerator=numerator,
            sample_time=sample_time,
            resampled=resample,
            validate=tuple(validate or ()),
            figure=figure,
            simulated=simulated,
            response=response,
        )
        if simulate is None:
            identify_columns(logs, between, as_json=as_json, out=out)
        of_fits = {"--validate": validate, "--figure": figure, "--response": response, "--resample": resample}
        refuse_given(of_fits, "goes with a fit, not with --simulate")
        simulate_model(logs, simulate, between, as_json=as_json, out=out)
    of_columns = {"--reference": references, "--simulate": simulate, "--simulated": simulated, "--validate": validate}
    of_columns |= {"--response": response, "--resample": resample}
    refuse_given(of_columns, "goes with --input and --output that name columns, without --rig and --columns")
    fit = ChannelFit(
        input=_one_channel("--input", inputs, INPUT),
        output=_one_channel("--output", outputs, OUTPUT),
        structure=structure,
        order=whole_or_auto("--order", order or "2", 1),
        delay=whole_or_auto("--delay", delay or "0", 0),
        numerator=numerator,
        sample_time=sample_time,
        filter_hz=filter_hz,
        figure=figure,
        seed=seed,
    )
    identify_channels(logs, fit, load_rig(rig), load_columns(columns), as_json=as_json, out=out)


def _one_channel(option: str, given: list[str] | None, default: str) -> str:
    channel, *others = listed(*(given or ())) or (default,)
    if others:
        raise HydrostateError(f"{option} takes one channel with --rig or --columns, got {channel}, {', '.join(others)}")
    return channel


def whole_or_auto(option: str, text: str, least: int) -> int | None:
    """Return a whole number, or None for ``auto``.

    Returns
    -------
    int or None
        None where the data are to say.

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
    if not text.isdecimal() or int(text) < least:
        raise HydrostateError(f"{option} must be a whole number from {least} on, or auto, got {text!r}")
    return int(text)
