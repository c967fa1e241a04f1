"""`run_task(task) -> part`: the cases of one task, each with the same bits in whatever company it is run.

A series is made once for all that is done with it. Its noise comes from a stream of its own; its filters run in lanes
of one kernel, 32 side by side and never fewer than a kernel of lanes takes.
"""

import threading
import warnings
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from io import BytesIO
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from estimation.batch import FEWEST_IN_LANES, filter_batch
from estimation.bulk_modulus import estimate_bulk_modulus
from estimation.bulk_modulus_estimate import OUTCOMES
from estimation.eha import BULK_MODULUS, FORMS
from estimation.filter import FilterProblem, Trace
from estimation.first_belief import PRESSURE_NOISE_LOGGED, first_belief
from estimation.kernels import LANES
from estimation.measurement_noise import SMALLEST_VARIANCE, measurement_variances
from estimation.run import METHODS, available_channels, filter_problem
from experiments.batch.cases import Task
from experiments.batch.diagnosis import diagnosed
from experiments.batch.rows import NIS, Row, as_table, case_row, failed, in_words
from experiments.batch.series import Log, Series, Simulated, Work, content_of
from experiments.command.logs import read_log
from experiments.streams import stream
from faults.conditions import severity
from plant.eha import EhaParameters
from plant.errors import HydrostateError, LogError, LogWarning
from plant.record import Record
from plant.rig import Rig
from plant.sensors import SENSORS, measure, noise_variances
from plant.signals import make_drive
from plant.simulate import PLANTS, simulate

PRESSURE = "differential_pressure_pa"

DRAWN_ONCE = ("sine", "chirp")
"""Drives that hold nothing random: seeds share the simulated motion, and differ in the sensors' noise."""

TRACK_ROWS = 200
"""About how many points of a filter's history are kept until its mean over the last `SETTLED` is taken."""

SETTLED = 0.2
"""Share of a run that counts as its end [fraction], as in `estimation.run.Estimate.settled`."""

_one_at_a_time = threading.Lock()
"""Warnings are caught for a whole process, so that threads of one worker take turns where they are."""


@dataclass(frozen=True)
class Part:
    """What a task gave.

    Parameters
    ----------
    content : bytes
        A Parquet file with one row a case, in the task's order.
    failures : tuple of pairs of str
        Case in words, and reason, of each case that failed.
    """

    content: bytes
    failures: tuple[tuple[str, str], ...]


def run_task(task: Task) -> Part:
    """Run the cases of a task.

    Parameters
    ----------
    task : Task
        The cases.

    Returns
    -------
    Part
        The rows; a case that failed is a row with its reason.
    """
    rows: dict[str, Row] = {}
    lanes = _Lanes(rows)
    for series, cases in task.series:
        named = [(case_row(key, series, work), work) for key, work in cases]
        try:
            prepared = _prepared(series, task.rig)
        except Exception as error:  # whatever a series brings up must not cost the others their results
            rows |= {case["key"]: failed(case, _said(error)) for case, _ in named}
            continue
        for case, work in named:
            _guarded(rows, {**case, **prepared.entries}, lambda case, p=prepared, w=work: _run(case, p, w, lanes))
    lanes.finish()
    return as_part([rows[key] for key in task.keys])


def lost_task(task: Task, reason: str) -> Part:
    """Return a task's cases as failed.

    Parameters
    ----------
    task : Task
        The cases.
    reason : str
        Why.

    Returns
    -------
    Part
        The rows.
    """
    return as_part(
        [failed(case_row(key, series, work), reason) for series, cases in task.series for key, work in cases]
    )


def as_part(rows: list[Row]) -> Part:
    """Return rows as a part of the store.

    Parameters
    ----------
    rows : list of dict
        Entries by column.

    Returns
    -------
    Part
        The part.
    """
    buffer = BytesIO()
    pq.write_table(as_table(rows), buffer, compression="zstd", write_page_checksum=True)
    failures = tuple((in_words(row), str(row["reason"])) for row in rows if row["outcome"] == "failed")
    return Part(buffer.getvalue(), failures)


@dataclass(frozen=True, eq=False)
class _Prepared:
    """A series with what a method may be told of it, and the entries that it adds to its cases' rows."""

    record: Record
    rig: Rig
    parameters: EhaParameters
    sensors: str | None
    entries: Row
    problems: dict[tuple[object, ...], FilterProblem] = field(default_factory=dict[tuple[object, ...], FilterProblem])


def _prepared(series: Series, rig: Rig) -> _Prepared:
    if isinstance(series, Log):
        with _one_at_a_time, _caught() as said:
            record = read_log(Path(series.path), rig.columns, dict(series.columns))
        if content_of(Path(series.path)) != series.content:
            raise LogError(f"{series.path}: was changed after the study began; run the same command again")
        known = record.metadata.get("condition")
        entries: Row = {"duration_s": record.duration, "sample_time_s": record.sample_time}
        entries |= {"condition": known} if isinstance(known, str) else {}
        return _Prepared(record, rig, rig.parameters, None, {**entries, "warnings": "; ".join(said()) or None})
    truth, parameters = _truth(series, rig.parameters)
    record = measure(truth, SENSORS[series.sensors], _stream(series, "sensors"))
    return _Prepared(record, rig, parameters, series.sensors, {"true_bulk_modulus_pa": parameters.bulk_modulus})


def _stream(series: Simulated, what: str) -> np.random.Generator:
    place = (series.plant, series.drive, repr(series.leakage_severity), repr(series.friction_severity))
    return stream(series.seed, "batch", what, *place)


def _truth(series: Simulated, healthy: EhaParameters) -> tuple[Record, EhaParameters]:
    seed = 0 if series.drive in DRAWN_ONCE else series.seed
    return _motion(replace(series, seed=seed, condition=None, sensors=""), healthy)


@lru_cache(maxsize=2)
def _motion(series: Simulated, healthy: EhaParameters) -> tuple[Record, EhaParameters]:
    """Return what truly moves, kept for the seeds and sensors that share it."""
    parameters = severity(series.leakage_severity, series.friction_severity, healthy)
    speed = make_drive(series.drive, series.duration_s, series.sample_time_s, parameters, _stream(series, "drive"))
    return simulate(PLANTS[series.plant], speed, series.sample_time_s, parameters), parameters


def _run(case: Row, prepared: _Prepared, work: Work, lanes: "_Lanes") -> Row | None:
    """Return a case's row, or None where it waits for its lanes to fill."""
    record, parameters = _told(prepared, work)
    if work.verb == "filter":
        problem = _problem(record, parameters, work, prepared)
        if work.method == "ekf":
            return lanes.add(case, problem)
        return _filtered([case], problem, [METHODS[work.method](problem)])[0]
    with _one_at_a_time, _caught() as said:
        if work.verb == "diagnose":
            found = diagnosed(record, prepared.rig.parameters)
        else:
            found = _estimated(record, parameters, work, prepared)
    sentences = [sentence for sentence in (case.get("warnings"), *said()) if sentence]
    return {**case, **found, "warnings": "; ".join(dict.fromkeys(sentences)) or None}


def _told(prepared: _Prepared, work: Work) -> tuple[Record, EhaParameters]:
    record = prepared.record
    if not work.pressure and PRESSURE in record:
        record = record.replace(**{PRESSURE: None})
    return record, prepared.parameters if work.told == "condition" else prepared.rig.parameters


def _estimated(record: Record, parameters: EhaParameters, work: Work, prepared: _Prepared) -> Row:
    found = estimate_bulk_modulus(
        record,
        parameters,
        form=work.form,
        method=work.method,
        start=work.start_pa,
        start_std=work.start_std_pa,
        uncertainties=prepared.rig.uncertainties,
    )
    reasons = list(found.gate.reasons) if found.value is not None else [OUTCOMES[found.outcome]]
    row: Row = {"outcome": found.outcome.value, "reason": "; ".join(reasons) or None, "trusted": found.gate.passed}
    row |= {"bulk_modulus_pa": found.value, "bulk_modulus_std_pa": found.std}
    row["error_percent"] = _error(found.value, prepared.entries.get("true_bulk_modulus_pa"))
    return row | {NIS[channel]: value for channel, value in found.nis.items() if channel in NIS}


def _error(value: float | None, truth: float | None) -> float | None:
    return None if value is None or truth is None else 100.0 * (value / truth - 1.0)


def _problem(record: Record, parameters: EhaParameters, work: Work, prepared: _Prepared) -> FilterProblem:
    """Return the filtering task; what its first guesses share is made once a series."""
    place = FORMS[work.form].index(BULK_MODULUS)
    alike = (work.form, work.pressure, work.told, work.start_std_pa)
    if alike not in prepared.problems:
        prepared.problems[alike] = _first_problem(record, parameters, work, prepared.sensors)
    first = prepared.problems[alike]
    if work.start_pa is None:
        return first
    mean = first.mean.copy()
    mean[place] = work.start_pa / first.model.states[place].scale
    return replace(first, mean=mean)


def _first_problem(record: Record, parameters: EhaParameters, work: Work, sensors: str | None) -> FilterProblem:
    """Return the task from the rig's own guess; of a simulated run the filter knows the sensors' noise."""
    model = FORMS[work.form]
    channels = available_channels(model, record)
    if sensors is None:
        variances = measurement_variances(record, channels)
    else:
        known = noise_variances(SENSORS[sensors])
        variances = {channel: max(known[channel], SMALLEST_VARIANCE[channel]) for channel in channels}
    problem = filter_problem(
        model,
        first_belief(model, record, parameters.bulk_modulus, work.start_std_pa),
        record,
        parameters,
        channels=channels,
        variances=variances,
        noise={PRESSURE: PRESSURE_NOISE_LOGGED} if PRESSURE in channels else {},
    )
    return replace(problem, every=max(1, len(record) // TRACK_ROWS))


class _Lanes:
    """Filters that wait for others like them, until the lanes of a kernel are full."""

    def __init__(self, rows: dict[str, Row]) -> None:
        self._rows = rows
        self._waiting: dict[tuple[object, ...], list[tuple[Row, FilterProblem]]] = {}

    def add(self, case: Row, problem: FilterProblem) -> None:
        alike = (id(problem.model), problem.channels, problem.sample_time, problem.measured.shape)
        waiting = self._waiting.setdefault(alike, [])
        waiting.append((case, problem))
        if len(waiting) == LANES:
            self._run(self._waiting.pop(alike))

    def finish(self) -> None:
        for waiting in self._waiting.values():
            self._run(waiting)
        self._waiting.clear()

    def _run(self, waiting: list[tuple[Row, FilterProblem]]) -> None:
        cases, problems = [case for case, _ in waiting], [problem for _, problem in waiting]
        padded = problems + problems[-1:] * max(0, FEWEST_IN_LANES - len(problems))
        try:
            traces = list(filter_batch(padded))[: len(cases)]
            found = _filtered(cases, problems[0], traces)
        except Exception as error:  # as above
            found = [failed(case, _said(error)) for case in cases]
        self._rows |= {row["key"]: row for row in found}


def _filtered(cases: Sequence[Row], problem: FilterProblem, traces: Sequence[Trace]) -> list[Row]:
    """Return the rows of filters of one model and length."""
    model, place = problem.model, problem.model.index(BULK_MODULUS)
    first = int(np.floor(len(traces[0].track) * (1.0 - SETTLED)))
    with np.errstate(all="ignore"):  # a filter that diverged shows in its row
        ends, _ = model.to_si(np.array([trace.track[first:] for trace in traces]))
        values = ends[..., place].mean(axis=1)
        _, slopes = model.to_si(np.array([trace.mean for trace in traces]))
        stds = np.sqrt([trace.covariance[place, place] for trace in traces]) * slopes[:, place]
        nis = np.array([trace.nis for trace in traces]) / np.array([trace.count for trace in traces])
    names = [NIS[channel] for channel in problem.channels]
    rows: list[Row] = []
    found = zip(cases, values.tolist(), stds.tolist(), nis.tolist(), traces, strict=True)
    for case, value, std, ratios, trace in found:
        if not np.isfinite(value + std):
            rows.append({**case, "outcome": "diverged", "reason": "the estimate stopped being finite"})
            continue
        row = {**case, "outcome": "ok", "bulk_modulus_pa": value, "bulk_modulus_std_pa": std}
        row |= dict(zip(names, ratios, strict=True)) | {"log_likelihood": trace.log_likelihood}
        row["error_percent"] = _error(value, case.get("true_bulk_modulus_pa"))
        rows.append(row)
    return rows


def _guarded(rows: dict[str, Row], case: Row, run: Callable[[Row], Row | None]) -> None:
    try:
        row = run(case)
    except Exception as error:  # as above
        row = failed(case, _said(error))
    if row is not None:
        rows[case["key"]] = row


@contextmanager
def _caught() -> Generator[Callable[[], list[str]]]:
    """Catch what is said of a log; the callable returns it, each sentence once."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", LogWarning)
        yield lambda: list(dict.fromkeys(str(one.message) for one in caught if issubclass(one.category, LogWarning)))


def _said(error: Exception) -> str:
    if isinstance(error, HydrostateError):
        return str(error)
    return f"an internal error, {type(error).__name__}: {str(error)[:300]}"
