"""`run_task(task) -> part`: runs the cases of one task. A case gives the same bits whatever other cases run with it.

A series is made once for all its analyses. Its noise has a random stream of its own; its filters run in the lanes of
one kernel, 32 side by side, padded to the smallest number that the kernel takes.
"""

import gc
import multiprocessing
import threading
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pyarrow.parquet as pq

from estimation.eha.bulk_modulus import DEFAULT_OPTIONS, EstimateOptions, estimate_clean, left_out_notes
from estimation.eha.estimate import checked_estimate, finding_of
from estimation.eha.result import BulkModulusEstimate
from estimation.engine.contract import FilterProblem
from estimation.filters.methods import METHODS
from estimation.filters.run import filter_problem, predicted_channels
from estimation.log_checks.clean import CleanLog, clean_log
from estimation.log_checks.first_belief import PRESSURE_NOISE_LOGGED, first_belief
from estimation.log_checks.measurement_noise import SMALLEST_VARIANCE, measurement_variances
from estimation.models.eha_forms import BULK_MODULUS, FORMS
from experiments.actuator_kind import ActuatorKind
from experiments.actuators import DEFAULT, kind_of_rig
from experiments.batch.cases import Task
from experiments.batch.diagnosis import diagnose_to_row
from experiments.batch.lanes import Lanes, WaitingFilter, write_filtered
from experiments.batch.logs_listed import read_listed
from experiments.batch.other_actuators import analyse_to_row, simulated_run
from experiments.batch.rows import NIS, TRUTH, Failure, Row, Rows, error_percent
from experiments.batch.series import Log, Series, Simulated, Work, content_of
from experiments.command.logs import catch_log_warnings
from experiments.command.visible_text import valid_text
from experiments.eha.entries import estimate_message
from experiments.running.random_streams import stream
from faults.conditions import severity
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import PLANTS, simulate
from plant.errors import HydrostateError, LogError, LogWarning
from plant.log.record import Record
from plant.sensors.sensors import SENSORS, measure, noise_variances

PRESSURE = "differential_pressure_pa"

DETERMINISTIC_DRIVES = ("sine", "chirp")
"""Drives without randomness: seeds share the simulated motion, and differ only in the sensor noise."""

TRACK_ROWS = 200
"""Approximate number of points of a filter's history that are kept to take the mean over the last `SETTLED`."""

Seen: TypeAlias = tuple[CleanLog, BulkModulusEstimate]
"""A log after a first analysis, and its estimate."""

_one_at_a_time = threading.Lock()
"""Lock for catching warnings: Python catches them for a whole process, so the threads of one worker must take turns."""


@dataclass(frozen=True)
class Part:
    """The result of a task.

    Parameters
    ----------
    content : bytes
        A Parquet file with one row a case, in the task's order.
    failures : tuple of Failure
        All cases that failed.
    """

    content: bytes
    failures: tuple[Failure, ...]


def run_task(task: Task) -> Part:
    """Run the cases of a task.

    Returns
    -------
    Part
        The rows; a case that failed is a row with its reason.
    """
    rows = Rows(task.groups)
    lanes = Lanes(rows)
    after = 0
    for number, (series, keys, works) in enumerate(task.groups):
        places = range(after, after := after + len(keys))
        try:
            prepared = replace(_prepare_series(series, task), usual=sum(map(_is_usual, works)))
        except Exception as error:  # an error in one series must not lose the results of the others
            rows.fail(places, _failure_reason(series, error))
            continue
        rows.describe(number, prepared.entries)
        if prepared.warnings:
            rows.put(places, {"warnings": [prepared.warnings] * len(places)})
        for place, work in zip(places, works, strict=True):
            try:
                _run_case(place, prepared, work, rows, lanes)
            except Exception as error:  # as above
                rows.fail([place], _failure_reason(series, error))
    lanes.finish()
    part = _as_part(rows)
    _freeze_loaded()
    return part


def _failure_reason(series: Series, error: Exception) -> str | Exception:
    """Return why a series failed, without the path of its log, which the row already has."""
    if isinstance(series, Log) and isinstance(error, HydrostateError) and error.source == series.path:
        return error.message
    return error


@cache
def _freeze_loaded() -> None:
    """Exclude what the first task loaded from garbage collection, which takes a thirtieth of a worker's time."""
    if multiprocessing.parent_process() is not None:
        gc.collect()
        gc.freeze()


def lost_task(task: Task, reason: str) -> Part:
    """Return a task's cases as failed."""
    rows = Rows(task.groups)
    rows.fail(range(len(task.keys)), reason)
    return _as_part(rows)


def _as_part(rows: Rows) -> Part:
    buffer = BytesIO()
    pq.write_table(rows.table(), buffer, write_page_checksum=True)
    return Part(buffer.getvalue(), rows.failures())


@dataclass(frozen=True, eq=False)
class _PreparedSeries:
    """A series with the data that a method may use, and the entries that it adds to its cases' rows."""

    record: Record
    rig: Rig[Any]
    parameters: EhaParameters
    sensors: str | None
    entries: Row
    warnings: str | None = None
    other: ActuatorKind | None = None
    problems: dict[tuple[object, ...], FilterProblem] = field(default_factory=dict[tuple[object, ...], FilterProblem])
    usual: int = 0
    """Number of cases that use the estimate of bulk modulus from the unchanged log with default options [count]."""

    @property
    def truth(self) -> float | None:
        """The simulated bulk modulus [Pa]."""
        return self.entries.get(TRUTH)

    @cached_property
    def _default_estimate(self) -> tuple[CleanLog, BulkModulusEstimate, tuple[LogWarning, ...]]:
        with catch_log_warnings() as said:
            found = checked_estimate(clean_log(self.record, self.rig.parameters), self.rig, DEFAULT_OPTIONS)
        return *found, tuple(said)

    def shared_estimate(self, record: Record, parameters: EhaParameters, work: Work) -> Seen | None:
        """Return the estimate that cases share and repeat its warnings; None if only one case needs it."""
        if self.usual < 2 or not _is_usual(work) or record is not self.record or parameters != self.rig.parameters:
            return None
        log, found, said = self._default_estimate
        for one in said:
            warnings.warn(one, stacklevel=2)
        return log, found


def _prepare_series(series: Series, task: Task) -> _PreparedSeries:
    rig = task.rig_of(series)
    kind = kind_of_rig(rig, task.plant)
    other = None if kind.name == DEFAULT else kind
    if isinstance(series, Log):
        with _one_at_a_time, catch_log_warnings() as said:
            record = read_listed(series, rig, kind.required)
        if content_of(Path(series.path)) != series.content:
            raise LogError(f"{series.path}: was changed after the study began; run the same command again")
        known = record.metadata.get("condition")
        entries: Row = {"duration_s": record.duration, "sample_time_s": record.sample_time}
        entries |= {"condition": known} if isinstance(known, str) else {}
        entries |= {} if other is None else {"plant": kind.name}
        return _PreparedSeries(record, rig, rig.parameters, None, entries, _sentences(said), other)
    if other is not None:
        return _PreparedSeries(simulated_run(other, series, rig), rig, rig.parameters, series.sensors, {}, None, other)
    truth, parameters = _truth(series, rig.parameters)
    record = measure(truth, SENSORS[series.sensors], _stream(series, "sensors"))
    return _PreparedSeries(record, rig, parameters, series.sensors, {TRUTH: parameters.bulk_modulus})


def _stream(series: Simulated, what: str) -> np.random.Generator:
    place = (series.plant, series.drive, repr(series.leakage_severity), repr(series.friction_severity))
    return stream(series.seed, "batch", what, *place)


def _truth(series: Simulated, healthy: EhaParameters) -> tuple[Record, EhaParameters]:
    seed = 0 if series.drive in DETERMINISTIC_DRIVES else series.seed
    return _motion(replace(series, seed=seed, condition=None, sensors=""), healthy)


@lru_cache(maxsize=2)
def _motion(series: Simulated, healthy: EhaParameters) -> tuple[Record, EhaParameters]:
    """Return the true motion, cached for the seeds and sensors that share it."""
    parameters = severity(series.leakage_severity, series.friction_severity, healthy)
    speed = make_drive(series.drive, series.duration_s, series.sample_time_s, parameters, _stream(series, "drive"))
    return simulate(PLANTS[series.plant], speed, series.sample_time_s, parameters), parameters


def _run_case(place: int, prepared: _PreparedSeries, work: Work, rows: Rows, lanes: Lanes) -> None:
    """Write the result of a case to its place, or queue the case until its lanes are full."""
    record, parameters = _method_inputs(prepared, work)
    if work.verb == "filter":
        problem = _problem(record, parameters, work, prepared)
        waiting = WaitingFilter(place, problem, prepared.truth)
        if work.method == "ekf":
            lanes.add(waiting)
        else:
            write_filtered(rows, [waiting], [METHODS[work.method](problem)])
        return
    with _one_at_a_time, catch_log_warnings() as said:
        if prepared.other is not None:
            found = analyse_to_row(prepared.other, work.verb, prepared.record, prepared.rig)
        elif work.verb == "diagnose":
            found = diagnose_to_row(
                record, prepared.rig, prepared.shared_estimate(record, prepared.rig.parameters, work)
            )
        else:
            found = _estimate_row(record, parameters, work, prepared)
    found["warnings"] = _sentences([prepared.warnings, *said] if prepared.warnings else said)
    rows.put([place], {name: [value] for name, value in found.items()})


def _method_inputs(prepared: _PreparedSeries, work: Work) -> tuple[Record, EhaParameters]:
    record = prepared.record
    if not work.pressure and PRESSURE in record:
        record = record.replace(**{PRESSURE: None})
    return record, prepared.parameters if work.told == "condition" else prepared.rig.parameters


def _estimate_row(record: Record, parameters: EhaParameters, work: Work, prepared: _PreparedSeries) -> Row:
    seen = prepared.shared_estimate(record, parameters, work)
    if seen is None:
        log = clean_log(record, parameters)
        seen = log, estimate_clean(log, parameters, _options(work))
    for note in left_out_notes(*seen):
        warnings.warn(LogWarning(note), stacklevel=2)
    log, found = seen
    reasons = [str(note) for note in found.gate.reasons]
    if found.value is None:
        reasons = [estimate_message(finding_of(log, found, prepared.rig))]
    row: Row = {"outcome": found.outcome.value, "reason": "; ".join(reasons) or None, "trusted": found.gate.passed}
    row |= {"bulk_modulus_pa": found.value, "bulk_modulus_std_pa": found.std}
    row["error_percent"] = error_percent(found.value, prepared.truth)
    return row | {NIS[channel]: value for channel, value in found.nis.items() if channel in NIS}


def _is_usual(work: Work) -> bool:
    """Return whether a case uses the estimate of bulk modulus with default options."""
    return work.pressure and (
        work.verb == "diagnose" or (work.verb == "estimate" and _options(work) == DEFAULT_OPTIONS)
    )


def _options(work: Work) -> EstimateOptions:
    return EstimateOptions(form=work.form, method=work.method, start=work.start_pa, start_std=work.start_std_pa)


def _problem(record: Record, parameters: EhaParameters, work: Work, prepared: _PreparedSeries) -> FilterProblem:
    """Return the filtering task; data shared by its first guesses are computed once for each series."""
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
    """Return the task for the rig's own guess; for a simulated run the filter knows the sensor noise."""
    model = FORMS[work.form]
    channels = tuple(channel for channel in _predicted_channels(work.form) if channel in record)
    if sensors is None:
        variances = measurement_variances(record, channels)
    else:
        known = _known_variances(sensors)
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


def _sentences(said: Iterable[object]) -> str | None:
    """Return the notes on a log as one text, each sentence once."""
    return valid_text("; ".join(dict.fromkeys(map(str, said)))) or None


@cache
def _predicted_channels(form: str) -> tuple[str, ...]:
    return predicted_channels(FORMS[form])


@cache
def _known_variances(sensors: str) -> Mapping[str, float]:
    return noise_variances(SENSORS[sensors])
