"""The nine-condition study, as tables, series and transfer functions, and how its report shows them."""

import warnings
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import pandas as pd

from experiments.nine_conditions.bulk_modulus import (
    POSITION_SINE,
    POSITION_STEPS,
    PRESSURE_SINE,
    PRESSURE_STEPS,
    PUBLISHED_METHOD,
    PUBLISHED_METHOD_STICKING,
    bulk_modulus_study,
)
from experiments.nine_conditions.columns import COLUMNS, report_frames
from experiments.nine_conditions.conditions import condition_table, scalar_table
from experiments.nine_conditions.figures import FIGURES
from experiments.nine_conditions.filterpy_column import EQUALITY_TOLERANCE, filterpy_study, verdict_counts
from experiments.nine_conditions.findings import class_accuracies, recoveries, truth_of
from experiments.nine_conditions.printed_test import printed_test
from experiments.nine_conditions.sentences import verdict
from experiments.nine_conditions.settings import StudySettings, quick_settings
from experiments.nine_conditions.transfer_functions import (
    filtering_table,
    identification_study,
    order_table,
    response_curves,
    transfer_function_table,
)
from experiments.nine_conditions.validation import classification_study, validation_study
from experiments.nine_conditions.validation_on_circuit import validation_on_circuit
from experiments.page.folder import json_file
from experiments.page.frames import Tables, parameter_table
from experiments.running.progress import Track, run_as_one_piece
from experiments.running.random_streams import stream
from experiments.running.study import Study, StudyResult
from plant.eha.model import EhaParameters
from plant.errors import LogWarning
from plant.sensors.sensors import BENCH

RIG = EhaParameters()


def _find(settings: StudySettings, track: Track) -> StudyResult:
    # the tables state each fit's doubts; ignored here, because threads share the warning filters
    with warnings.catch_warnings(action="ignore", category=LogWarning):
        return _parts(settings, track)


def _parts(settings: StudySettings, track: Track) -> StudyResult:
    estimates, convergence = bulk_modulus_study(RIG, settings, track)
    library, tests = identification_study(RIG, settings, track)
    rmse, runs = run_as_one_piece(
        track, "validating on the nine steps", lambda: validation_study(RIG, library, settings)
    )
    conditions = condition_table(RIG)
    tables = {
        "filterpy": filterpy_study(RIG, settings, track),
        "conditions": conditions,
        "parameters": parameter_table(RIG),
        "bulk_modulus": estimates,
        "transfer_functions": transfer_function_table(library),
        "printed_test": printed_test(RIG, settings.seed, settings.identification_duration, track),
        "validation_rmse": rmse,
        "validation_on_circuit": validation_on_circuit(RIG, library, settings, track),
        "filtering": filtering_table(stream(settings.seed, "filtering"), settings.identification_duration),
        "scalars": scalar_table(conditions, library, _mean_estimate(estimates)),
        **classification_study(RIG, library, settings, track),
    }
    series = {
        "convergence": convergence,
        "validation_runs": runs,
        "responses": response_curves(library, tests),
        "order": order_table(tests["normal"], stream(settings.seed, "order")),
    }
    models = json_file({name: model.to_dict() for name, model in library.items()})
    return StudyResult(tables, series, {"transfer_functions.json": models})


def _mean_estimate(estimates: pd.DataFrame) -> float:
    ours = estimates[(estimates["form"] == "pressure") & estimates["pressure_logged"]]
    return float(ours["value_pa"].mean())


def _facts(tables: Tables, settings: StudySettings) -> Mapping[str, Any]:
    found = recoveries(tables["bulk_modulus"])
    rmse = tables["validation_rmse"]
    published_better = rmse["published_rmse_mathematical_m_s"] < rmse["published_rmse_transfer_function_m_s"]
    return {
        **report_frames(tables, settings),
        "verdict": verdict(tables),
        "truth_pa": truth_of(tables),
        "published_way": found[PUBLISHED_METHOD],
        "published_stuck": found[PUBLISHED_METHOD_STICKING],
        "ours": (found[PRESSURE_SINE], found[PRESSURE_STEPS]),
        "position_steps": found[POSITION_STEPS],
        "position_sine": found[POSITION_SINE],
        "filterpy_steps": int(tables["filterpy"]["steps"].max()),
        "filterpy_equal": EQUALITY_TOLERANCE,
        "filterpy_counts": verdict_counts(tables["filterpy"]),
        "classes": class_accuracies(tables),
        "better": int(rmse["mathematical_is_better"].sum()),
        "published_better": int(published_better.sum()),
        "suggested_order": int(tables["order"]["suggested_order"].iloc[0]),
        "velocity_noise_m_s": BENCH.velocity_noise,
        "quick": settings == quick_settings(settings.seed),
    }


NINE_CONDITIONS = Study("nine conditions", "nine_conditions/report.html", _find, FIGURES, COLUMNS, asdict(RIG), _facts)
