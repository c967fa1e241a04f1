"""`hydrostate identify LOG --input U --output Y`: a model between any columns, validated, saved and simulated again."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import Batch, finish, run_logs
from experiments.command.options import require_positive
from experiments.command.own_paths import own_paths
from experiments.command.terminal import clauses, table
from experiments.identification.simulate_model import quality_of, record_of, warn_of_range, write_simulated
from plant.errors import HydrostateError, require_known

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.identification.free_run.data import Channels
    from estimation.identification.free_run.identify import Identified
    from estimation.identification.free_run.model import FreeRunModel
    from estimation.identification.state_space.dynamics import StateSpaceDynamics
    from plant.log.record import Record


@dataclass(frozen=True)
class Asked:
    """What the command line asks of any columns.

    Parameters
    ----------
    order, delay, numerator : int or None
        Of every input; None lets the data choose.
    sample_time, resampled : float or None
        Between samples of logs without a column of time, and of the model [s].
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
    validate: tuple[Path, ...] = ()
    figure: Path | None = None
    simulated: Path | None = None
    response: Path | None = None


BLANK: Result = {
    **dict.fromkeys(("inputs", "input", "output", "structure", "order", "n_values", "sample_time_s")),
    **dict.fromkeys(("fit_percent", "rmse", "one_step_percent", "one_step_rmse", "held_back_percent", "offset")),
    **dict.fromkeys(("numerator", "denominator", "dc_gain", "poles", "delay", "nonlinearity", "test", "model")),
    "frequency_response": None,
    "candidates": [],
}
"""Entries of a log that could not be used."""


def names(given: Sequence[str] | None) -> tuple[str, ...]:
    """Return channel names, given one by one or with commas between.

    Examples
    --------
    >>> names(["u1, u2", "u3"])
    ('u1', 'u2', 'u3')
    """
    return tuple(part.strip() for text in given or () for part in text.split(",") if part.strip())


def identify_any(logs: Sequence[Path], asked: Asked, *, as_json: bool, out: Path | None) -> NoReturn:
    """Identify one model an output from all logs together, print what it is worth, and leave with the exit code.

    Raises
    ------
    HydrostateError
        If an option is not usable.
    """
    from estimation.identification.free_run.identify import FREE_STRUCTURES
    from estimation.identification.state_space.identify import STATE_SPACE

    if not asked.inputs or not asked.outputs:
        raise HydrostateError("--input and --output go together and need at least one column each")
    if twice := set(asked.inputs) & set(asked.outputs):
        raise HydrostateError(f"--input and --output must be different channels, got {min(twice)!r} for both")
    require_known("--structure", asked.structure, (*FREE_STRUCTURES, STATE_SPACE))
    require_positive("--sample-time", asked.sample_time, "s")
    require_positive("--resample", asked.resampled, "s")
    prepare_output(out)
    read: list[list[Record]] = []
    shared: dict[str, Identified] = {}

    def work(name: Path) -> Result:
        output = columns[name]
        if not read:
            wanted, references = (*asked.inputs, *asked.outputs), asked.references
            read.append([record_of(log, (*wanted, *references), asked.sample_time) for log in logs])
            read.append([record_of(log, wanted, asked.sample_time) for log in asked.validate])
        together = asked.structure == STATE_SPACE or (asked.structure == "auto" and len(asked.outputs) > 1)
        if together and not shared:
            shared.update(_together(read[0], asked, asked.outputs))
        found = shared.get(output) or _together(read[0], asked, (output,))[output]
        return _answer(found, read, output, asked, logs)

    columns = {Path(output): output for output in asked.outputs}  # a path drops parts of some names, such as "x/."
    batch = run_logs(list(columns), work, BLANK, "identifying")
    named = ", ".join(str(log) for log in logs)
    results = tuple({**result, "file": named} for result in batch.results)
    finish(Batch(results, batch.total), _screen, as_json=as_json, out=out)


def _together(records: "Sequence[Record]", asked: Asked, outputs: Sequence[str]) -> "dict[str, Identified]":
    """Return what is identified of some outputs, by their names."""
    from estimation.identification.two_stage import identify_columns

    form = {"order": asked.order, "delay": asked.delay, "n_numerator": asked.numerator, "structure": asked.structure}
    clock, references = asked.resampled, asked.references
    found, _ = identify_columns(records, asked.inputs, outputs, references=references, sample_time=clock, options=form)
    return dict(zip(outputs, found, strict=True))


def _answer(
    found: "Identified", read: "Sequence[Sequence[Record]]", output: str, asked: Asked, logs: Sequence[Path]
) -> Result:
    from estimation.identification.free_run.from_records import channels_of

    records, tests = read
    test = None
    if tests:
        held = channels_of(tests, asked.inputs, output, found.model.sample_time, split=True)
        warn_of_range(found.model, held)
        test = {"files": [str(one) for one in asked.validate], **quality_of(found.model, held)}
    if not (asked.figure or asked.simulated or asked.response):
        return {**BLANK, **entries(found), "test": test, "frequency_response": None}
    data = channels_of(records, asked.inputs, output, asked.resampled)
    figure = own_paths(asked.figure, asked.outputs).get(output)
    if figure is not None:
        from experiments.log_pages.free_run_figure import write_free_run

        write_free_run(found.model, data, logs[0].name, figure)
    simulated = own_paths(asked.simulated, asked.outputs).get(output)
    if simulated is not None:
        write_simulated(found.model, data, simulated)
    response = own_paths(asked.response, asked.outputs).get(output)
    answer = None if response is None else _response(data, logs[0].name, response)
    return {**BLANK, **entries(found), "test": test, "frequency_response": answer}


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


def entries(found: "Identified") -> dict[str, Any]:
    """Return what was identified by the names of the JSON contract."""
    from estimation.identification.free_run.identify import WARNED
    from estimation.identification.state_space.dynamics import StateSpaceDynamics

    model, linear = found.model, found.model.linear
    result: dict[str, Any] = {
        "outcome": "ok" if found.sound else "mismatch",
        "inputs": list(model.inputs),
        "input": model.inputs[0],
        "output": model.output,
        "structure": model.structure,
        "n_values": model.n_values,
        "sample_time_s": model.sample_time,
        **vars(found.quality),
        "held_back_percent": found.held_back_percent,
        "candidates": list(found.candidates),
        "model": model.to_dict(),
        "notes": [note.to_dict() for note in found.notes if note.code not in WARNED],
    }
    if linear is not None:
        from experiments.verbs.identify import linear_entries

        result = {**linear_entries(linear), **result, "order": linear.denominator.size - 1, "offset": model.offset}
        result["dc_gain"] = {"value": linear.dc_gain, "std": linear.dc_gain_std}
    elif model.structure == "output-error":
        transfer = model.transfer_functions()
        result |= {"numerator": [b.tolist() for b, _ in transfer], "denominator": transfer[0][1].tolist()}
        gains = [float(b.sum() / f.sum()) for b, f in transfer]
        result |= {"order": transfer[0][1].size - 1, "offset": model.offset, "dc_gain": {"value": gains}}
    elif isinstance(model.dynamics, StateSpaceDynamics):
        result |= _state_space_entries(model, model.dynamics)
    result["nonlinearity"] = model.nonlinearity
    quality = found.quality
    result["message"] = clauses(
        [
            f"{model.structure} with {model.n_values} values: fit {quality.fit_percent:.1f} % running free, "
            f"{found.held_back_percent:.1f} % on blocks held back, rms error {quality.rmse:.4g}",
            *map(str, found.notes[:1] if not found.sound else ()),
        ]
    )
    return result


def _state_space_entries(model: "FreeRunModel", dynamics: "StateSpaceDynamics") -> dict[str, Any]:
    """Return order, poles, steady gains and dead time of one output of a state space."""
    from experiments.verbs.identify import with_std

    system, gain = dynamics.system, model.scaling.y_std / model.scaling.u_std
    return {
        "order": system.order,
        "poles": with_std(system.poles, system.pole_std),
        "dc_gain": {
            "value": (system.dc_gain[dynamics.place] * gain).tolist(),
            "std": (system.dc_gain_std[dynamics.place] * gain).tolist(),
        },
        "offset": model.offset,
        "delay": {
            "samples": list(system.delays),
            "seconds": [delay * model.sample_time for delay in system.delays],
        },
    }


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table("output", "structure", "values [-]", "fit [%]", "held back [%]", "test [%]", "rms error", "gain")
    for result in results:
        test, gain = result["test"], result["dc_gain"]
        value = None if gain is None else gain["value"]
        said = (
            "-" if value is None else " ".join(f"{one:.4g}" for one in ([value] if isinstance(value, float) else value))
        )
        shown.add_row(
            str(result["output"]),
            result["structure"] if result["order"] is None else f"{result['structure']}, order {result['order']}",
            str(result["n_values"]),
            f"{result['fit_percent']:.2f}",
            f"{result['held_back_percent']:.2f}",
            "-" if test is None else f"{test['fit_percent']:.2f}",
            f"{result['rmse']:.4g}",
            said,
        )
    yield shown
    for result in results:
        bend = result["nonlinearity"]
        if bend is not None:
            values = ", ".join(
                f"{name.replace('_', ' ')} {_with_interval(one)}" for name, one in bend.items() if name != "kind"
            )
            place = "output" if "friction" in bend["kind"] else "input"
            yield f"{result['output']}: {bend['kind'].replace('-', ' ')} at {result[place]}, {values}"
    yield (
        f"From {', '.join(results[0]['inputs'])}. Fits are of free runs: on the fitted logs, on blocks held back from "
        f"the fit, and on --validate. One-step fits, models and candidates are in --json and --out."
    )


def _with_interval(one: Mapping[str, Any]) -> str:
    """Return a value with its 95 % interval."""
    ends = one["ci95"]
    return f"{one['value']:.4g}" + ("" if ends is None else f" ({ends[0]:.4g} to {ends[1]:.4g})")
