"""`hydrostate identify LOG --simulate MODEL`: a free run of a saved model on other logs, and how well it fits them."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import finish, run_logs
from experiments.command.options import require_positive
from experiments.command.output_paths import paths_by_owner
from experiments.command.terminal import clauses, table
from plant.errors import HydrostateError, LogWarning

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.identification.free_run.data import Channels
    from estimation.identification.free_run.model import FreeRunModel
    from estimation.identification.free_run.quality import FreeRunQuality
    from experiments.identification.of_columns import ColumnFit
    from plant.log.record import Record


def simulate_model(logs: Sequence[Path], path: Path, fit: "ColumnFit", *, as_json: bool, out: Path | None) -> NoReturn:
    """Simulate a saved model on every log, report how well it fits, and exit with the exit code.

    Raises
    ------
    HydrostateError
        If the model cannot be read, or has another number of channels than are named.
    """
    from estimation.identification.free_run.from_records import channels_of
    from estimation.identification.free_run.saved import load_models

    models = _models_of(load_models(path), fit.outputs)
    prepare_output(out, logs)
    require_positive("--sample-time", fit.sample_time, "s")
    simulated = paths_by_owner(fit.simulated, logs)

    def work(log: Path) -> Result:
        results: list[Result] = []
        for index, model in enumerate(models):
            own = not fit.inputs or sorted(fit.inputs) == sorted(model.inputs)
            inputs = model.inputs if own else fit.inputs
            outputs = fit.outputs or tuple(one.output for one in models)
            if len(inputs) != len(model.inputs) or len(outputs) != len(models):
                raise HydrostateError(
                    f"the model goes from {len(model.inputs)} inputs to {len(models)} outputs, got columns for "
                    f"{len(inputs)} and {len(outputs)}"
                )
            record = record_of(log, (*inputs, outputs[index]), fit, assumed=model.sample_time)
            data = channels_of([record], inputs, outputs[index], model.sample_time)
            quality = quality_of(model, channels_of([record], inputs, outputs[index], model.sample_time, split=True))
            about = {"inputs": list(inputs), "output": outputs[index], "structure": model.structure}
            results.append({**about, **vars(quality)})
            if log in simulated:
                write_simulated(model, data, paths_by_owner(simulated[log], outputs)[outputs[index]])
        message = clauses([_fit_text(one["output"], one["fit_percent"]) for one in results])
        return {"outcome": "ok", **results[0], "outputs": results, "model_file": str(path), "message": message}

    blank: Result = {**dict.fromkeys(("inputs", "output", "structure", "fit_percent", "rmse")), "outputs": []}
    finish(run_logs(logs, work, blank, "simulating"), _simulated_screen, as_json=as_json, out=out)


def _fit_text(output: str, fit: float) -> str:
    return f"{output}: no fit" if isnan(fit) else f"{output}: fit {fit:.1f} % running free"


def _models_of(models: "Sequence[FreeRunModel]", outputs: Sequence[str]) -> "list[FreeRunModel]":
    """Return the models of outputs in the requested order; all of them if columns have other names."""
    by_output = {one.output: one for one in models}
    return [by_output[name] for name in outputs if name in by_output] or list(models)


def write_simulated(model: "FreeRunModel", data: "Channels", path: Path) -> None:
    """Write time, inputs, measured and simulated output of the first log as CSV."""
    import numpy as np
    import pandas as pd

    from experiments.command.json_output import write_whole

    u, y = data.u[0], data.y[0]
    columns: Mapping[str, Any] = {
        "time_s": model.sample_time * np.arange(y.size),
        **{name: u[:, k] for k, name in enumerate(data.inputs)},
        data.output: y,
        f"{data.output}_simulated": model.simulate(u, y),
    }
    write_whole(path, pd.DataFrame(columns).to_csv(index=False), "--simulated")


def record_of(log: Path, wanted: Sequence[str], fit: "ColumnFit", *, assumed: float = 1.0) -> "Record":
    """Read columns of any log; as many samples may be missing as a model can tolerate.

    Parameters
    ----------
    fit : ColumnFit
        Which column holds the time, or the sample time of a log without one.
    assumed : float
        Sample time, if neither is given [s].

    Raises
    ------
    LogError
        If it cannot be read, or lacks one of them.

    Warns
    -----
    LogWarning
        If rows were left out because the logger wrote them a second time.
    """
    from estimation.identification.free_run.from_records import without_repeated_rows
    from plant.log.any_columns import read_any
    from plant.log.clock.uniform import MOST_MISSING_TO_RELATE

    record = read_any(
        log,
        wanted,
        time=fit.time,
        sample_time=fit.sample_time,
        most_missing=MOST_MISSING_TO_RELATE,
        assumed=assumed,
    )
    return without_repeated_rows(record, wanted)


def quality_of(model: "FreeRunModel", data: "Channels", named: str = "the log") -> "FreeRunQuality":
    """Return the fit of a model to its outputs.

    Parameters
    ----------
    named : str
        What the reader calls the logs.

    Warns
    -----
    LogWarning
        If inputs lie beyond those that a polynomial model was fitted to or do not determine it, or no log is longer
        than its dead time.
    """
    from estimation.identification.free_run.input_range import doubts_about_inputs

    quality, runs = model.quality_and_runs(data.u, data.y)
    for note in doubts_about_inputs(model, data, runs, named):
        warnings.warn(LogWarning(note), stacklevel=2)
    return quality


def _simulated_screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table("log", "output", "fit [%]", "rms error", "one step [%]")
    for log, one in ((str(result["file"]), one) for result in results for one in result["outputs"]):
        numbers = (one["fit_percent"], one["rmse"], one["one_step_percent"])
        texts = (f"{value:{how}}" for value, how in zip(numbers, (".2f", ".4g", ".2f"), strict=True))
        shown.add_row(log, one["output"], *("-" if text == "nan" else text for text in texts))
    yield shown
