"""`hydrostate identify LOG --input U --output Y`: a model between any columns, validated, saved and simulated again."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import Batch, catch_and_repeat_warnings, finish, run_logs, with_remarks
from experiments.command.options import require_positive
from experiments.command.output_paths import page_place, paths_by_owner
from experiments.command.pages import Pages
from experiments.command.terminal import table
from experiments.identification.entries import column_entries, gains_shown
from experiments.identification.simulate_model import quality_of, record_of, write_simulated
from plant.errors import HydrostateError, require_known

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.identification.free_run.data import Channels
    from estimation.identification.free_run.identify import Identified
    from plant.log.record import Record


@dataclass(frozen=True)
class ColumnFit:
    """Options of a fit between any columns.

    Parameters
    ----------
    order, delay, numerator : int or None
        Values for every input; None lets the data choose.
    sample_time, resampled : float or None
        Sample time of logs without a column of time, and of the model [s].
    time : str or None
        The column of time under another name, with its unit: ``"T_MS:ms"``.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    references: tuple[str, ...] = ()
    structure: str = "output-error"
    order: int | None = None
    delay: int | None = None
    numerator: int | None = None
    sample_time: float | None = None
    resampled: float | None = None
    time: str | None = None
    validate: tuple[Path, ...] = ()
    figure: Path | None = None
    report: Path | None = None
    simulated: Path | None = None
    response: Path | None = None


OUTPUT_NONLINEARITIES = ("absolute-value", "cut-off", "stops")
"""Kinds of nonlinearity at the output, such as friction; all others are at the input."""

BLANK: Result = {
    **dict.fromkeys(("inputs", "input", "output", "structure", "order", "n_values", "sample_time_s")),
    **dict.fromkeys(("fit_percent", "rmse", "one_step_percent", "one_step_rmse", "held_back_percent", "offset")),
    **dict.fromkeys(("numerator", "denominator", "dc_gain", "poles", "delay", "nonlinearity", "error_model", "test")),
    **dict.fromkeys(("model", "frequency_response")),
    "candidates": [],
}
"""Entries of a log that could not be used."""


def identify_columns(logs: Sequence[Path], fit: ColumnFit, *, as_json: bool, out: Path | None) -> NoReturn:
    """Identify one model for each output from all logs together, print its quality, and exit with the exit code.

    Raises
    ------
    HydrostateError
        If an option is not usable.
    """
    from estimation.identification.free_run.from_records import channels_of
    from estimation.identification.free_run.identify import FREE_STRUCTURES
    from estimation.identification.state_space.identify import STATE_SPACE

    if not fit.inputs or not fit.outputs:
        raise HydrostateError("--input and --output go together and need at least one column each")
    if twice := set(fit.inputs) & set(fit.outputs):
        raise HydrostateError(f"--input and --output must be different channels, got {min(twice)!r} for both")
    for option, named in (("--input", fit.inputs), ("--output", fit.outputs)):
        if len(set(named)) < len(named):
            raise HydrostateError(f"{option} must name each column once, got {', '.join(named)}")
    require_known("--structure", fit.structure, (*FREE_STRUCTURES, STATE_SPACE))
    require_positive("--sample-time", fit.sample_time, "s")
    require_positive("--resample", fit.resampled, "s")
    prepare_output(out, logs)
    read: list[list[Record]] = []
    shared: dict[str, Identified] = {}

    def work(name: Path) -> Result:
        output = columns[name]
        if not read:
            wanted, references = (*fit.inputs, *fit.outputs), fit.references
            read.append([record_of(log, (*wanted, *references), fit) for log in logs])
            read.append([record_of(log, wanted, fit) for log in fit.validate])
        together = fit.structure == STATE_SPACE or (fit.structure == "auto" and len(fit.outputs) > 1)
        if together and not shared:
            shared.update(_identify_outputs(read[0], fit, fit.outputs))
        with catch_and_repeat_warnings() as said:
            found = shared.get(output) or _identify_outputs(read[0], fit, (output,))[output]
            result = _output_result(found, read, output, fit, logs)
        if output in pages.places:
            about = with_remarks({"file": ", ".join(map(str, logs)), **result}, said)
            data = found.at_one_offset(channels_of(read[0], fit.inputs, output, fit.resampled))
            pages.write(output, _page(about, found, data))
        return result

    columns = {Path(output): output for output in fit.outputs}  # Path shortens some names, such as "x/."
    pages = Pages(paths_by_owner(page_place(fit.report), fit.outputs))
    batch = run_logs(list(columns), work, BLANK, "identifying")
    named = ", ".join(str(log) for log in logs)
    results = tuple({**result, "file": named} for result in batch.results)
    pages.tell()
    finish(Batch(results, batch.total), _screen, as_json=as_json, out=out, lost=bool(pages.unwritten))


def _page(result: Result, found: "Identified", data: "Channels") -> str:
    from experiments.log_pages.identified_page import identified_page
    from experiments.log_pages.identified_view import view_of_columns

    return identified_page(view_of_columns(result, found.model, data))


def _identify_outputs(records: "Sequence[Record]", fit: ColumnFit, outputs: Sequence[str]) -> "dict[str, Identified]":
    """Return the identified models of some outputs, by name."""
    from estimation.identification.two_stage import identify_columns as fit_columns

    form = {"order": fit.order, "delay": fit.delay, "n_numerator": fit.numerator, "structure": fit.structure}
    clock, references = fit.resampled, fit.references
    found, _ = fit_columns(records, fit.inputs, outputs, references=references, sample_time=clock, options=form)
    return dict(zip(outputs, found, strict=True))


def _output_result(
    found: "Identified", read: "Sequence[Sequence[Record]]", output: str, fit: ColumnFit, logs: Sequence[Path]
) -> Result:
    from estimation.identification.free_run.from_records import channels_of

    records, tests = read
    test = None
    if tests:
        named = f"--validate {', '.join(map(str, fit.validate))}"
        try:
            held = channels_of(tests, fit.inputs, output, found.model.sample_time, split=True)
        except HydrostateError as wrong:
            raise HydrostateError(f"{named}: {wrong}") from wrong
        test = {"files": [str(one) for one in fit.validate], **_validated(found, held, named)}
    if not (fit.figure or fit.simulated or fit.response):
        return {**BLANK, **column_entries(found), "test": test, "frequency_response": None}
    data = found.at_one_offset(channels_of(records, fit.inputs, output, fit.resampled))
    figure = paths_by_owner(fit.figure, fit.outputs).get(output)
    if figure is not None:
        from experiments.log_pages.free_run_figure import write_free_run

        write_free_run(found.model, data, logs[0].name, figure)
    simulated = paths_by_owner(fit.simulated, fit.outputs).get(output)
    if simulated is not None:
        write_simulated(found.model, data, simulated)
    response = paths_by_owner(fit.response, fit.outputs).get(output)
    answer = None if response is None else _response(data, logs[0].name, response)
    return {**BLANK, **column_entries(found), "test": test, "frequency_response": answer}


def _validated(found: "Identified", held: "Channels", named: str) -> dict[str, Any]:
    """Return the quality on other logs, and whether held-back blocks promised clearly more, with a warning then."""
    from estimation.identification.free_run.validation_notes import validation_notes
    from plant.errors import LogWarning

    quality = quality_of(found.model, held, named)
    worse = validation_notes(found.model, quality, found.expected_error, named)
    for note in worse:
        warnings.warn(LogWarning(note), stacklevel=2)
    return {**vars(quality), "clearly_worse": bool(worse)}


def _response(data: "Channels", log: str, path: Path) -> dict[str, Any]:
    """Draw the frequency response of the first log, and return it."""
    from estimation.identification.signals.measured_response import measured_response
    from experiments.log_pages.response_figure import write_response

    sources = ", ".join(data.inputs)
    if len(data.inputs) > 1:
        raise HydrostateError(f"--response takes one input, got {sources}")
    found = measured_response(data.u[0][:, 0], data.y[0], data.sample_time)
    write_response(found, f"{log}, {sources} to {data.output}", path)
    return found.to_dict()


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    from estimation.identification.notes import IdentificationCode

    shown = table("output", "structure", "values [-]", "fit [%]", "held back [%]", "test [%]", "rms error", "gain")
    for result in results:
        test = result["test"]
        shown.add_row(
            str(result["output"]),
            result["structure"]
            + ("" if result["order"] is None else f", order {result['order']}")
            + ("" if result["error_model"] is None else ", error model"),
            str(result["n_values"]),
            f"{result['fit_percent']:.2f}",
            f"{result['held_back_percent']:.2f}",
            "-" if test is None or isnan(test["fit_percent"]) else f"{test['fit_percent']:.2f}",
            f"{result['rmse']:.4g}",
            gains_shown(result),
        )
    yield shown
    for result in results:
        bend = result["nonlinearity"]
        if bend is not None:
            values = ", ".join(
                f"{name.removesuffix('_s').replace('_', ' ')} {_with_interval(one)}{' s' * name.endswith('_s')}"
                for name, one in bend.items()
                if name != "kind"
            )
            place = "output" if "friction" in bend["kind"] or bend["kind"] in OUTPUT_NONLINEARITIES else "input"
            yield f"{result['output']}: {bend['kind'].replace('-', ' ')} at {result[place]}, {values}"
    for result in results:
        if result["outcome"] == "mismatch":
            yield f"Do not use the model of {result['output']} (outcome mismatch): see the warning above."
        told = (
            IdentificationCode.MORE_THAN_NOISE,
            IdentificationCode.MODEL_TOO_SMALL,
            IdentificationCode.HIGHEST_ORDER_TAKEN,
            IdentificationCode.ERROR_MODELLED,
        )
        yield from (note["text"] for note in result["notes"] if note["code"] in told)
    yield (
        f"From {', '.join(results[0]['inputs'])}. Fits are of free runs: on the fitted logs, on blocks held back from "
        f"the fit, and on --validate; gains ± one standard deviation. One-step fits, models and candidates are in "
        f"--json and --out."
    )


def _with_interval(one: Mapping[str, Any]) -> str:
    """Return a value with its 95 % interval."""
    ends = one["ci95"]
    return f"{one['value']:.4g}" + ("" if ends is None else f" ({ends[0]:.4g} to {ends[1]:.4g})")
