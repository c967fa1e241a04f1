"""`hydrostate diagnose LOG...`: which of the nine conditions each log was taken in."""

import math
from collections.abc import Iterable, Mapping, Sequence
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
)
from experiments.command.streams import clauses, note, short_names, table
from experiments.command.verdict import NO_VERDICT, headline, verdict_entries, verdict_lines

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.identification.linear_model import LinearModel
    from faults.class_fit import Actuator
    from faults.classify import Scores
    from faults.diagnosis import Diagnosis
    from plant.eha import EhaParameters
    from plant.record import Record

ABSENCE_COSTS = f"without {PRESSURE} friction shows in velocity alone: margins are smaller as a rule"
"""What it costs a diagnosis that differential pressure is not there."""

TOLD_APART = 1.001
"""Least ratio of the runner-up's score to the best at which a class is named [dimensionless]."""

MARGINS = ((1.05, "too close to call"), (1.25, "narrow"), (2.0, "clear"), (math.inf, "wide"))
"""Words for the ratio of the runner-up's score to the best, up to each bound [dimensionless]."""

POOR_FIT = 0.5
"""Share of the signal that the best model may leave unexplained without a warning [fraction]."""

MOST_TABLES = 3
"""Up to so many logs, every condition's score is shown."""

NOTHING: Result = {
    "condition": None,
    "scores": {},
    **NO_VERDICT,
    "channels": [],
    "runner_up": None,
    "margin": None,
    "transfer_function_scores": None,
    "transfer_function_condition": None,
}
"""The entries of a log that could not be used."""

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate diagnose run*.csv --rig rig.toml --out diagnosis")
def diagnose(
    logs: Logs,
    condition: Annotated[
        str | None,
        typer.Option(
            "--condition", metavar="NAME", help="The condition that you expect; the result says if it agrees."
        ),
    ] = None,
    rig: RigFile = None,
    columns: Columns = None,
    transfer_functions: Annotated[
        bool,
        typer.Option(
            "--transfer-functions/--no-transfer-functions",
            help="Also score nine transfer functions, identified from simulated tests of the rig (some 20 s, once).",
        ),
    ] = False,
    scores: Annotated[
        bool, typer.Option("--scores/--no-scores", help="Also show every condition's model error in a table.")
    ] = False,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE", help="Write a page (HTML); of several logs, one each."),
    ] = None,
    no_pressure: Annotated[
        bool, typer.Option("--no-pressure", help="Use velocity alone, even if differential pressure is logged.")
    ] = False,
    plant: StackPlant = None,
    bias_pressure: StackBias = None,
    load: StackLoad = None,
    healthy: StackHealthy = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Say what is wrong: which of nine conditions, how probable, how bad, or that it is none of them.

    A circuit is fitted to each log and laid beside the nine conditions of leakage and friction; nine models and
    nine filters speak beside it. The probabilities were calibrated on simulated logs. Severities come with 95 %
    intervals. In the table of scores a model's error is in velocity [m/s], or relative to the signals [dimensionless]
    where differential pressure counts too. The seed draws the tests behind the transfer functions.
    """
    if plant is not None:
        from experiments.command.plant_logs import plant_logs_command

        plant_logs_command(
            plant,
            logs,
            diagnosing=True,
            sensors="",
            bias_pressure=bias_pressure,
            load=load,
            healthy_log=healthy,
            expected=condition,
            columns=columns,
            out=out,
            as_json=as_json,
        )
    refuse_given(
        {"--bias-pressure": bias_pressure, "--load": load, "--healthy": healthy}, f"needs --plant {STACK} or {MOTOR}"
    )
    from faults.bank import mathematical_bank
    from faults.conditions import find_condition

    bench, mapping = load_rig(rig), load_columns(columns)
    if condition is not None:
        find_condition(condition)
    prepare_output(out)
    bank, actuator = mathematical_bank(bench.parameters), _actuator(bench.parameters)
    linear = _identified(bench.parameters, seed) if transfer_functions else None
    chosen = {"expected": condition, "rig": bench.name, "seed": seed}

    def work(log: Path) -> Result:
        record = read_log(log, bench.columns, mapping)
        if no_pressure:
            record = record.replace(**{PRESSURE: None})
        result: dict[str, Any] = {**_diagnosed(record, bank, linear, condition), **chosen}
        if actuator is None or result["outcome"] != "ok":
            return result
        found = _verdict_on(record, actuator)
        if isinstance(found, str):
            return {**result, "warnings": [*result["warnings"], found]}
        if report is not None:
            _write_report(figure_path(report.with_suffix(".html"), log, len(logs)) or report, log, result, found)
        return _with_verdict(result, found)

    batch = run_logs(logs, work, {**NOTHING, **chosen}, "diagnosing")
    finish(batch, lambda results: _screen(results, tables=scores or transfer_functions), as_json=as_json, out=out)


def _actuator(rig: "EhaParameters") -> "Actuator | None":
    from faults.class_fit import Actuator
    from plant.errors import RigError

    try:
        return Actuator.of(rig)
    except RigError as error:
        note(f"no circuit fits around this rig, so there are scores but no probabilities: {error}")
        return None


def _verdict_on(record: "Record", actuator: "Actuator") -> "Diagnosis | str":
    """Return the diagnosis, or why there is none."""
    from faults.diagnosis import diagnose_log
    from plant.errors import LogError

    try:
        return diagnose_log(record, actuator)
    except LogError as error:
        return f"no probabilities: {error}"


def _with_verdict(result: dict[str, Any], found: "Diagnosis") -> dict[str, Any]:
    entries = {**result, **verdict_entries(found)}
    ranked = sorted(found.probabilities, key=lambda name: -found.probabilities[name])
    said = [headline(entries), *([result["message"]] if found.condition == result["condition"] else [])]
    if result["expected"] is not None and found.condition != result["condition"]:
        said.append("as expected" if found.condition == result["expected"] else f"{result['expected']} was expected")
    if PRESSURE not in result["channels"] and found.condition != result["condition"]:
        said.append(ABSENCE_COSTS)
    return {**entries, "runner_up": ranked[1], "message": clauses(said)}


def _write_report(path: Path, log: Path, result: dict[str, Any], found: "Diagnosis") -> None:
    from experiments.report.diagnosis import diagnosis_page
    from plant.atomic import replacing
    from plant.errors import HydrostateError

    page = diagnosis_page(_with_verdict({"file": str(log), **result}, found), found)
    try:
        with replacing(path) as file:
            file.write(page.encode())
    except OSError as error:
        raise HydrostateError(f"--report {path}: cannot be written: {error.strerror or error}") from error


def _identified(rig: "EhaParameters", seed: int) -> "Mapping[str, LinearModel]":
    import warnings

    import numpy as np

    from faults.bank import identify_bank
    from plant.errors import LogWarning

    note("identifying nine transfer functions from simulated tests of the rig")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return identify_bank(rig, np.random.default_rng(seed))


def _diagnosed(
    record: "Record",
    bank: "Mapping[str, EhaParameters]",
    linear: "Mapping[str, LinearModel] | None",
    expected: str | None,
) -> dict[str, Any]:
    from faults.classify import score_mathematical, score_transfer_functions

    scores = score_mathematical(record, bank)
    found = {**NOTHING, **_verdict(scores)}
    said = [found["message"]]
    if linear is not None:
        others = score_transfer_functions(record, linear)
        found["transfer_function_scores"] = dict(others.by_condition)
        found["transfer_function_condition"] = others.condition
    if expected is not None and found["condition"] is not None:
        said.append("as expected" if found["condition"] == expected else f"{expected} was expected")
    if PRESSURE not in scores.channels:
        said.append(ABSENCE_COSTS)
    doubts = _poor_fit(scores, record) if found["outcome"] == "ok" else []
    return {**found, "message": clauses(said), "warnings": doubts}


def _verdict(scores: "Scores") -> dict[str, Any]:
    ranked = sorted(scores.by_condition.items(), key=lambda item: item[1] if math.isfinite(item[1]) else math.inf)
    (best, least), (second, next_least) = ranked[:2]
    entries = {"outcome": "ok", "scores": dict(scores.by_condition), "channels": list(scores.channels)}
    if not math.isfinite(least):
        return {**entries, "outcome": "diverged", "message": "no condition's model stayed finite; check units and rig"}
    margin = next_least / least if least > 0.0 else (math.inf if next_least > 0.0 else 1.0)
    if margin < TOLD_APART:
        said = "no class: under this drive the models move alike; drive the actuator, at best with steps"
        return {**entries, "outcome": "not_observable", "margin": margin, "message": said}
    said = _in_words(best, second, margin)
    return {**entries, "condition": best, "runner_up": second, "margin": margin, "message": said}


def _word(margin: float) -> str:
    return next(word for bound, word in MARGINS if margin < bound or bound == math.inf)


def _in_words(best: str, second: str, margin: float) -> str:
    if margin < MARGINS[0][0]:
        return f"{best}, but {_word(margin)}: the error of {second} is only {100.0 * (margin - 1.0):.1f} % larger"
    if not math.isfinite(margin):
        return f"{best}, which fits exactly, as {second} does not"
    error = f"{100.0 * (margin - 1.0):.0f} % larger" if margin < 2.0 else f"{margin:.1f} times as large"
    return f"{best}, by a {_word(margin)} margin: the error of {second} is {error}"


def _poor_fit(scores: "Scores", record: "Record") -> list[str]:
    """Return a warning where even the best model explains little of the log."""
    import numpy as np

    from faults.classify import measured_velocity

    unexplained = min(scores.by_condition.values())
    if len(scores.channels) == 1:
        size = float(np.sqrt(np.nanmean(measured_velocity(record) ** 2)))
        unexplained = unexplained / size if size > 0.0 else 0.0
    if not unexplained > POOR_FIT:
        return []
    return [
        f"none of the nine fits: the best leaves {100.0 * unexplained:.0f} % of the signal unexplained; "
        "check the rig file and the columns' units"
    ]


def _screen(results: Sequence[Result], *, tables: bool) -> "Iterable[RenderableType]":
    cost = f"; {ABSENCE_COSTS}"
    lacking = sum(PRESSURE not in result["channels"] for result in results)
    detailed = len(results) <= MOST_TABLES
    if not detailed:
        yield _summary(results)
    for result in results:
        judged = result["probabilities"] is not None
        if detailed and judged:
            yield from verdict_lines(result)
        if tables and detailed:
            yield _scores_table(result)
        if not judged or result["outcome"] != "ok" or result["expected"] is not None:
            yield f"{result['file']}: {result['message'].removesuffix(cost)}"
    if lacking:
        yield f"{lacking} of {len(results)} logs: {ABSENCE_COSTS}"


def _summary(results: Sequence[Result]) -> "RenderableType":
    shown = table("log", "condition", "probability [%]", "runner-up", "error of runner-up / best", "believe")
    for name, result in zip(short_names(results), results, strict=True):
        margin, shares = result["margin"], result["probabilities"]
        words = "-" if margin is None or result["condition"] is None else f"{margin:.2f}, {_word(margin)}"
        share = "-" if shares is None else f"{100.0 * shares[result['condition']]:.1f}"
        believe = "-" if shares is None else "UNKNOWN" if result["unknown"] else "yes"
        shown.add_row(name, result["condition"] or "-", share, result["runner_up"] or "-", words, believe)
    return shown


def _scores_table(result: Result) -> "RenderableType":
    unit = "1" if PRESSURE in result["channels"] else "m/s"
    others = result["transfer_function_scores"]
    headings = ["condition", f"model error [{unit}]", *([] if others is None else ["transfer function [m/s]"]), ""]
    shown = table(*headings, title=result["file"])
    for name, score in result["scores"].items():
        marks = [words for words, best in _winners(result).items() if best == name]
        cells = [name, f"{score:.4g}", *([] if others is None else [f"{others[name]:.4g}"]), ", ".join(marks)]
        shown.add_row(*cells, style="bold" if name == result["condition"] else None)
    return shown


def _winners(result: Result) -> dict[str, str | None]:
    return {
        "<- best": result["condition"],
        "runner-up": result["runner_up"],
        "best transfer function": result["transfer_function_condition"],
    }
