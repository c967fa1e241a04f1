"""The gear-pump actuator (servo motor, pump and cylinder) as a kind: its options and what they do."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.actuator_kind import ActuatorKind, Experiment, LogVerb, Options, Simulation
from experiments.command.json_output import Result
from experiments.command.options import PRESSURE, require_positive, split_names
from experiments.command.terminal import note
from experiments.eha.entries import NO_DIAGNOSIS, NO_ESTIMATE, diagnosis_entries, estimate_entries
from experiments.eha.identifiability import CHANNELS as SENSORS
from experiments.eha.identifiability import cards_of, experiment_entries, experiments_shown
from experiments.eha.screens import diagnoses_shown, estimates_shown
from experiments.eha.simulated import simulate_log
from faults.conditions import CONDITIONS, find_condition, parameters_for
from plant.eha.model import EhaParameters
from plant.eha.rig import UNNAMED
from plant.errors import HydrostateError, LogError, require_known
from plant.log.columns import CHANNELS

if TYPE_CHECKING:
    from typing import TypeAlias

    from estimation.eha.bulk_modulus import EstimateOptions
    from estimation.eha.result import BulkModulusEstimate
    from estimation.finding import Finding
    from estimation.identification.model.linear_model import LinearModel
    from estimation.log_checks.clean import CleanLog
    from faults.diagnosis.rmse import Scores
    from plant.eha.rig import Rig
    from plant.log.record import Record

    Linear: TypeAlias = Callable[[], Mapping[str, LinearModel]] | None


EHA_CHANNELS = ("motor_speed_rad_s", *SENSORS.values(), "pressure_a_pa", "pressure_b_pa", "motor_voltage_v")


NOT_FAULTY = dict.fromkeys(("condition", "leakage_severity", "friction_severity"))
ESTIMATE_OPTIONS = {"form": "auto", "method": "auto", "sensors": "", "no_pressure": False, "condition": None}
FILTER_OPTIONS = {"states": "", "robust": "none", "tune": None, "smooth": False, "figure": None}
FIRST_GUESS = {"start": None, "start_std": 3e8}
EXPERIMENT = {"sensors": ",".join(SENSORS), "noise": "bench", "drive": "steps", "seconds": 10.0, "rate": 1000.0}


def _prepare_estimation(
    rig: "Rig[Any]", options: Options
) -> "tuple[Rig[Any], tuple[EstimateOptions, frozenset[str], bool]]":
    """Return the rig in its condition, how its log is estimated, the channels not to use, and whether tuning is open.

    By default the pressure form is tuned if pressure is logged: with noise levels that suit any rig, its interval is
    several times too wide.
    """
    how, unused = _estimate_options(options), _unused_channels(options["sensors"], options["no_pressure"])
    open_choice = options["tune"] is None and how.form == "pressure" and how.method in ("auto", "ekf")
    if options["condition"] is not None:
        rig = replace(rig, parameters=parameters_for(find_condition(options["condition"]), rig.parameters))
    return rig, (how, unused, open_choice)


def _estimate_options(options: Options) -> "EstimateOptions":
    """Check the options, and return them in the form that the estimate takes."""
    from estimation.eha.bulk_modulus import FITTED, LEAST_SQUARES, EstimateOptions
    from estimation.filters.run import ROBUST
    from estimation.models.eha_forms import FORMS

    form, method, robust, start = (options[name] for name in ("form", "method", "robust", "start"))
    require_known("--form", form, ["auto", *FITTED, *FORMS])
    if method not in ("auto", LEAST_SQUARES):  # otherwise no filter need be imported
        from estimation.eha.named_methods import NAMED
        from estimation.filters.methods import METHODS

        require_known("--method", method, ["auto", LEAST_SQUARES, *NAMED, *METHODS])
    require_known("--robust", robust, list(ROBUST))
    if options["smooth"] and method not in ("auto", "ekf", "smoother"):
        raise HydrostateError(f"--smooth smooths the ekf, got --method {method}")
    if wanted := split_names(options["states"]):
        from estimation.eha.by_filter import GROUPS
        from estimation.models.augment import AUGMENTABLE

        for name in wanted:
            require_known("--states", name, [*GROUPS, *AUGMENTABLE])
    require_positive("--start-std", options["start_std"], "Pa")
    if start != 0.0:
        require_positive("--start", start, "Pa")
    method = "smoother" if options["smooth"] else method
    return EstimateOptions(form, method, start, options["start_std"], wanted, bool(options["tune"]), robust)


def _unused_channels(sensors: str, no_pressure: bool) -> frozenset[str]:
    """Return the channels that must not be used."""
    used = split_names(sensors)
    for name in used:
        require_known("--sensors", name, list(SENSORS))
    left_out = {channel for name, channel in SENSORS.items() if used and name not in used}
    return frozenset(left_out | ({PRESSURE} if no_pressure else set()))


def _estimate(
    record: "Record",
    rig: "Rig[Any]",
    asked: "tuple[EstimateOptions, frozenset[str], bool]",
    kept: "dict[Any, Any] | None" = None,
) -> "Finding":
    from estimation.eha.bulk_modulus import DEFAULT_OPTIONS
    from estimation.eha.estimate import checked_estimate, estimate_log, finding_of
    from estimation.log_checks.clean import clean_log

    how, unused, open_choice = asked
    record = record.replace(**{channel: None for channel in unused if channel in record})
    if open_choice and PRESSURE in record:
        how = replace(how, tuned=True)
    if kept is None or how != DEFAULT_OPTIONS:
        return estimate_log(record, rig, how)
    if (seen := _cached_estimate(record, rig, kept)) is None:
        seen = checked_estimate(clean_log(record, rig.parameters), rig, how)
        kept[tuple(record)] = rig, seen
    return finding_of(*seen, rig)


def _cached_estimate(
    record: "Record", rig: "Rig[Any]", kept: "dict[Any, Any]"
) -> "tuple[CleanLog, BulkModulusEstimate] | None":
    """Return a checked log with its default estimate, with which both verbs begin; None if it is not cached."""
    from estimation.log_checks.clean import clean_log

    of_rig, (log, estimate) = kept.get(tuple(record), (None, (None, None)))
    if estimate is None or of_rig != rig:
        return None
    if log is None:
        log = clean_log(record, rig.parameters)
        kept[tuple(record)] = rig, (log, estimate)
    return log, estimate


def _innovations(found: "Finding", log: str, path: Path) -> None:
    """Write the figure of a filtered log."""
    from experiments.log_pages.innovations_figure import write_innovations

    if found.evidence.estimate is None:
        note(f"no figure: {log} was not filtered; ask for one with --method ekf")
        return
    write_innovations(found.evidence, log, path)


def _condition_remarks(results: Sequence[Result]) -> Iterable[str]:
    from estimation.eha.bulk_modulus import FITTED

    if any(one["condition"] is None and one["form"] not in (None, *FITTED) for one in results):
        rig = results[0]["rig"]
        yield f"no --condition: leakage and friction were taken to be those of the rig {rig!r}, healthy"


def _prepare_diagnosis(rig: "Rig[Any]", options: Options) -> "tuple[Rig[Any], tuple[bool, Linear]]":
    """Return the rig, whether pressure is unused, and the source of the nine transfer functions.

    By default the library is read if it belongs to this rig. Identifying a new library takes long, so it must be
    requested.
    """
    linear = cache(lambda: _transfer_functions(rig.parameters, options["seed"]))
    asked = options["transfer_functions"]
    wanted = rig.parameters == EhaParameters() if asked is None else asked
    return rig, (options["no_pressure"], linear if wanted else None)


def _transfer_functions(parameters: EhaParameters, seed: int) -> "Mapping[str, LinearModel]":
    import warnings

    import numpy as np

    from experiments.published.library import read_library
    from faults.eha.bank import LIBRARY_DURATION, identify_bank
    from plant.errors import LogWarning

    if parameters == EhaParameters():
        return read_library()
    note("identifying nine transfer functions from simulated tests of the rig")
    with warnings.catch_warnings(action="ignore", category=LogWarning):
        return identify_bank(parameters, np.random.default_rng(seed), duration=LIBRARY_DURATION)


def _diagnose(
    record: "Record", rig: "Rig[Any]", asked: "tuple[bool, Linear]", kept: "dict[Any, Any] | None" = None
) -> "Finding":
    from estimation.log_checks.sample_time import require_fast_enough
    from faults.diagnosis.diagnose import diagnose_log
    from faults.diagnosis.rmse import score_transfer_functions
    from faults.notes import ClassCode
    from plant.spare_processors import start_if_idle

    require_fast_enough(record.sample_time)  # checked before the transfer functions resample the log
    no_pressure, linear = asked
    if no_pressure:
        record = record.replace(**{PRESSURE: None})

    def scored(used: "Record" = record) -> "Scores | None":
        return None if linear is None else score_transfer_functions(used, linear())

    waiting = scored if linear is None else start_if_idle(scored) or scored
    seen = None if kept is None else _cached_estimate(record, rig, kept)
    found = diagnose_log(record, rig, seen)
    if kept is not None and seen is None:  # the diagnosis made its own estimate in parallel: keep it
        kept[tuple(record)] = rig, (None, found.evidence.estimate)
    wrong = any(one.code is ClassCode.VELOCITY_CONTRADICTED for one in found.notes)
    try:
        scores = scored(record.replace(**{SENSORS["velocity"]: None})) if wrong else waiting()
    except LogError as error:
        note(f"the transfer functions are left out: {error}")
        return found
    return found if scores is None else replace(found, evidence=replace(found.evidence, transfer_functions=scores))


def _page(result: Result, found: "Finding", record: "Record") -> str:
    from experiments.eha.diagnosis_page import diagnosis_page
    from experiments.log_pages.finding_page import finding_page

    return diagnosis_page(result, found, record) if found.probabilities else finding_page(result, found, record)


EHA = ActuatorKind(
    name="eha",
    description="servo motor, gear pump and cylinder, no valve in the power path",
    parameters=EhaParameters,
    channels={name: CHANNELS[name] for name in EHA_CHANNELS},
    required=("motor_speed_rad_s", "position_m or velocity_m_s"),
    conditions=tuple(CONDITIONS),
    models=("reduced", "lumped", "circuit"),
    rig_name=UNNAMED,
    simulate=Simulation(
        run=simulate_log,
        options=NOT_FAULTY
        | {"drive": "steps", "duration": 10.0, "sample_time": 1e-4, "sensors": "bench"}
        | {"fmu": None, "columns": None, "parameter": None},
    ),
    estimate=LogVerb(
        run=_estimate,
        run_beside=_estimate,
        prepare=_prepare_estimation,
        options=ESTIMATE_OPTIONS | FILTER_OPTIONS | FIRST_GUESS,
        entries=estimate_entries,
        blank=NO_ESTIMATE,
        screen=estimates_shown,
        figure=_innovations,
        remarks=_condition_remarks,
    ),
    diagnose=LogVerb(
        run=_diagnose,
        run_beside=_diagnose,
        prepare=_prepare_diagnosis,
        options={"no_pressure": False, "scores": False, "transfer_functions": None},
        entries=diagnosis_entries,
        blank=NO_DIAGNOSIS,
        screen=diagnoses_shown,
        page=_page,
    ),
    identifiability=Experiment(
        run=cards_of,
        options=EXPERIMENT | {"ranked": False, "condition": None},
        entries=experiment_entries,
        screen=experiments_shown,
    ),
)
