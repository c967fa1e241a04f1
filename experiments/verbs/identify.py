"""`hydrostate identify LOG...`: the discrete transfer function of each log."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from estimation.identification.structure_names import STRUCTURE_NAMES
from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import finish, read_log, run_logs
from experiments.command.options import (
    SEED,
    Columns,
    Json,
    Logs,
    Out,
    RigFile,
    Seed,
    load_columns,
    load_rig,
    option,
    refuse_given,
    require_png,
    require_positive,
)
from experiments.command.own_paths import own_paths, require_place
from experiments.command.terminal import note, short_names, table
from experiments.identification.of_columns import Asked, identify_any, names
from experiments.identification.simulate_model import simulate_model
from plant.errors import HydrostateError, require_known

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.arrays import Array
    from estimation.identification.model.linear_model import LinearModel
    from estimation.identification.structure_names import StructureName

INPUT, OUTPUT = "motor_speed_rad_s", "velocity_m_s"
"""Channels that are related where none are named."""

TABLE_6_TIME = 1e-3
"""Sample time of Table 6 as we read it [s] (errata E14)."""

FORMAT_VERSION = 1
"""Of a written library: later versions add entries and rename none."""

STRUCTURES: "Mapping[str, StructureName | None]" = {**STRUCTURE_NAMES, "auto": None}
"""What ``--structure`` takes; auto compares the first four on data held back."""

HIGHEST_ORDER = 4
"""``--order auto`` compares orders up to this by BIC."""

MOST_PROFILED, MOST_TESTED = 100_000, 50_000
"""Longest log whose gain is profiled where a pole is nearly cancelled, and samples that residual tests are given."""

NOTHING: Result = {
    "format_version": FORMAT_VERSION,
    **dict.fromkeys(("structure", "numerator", "denominator", "sample_time_s", "fit_percent", "covariance")),
    "dc_gain": {"value": None, "std": None, "ci95": None},
    **dict.fromkeys(("bandwidth_hz", "bandwidth_std_hz", "poles", "zeros")),
    "delay": {"samples": None, "seconds": None},
    "validation": {"whiteness_p": None, "cross_correlation_p": None},
}

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate identify prbs.csv --structure auto --order auto --out library.json")
def identify(
    logs: Logs,
    structure: Annotated[
        str,
        option(
            "NAME",
            f"{', '.join([*STRUCTURES, 'narx', 'hammerstein', 'state-space'])}; auto takes the best on held-back data. "
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
    from estimation.identification.from_record import identify_record, record_signals
    from plant.errors import NoChannelError

    require_png("--figure", figure)
    require_png("--response", response)
    for name, place in (("--figure", figure), ("--response", response), ("--simulated", simulated)):
        require_place(name, place)
    related = any(one is not None for one in (inputs, outputs, references, simulate))
    any_columns = related and rig is None and not columns
    if any_columns or structure in ("narx", "hammerstein", "state-space"):
        of_channels = {"--rig": rig, "--columns": columns, "--filter-hz": filter_hz}
        refuse_given(of_channels, "does not go with --input and --output, which take columns as they stand in the log")
        asked = Asked(
            names(inputs),
            names(outputs),
            names(references),
            structure=structure,
            order=_given("--order", order, 1),
            delay=_given("--delay", delay, 0),
            numerator=numerator,
            sample_time=sample_time,
            resampled=resample,
            validate=tuple(validate or ()),
            figure=figure,
            simulated=simulated,
            response=response,
        )
        if simulate is not None:
            of_fits = {"--validate": validate, "--figure": figure, "--response": response, "--resample": resample}
            refuse_given(of_fits, "goes with a fit, not with --simulate")
            simulate_model(logs, simulate, asked, as_json=as_json, out=out)
        identify_any(logs, asked, as_json=as_json, out=out)
    of_columns = {"--reference": references, "--simulate": simulate, "--simulated": simulated, "--validate": validate}
    of_columns |= {"--response": response, "--resample": resample}
    refuse_given(of_columns, "goes with --input and --output that name columns, without --rig and --columns")
    order, delay = order or "2", delay or "0"
    input_channel = _one_channel("--input", inputs, INPUT)
    output_channel = _one_channel("--output", outputs, OUTPUT)
    form = _form(structure, order, delay, numerator)
    form["covariance"] = "auto" if filter_hz is None else "coloured"
    require_positive("--sample-time", sample_time, "s")
    require_positive("--filter-hz", filter_hz, "Hz")
    bench, mapping = load_rig(rig), load_columns(columns)
    prepare_output(out)
    figures = own_paths(figure, logs)
    chosen = {"input": input_channel, "output": output_channel, "rig": bench.name, "seed": seed}

    def work(log: Path) -> Result:
        try:
            record = read_log(log, bench.columns, mapping, sample_time=sample_time)
        except NoChannelError as error:
            hint = "--input COLUMN --output COLUMN relates any others"
            raise NoChannelError(f"{error.message}; {hint}", error.source) from error
        taken: dict[str, Any] = {"output": output_channel, "input": input_channel, "filter_cutoff_hz": filter_hz}
        taken["sample_time"] = max(TABLE_6_TIME, record.sample_time) if sample_time is None else sample_time
        model = identify_record(record, **taken, **form)
        u, y = record_signals(record, **taken)
        return {**chosen, **linear_entries(model), **_judged(model, u, y, log, figures.get(log))}

    batch = run_logs(logs, work, {**NOTHING, **chosen}, "identifying")
    finish(batch, _screen, as_json=as_json, out=out)


def _one_channel(option: str, given: list[str] | None, default: str) -> str:
    channel, *others = names(given) or (default,)
    if others:
        raise HydrostateError(f"{option} takes one channel with --rig or --columns, got {channel}, {', '.join(others)}")
    return channel


def _form(structure: str, order: str, delay: str, numerator: int | None) -> dict[str, Any]:
    """Return the form of the model as `identify_record` takes it."""
    require_known("--structure", structure, list(STRUCTURES))
    wanted_order, wanted_delay = whole_or_auto("--order", order, 1), whole_or_auto("--delay", delay, 0)
    fixed = wanted_order or 2
    direct = wanted_order is None or not wanted_delay
    return {
        "n_numerator": fixed + direct if numerator is None else numerator,
        "n_denominator": fixed,
        "delay": wanted_delay or 0,
        "structure": STRUCTURES[structure],
        "orders": range(1, HIGHEST_ORDER + 1) if wanted_order is None else None,
        "estimate_dead_time": wanted_delay is None,
    }


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


def _given(option: str, text: str | None, least: int) -> int | None:
    return None if text is None else whole_or_auto(option, text, least)


def linear_entries(model: "LinearModel") -> dict[str, Any]:
    """Return a transfer function by the names of the JSON contract."""
    bandwidth = model.bandwidth_hz
    extent = "not below the Nyquist frequency" if bandwidth is None else f"{bandwidth:.3g} Hz"
    return {
        "outcome": "ok",
        **model.to_dict(),
        "bandwidth_hz": bandwidth,
        "bandwidth_std_hz": model.bandwidth_std_hz,
        "poles": with_std(model.poles, model.pole_std),
        "zeros": with_std(model.zeros, model.zero_std),
        "format_version": FORMAT_VERSION,
        "delay": {"samples": model.delay, "seconds": model.delay * model.sample_time},
        "message": (
            f"{model.structure} of order {model.denominator.size - 1}, fit {model.fit_percent:.1f} %, "
            f"gain {model.dc_gain:.4g}, bandwidth {extent}"
        ),
    }


def _judged(model: "LinearModel", u: "Array", y: "Array", log: Path, figure: Path | None) -> dict[str, Any]:
    """Return what the data say of the model: tests of its residual, and the gain's interval; draw both if wanted."""
    from estimation.finding import interval_95
    from estimation.identification.fit.profile_interval import dc_gain_interval
    from estimation.identification.fit.validate import validate

    gain, std = model.dc_gain, model.dc_gain_std
    fitted = model.structure == "output-error"
    interval = interval_95(gain, std)
    if fitted and model.cancellations and u.size <= MOST_PROFILED:
        interval = dc_gain_interval(model, u, y)
    entries: dict[str, Any] = {"dc_gain": {"value": gain, "std": std, "ci95": interval}}
    if not model.is_stable:
        if figure is not None:
            note(f"no figure: the model of {log.name} is unstable, so it cannot be simulated")
        return entries | {"validation": NOTHING["validation"]}
    part = slice(0, MOST_TESTED)
    found = validate(model.discretised() if model.continuous else model, u[part], y[part], fitted=fitted)
    if figure is not None:
        from experiments.log_pages.identified import write_identified

        write_identified(model, u, y, found, log.name, figure)
    tests = {"whiteness_p": found.whiteness.p_value, "cross_correlation_p": found.cross_correlation.p_value}
    return entries | {"validation": tests}


def with_std(roots: Any, spreads: Any) -> list[dict[str, float]]:
    """Return complex numbers with their standard deviations, by the names of the JSON contract."""
    return [
        {"real": float(r.real), "imag": float(r.imag), "real_std": float(s.real), "imag_std": float(s.imag)}
        for r, s in zip(roots, spreads, strict=True)
    ]


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table("log", "fit [%]", "gain", "bandwidth [Hz]", "coefficients, q^0 q^-1 ...")
    for name, result in zip(short_names(results), results, strict=True):
        gain = result["dc_gain"]
        bandwidth = "-" if result["bandwidth_hz"] is None else f"{result['bandwidth_hz']:.3g}"
        coefficients = f"b {_spaced(result['numerator'])}\nf {_spaced(result['denominator'])}"
        said = (f"{result['fit_percent']:.2f}", f"{gain['value']:.4g} ± {gain['std']:.1g}", bandwidth)
        shown.add_row(name, *said, coefficients)
    yield shown
    ends = f"From {results[0]['input']} to {results[0]['output']}"
    yield f"{ends}, ± one standard deviation; sample times are in --json and --out."


def _spaced(values: Sequence[float]) -> str:
    return "  ".join(f"{value:.5g}" for value in values)
