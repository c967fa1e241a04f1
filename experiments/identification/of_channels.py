"""`hydrostate identify LOG...`: the transfer function between two channels of a bench, one for each log."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from estimation.identification.structure_names import STRUCTURE_NAMES
from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import catch_and_repeat_warnings, finish, read_log, run_logs, with_remarks
from experiments.command.options import require_positive
from experiments.command.output_paths import page_place, paths_by_owner
from experiments.command.pages import Pages
from experiments.command.terminal import note, short_names, table
from experiments.identification.entries import FORMAT_VERSION, gains_shown, linear_entries
from plant.errors import require_known

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.arrays import Array
    from estimation.identification.model.linear_model import LinearModel
    from estimation.identification.structure_names import StructureName
    from plant.eha.rig import Rig

INPUT, OUTPUT = "motor_speed_rad_s", "velocity_m_s"
"""Default input and output channels."""

TABLE_6_TIME = 1e-3
"""Sample time of Table 6 as inferred [s] (errata E14)."""

STRUCTURES: "Mapping[str, StructureName | None]" = {**STRUCTURE_NAMES, "auto": None}
"""Values of ``--structure``; auto compares the first four on held-back data."""

HIGHEST_ORDER = 4
"""``--order auto`` compares orders up to this by BIC."""

MOST_PROFILED, MOST_TESTED = 100_000, 50_000
"""Longest log whose gain is profiled if a pole is nearly cancelled, and maximum number of samples in residual tests."""

NOTHING: Result = {
    "format_version": FORMAT_VERSION,
    **dict.fromkeys(("structure", "numerator", "denominator", "sample_time_s", "fit_percent", "covariance")),
    "dc_gain": {"value": None, "std": None, "ci95": None},
    **dict.fromkeys(("bandwidth_hz", "bandwidth_std_hz", "poles", "zeros")),
    "delay": {"samples": None, "seconds": None},
    "validation": {"whiteness_p": None, "cross_correlation_p": None},
}


@dataclass(frozen=True, kw_only=True)
class ChannelFit:
    """Options of a fit between two channels.

    Parameters
    ----------
    order, delay : int or None
        Order and delay of the model; None lets the data choose.
    numerator : int or None
        Number of numerator coefficients; one more than the order if None.
    sample_time : float or None
        Sample time of the model, and of a log without a column of time [s].
    filter_hz : float or None
        Cut-off frequency of a low-pass before the fit [Hz].
    """

    input: str = INPUT
    output: str = OUTPUT
    structure: str = "output-error"
    order: int | None = 2
    delay: int | None = 0
    numerator: int | None = None
    sample_time: float | None = None
    filter_hz: float | None = None
    figure: Path | None = None
    report: Path | None = None
    seed: int = 0


def identify_channels(
    logs: Sequence[Path], fit: ChannelFit, rig: "Rig", columns: Mapping[str, str], *, as_json: bool, out: Path | None
) -> NoReturn:
    """Identify one model for each log, print its quality, and exit with the exit code.

    Raises
    ------
    HydrostateError
        If an option is not usable.
    """
    from estimation.identification.from_record import identify_record, record_signals
    from plant.errors import NoChannelError

    form = _form(fit)
    require_positive("--sample-time", fit.sample_time, "s")
    require_positive("--filter-hz", fit.filter_hz, "Hz")
    prepare_output(out, logs)
    figures, pages = paths_by_owner(fit.figure, logs), Pages(paths_by_owner(page_place(fit.report), logs))
    chosen = {"input": fit.input, "output": fit.output, "rig": rig.name, "seed": fit.seed}

    def work(log: Path) -> Result:
        try:
            record = read_log(log, rig.columns, columns, sample_time=fit.sample_time, of_model=True)
        except NoChannelError as error:
            hint = "--input COLUMN --output COLUMN relates any others"
            raise NoChannelError(f"{error.message}; {hint}", error.source) from error
        taken: dict[str, Any] = {"output": fit.output, "input": fit.input, "filter_cutoff_hz": fit.filter_hz}
        taken["sample_time"] = max(TABLE_6_TIME, record.sample_time) if fit.sample_time is None else fit.sample_time
        with catch_and_repeat_warnings() as said:
            model = identify_record(record, **taken, **form)
        u, y = record_signals(record, **taken)
        result = {**chosen, **linear_entries(model), **_validation_entries(model, u, y, log, figures.get(log))}
        if log in pages.places:
            pages.write(log, _page(with_remarks({"file": str(log), **result}, said), model, u, y))
        return result

    batch = run_logs(logs, work, {**NOTHING, **chosen}, "identifying")
    pages.tell()
    finish(batch, _screen, as_json=as_json, out=out, lost=bool(pages.unwritten))


def _page(result: Result, model: "LinearModel", u: "Array", y: "Array") -> str:
    """Return the page of a model, with the fit of a model of its size on a held-back third of the log."""
    from estimation.identification.choose import held_back_percent
    from experiments.log_pages.identified_page import identified_page
    from experiments.log_pages.identified_view import view_of_channels

    return identified_page(
        view_of_channels({**result, "held_back_percent": held_back_percent(model, u, y)}, model, u, y)
    )


def page_of_new_model(model: "LinearModel", u: "Array", y: "Array", title: str) -> str:
    """Return the page of a model that no command has validated yet.

    Parameters
    ----------
    u, y : ndarray, shape (n,)
        Input without gaps, and output, NaN where missing [in the channels' units].
    title : str
        Name of the log on the page.
    """
    ends = {"input": model.input_name, "output": model.output_name}
    return _page(
        {"file": title, **ends, **linear_entries(model), **_validation_entries(model, u, y, Path(title), None)},
        model,
        u,
        y,
    )


def _form(fit: ChannelFit) -> dict[str, Any]:
    """Return the form of the model as `identify_record` takes it."""
    require_known("--structure", fit.structure, list(STRUCTURES))
    order = fit.order or 2
    direct = fit.order is None or not fit.delay
    return {
        "n_numerator": order + direct if fit.numerator is None else fit.numerator,
        "n_denominator": order,
        "delay": fit.delay or 0,
        "structure": STRUCTURES[fit.structure],
        "orders": range(1, HIGHEST_ORDER + 1) if fit.order is None else None,
        "estimate_dead_time": fit.delay is None,
        "covariance": "auto" if fit.filter_hz is None else "coloured",
    }


def _validation_entries(model: "LinearModel", u: "Array", y: "Array", log: Path, figure: Path | None) -> dict[str, Any]:
    """Return the residual tests of the model and the gain's interval; draw both if requested."""
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
        from experiments.log_pages.identified_figure import write_identified

        write_identified(model, u, y, found, log.name, figure)
    tests = {"whiteness_p": found.whiteness.p_value, "cross_correlation_p": found.cross_correlation.p_value}
    return entries | {"validation": tests}


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    unit = "m/rad" if (results[0]["input"], results[0]["output"]) == (INPUT, OUTPUT) else "SI"
    shown = table("log", "fit [%]", f"gain [{unit}]", "bandwidth [Hz]", "coefficients, q^0 q^-1 ...")
    for name, result in zip(short_names(results), results, strict=True):
        bandwidth = "-" if result["bandwidth_hz"] is None else f"{result['bandwidth_hz']:.3g}"
        coefficients = f"b {_spaced_numbers(result['numerator'])}\nf {_spaced_numbers(result['denominator'])}"
        said = (f"{result['fit_percent']:.2f}", gains_shown(result), bandwidth)
        shown.add_row(name, *said, coefficients)
    yield shown
    ends = f"From {results[0]['input']} to {results[0]['output']}"
    yield f"{ends}, ± one standard deviation; sample times are in --json and --out."


def _spaced_numbers(values: Sequence[float]) -> str:
    return "  ".join(f"{value:.5g}" for value in values)
