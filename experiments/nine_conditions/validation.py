"""Section 6: both kinds of model on the nine steps (Table 5), and as classifiers over many seeds."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from estimation.identification.model.linear_model import LinearModel
from experiments.nine_conditions.settings import StudySettings
from experiments.page.frames import cell
from experiments.published import load
from experiments.running.executors import map_in_parallel
from experiments.running.progress import Track, without_progress
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.rmse import Scores, score_mathematical, score_transfer_functions
from faults.eha.bank import mathematical_bank, predict_run
from faults.eha.inject import varied_actuator
from faults.scores import accuracy, confusion_matrix
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

WITH_PRESSURE, WITHOUT_PRESSURE, TRANSFER_FUNCTIONS = (
    "mathematical, pressure logged",
    "mathematical",
    "transfer functions",
)
BANKS = (WITH_PRESSURE, WITHOUT_PRESSURE, TRANSFER_FUNCTIONS)

VARIANTS = ("nominal", "spread")
"""Parameters as in the tables, and spread around them."""


def _nine_steps(p: EhaParameters, settings: StudySettings, rng: np.random.Generator) -> Record:
    T = settings.classification_sample_time
    drive = make_drive("steps", settings.duration, T, p, rng)
    return simulate(LUMPED, drive, T, p, sensors=BENCH, rng=rng)


def validation_study(
    rig: EhaParameters, library: Mapping[str, LinearModel], settings: StudySettings
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare both kinds of model on the nine steps in their own condition, as Table 5 does.

    Returns
    -------
    tuple of pandas.DataFrame
        RMSE in velocity by condition beside the published ones; and the runs in long form.
    """
    published = load("rmse").set_index("condition")
    bank = mathematical_bank(rig)
    rows: list[dict[str, object]] = []
    runs: list[pd.DataFrame] = []
    for name in CONDITIONS:
        rng = stream(settings.seed, "validation", name, 0)
        record = _nine_steps(parameters_for(CONDITIONS[name], rig), settings, rng)
        mathematical = score_mathematical(record, {name: bank[name]}, pressure=False).by_condition[name]
        identified = score_transfer_functions(record, {name: library[name]}).by_condition[name]
        rows.append(
            {
                "condition": name,
                "rmse_transfer_function_m_s": identified,
                "rmse_mathematical_m_s": mathematical,
                "published_rmse_transfer_function_m_s": cell(published, name, "rmse_system_id_m_per_s"),
                "published_rmse_mathematical_m_s": cell(published, name, "rmse_mathematical_m_per_s"),
                "mathematical_is_better": mathematical < identified,
            }
        )
        speed = record["motor_speed_rad_s"]
        measured = {"motor_speed_rad_s": speed, "velocity_m_s": record["velocity_m_s"]}
        predicted = {"mathematical_m_s": predict_run(record, bank[name])["velocity_m_s"]}
        predicted |= {"transfer_function_m_s": library[name].simulate(speed)}
        runs.append(pd.DataFrame({"condition": name, "time_s": record.time, **measured, **predicted}).iloc[::5])
    return pd.DataFrame(rows), pd.concat(runs, ignore_index=True)


def classification_study(
    rig: EhaParameters, library: Mapping[str, LinearModel], settings: StudySettings, track: Track = without_progress
) -> dict[str, pd.DataFrame]:
    """Classify many runs with each bank, at nominal and at spread parameters.

    In the spread variant, leakage, flow bias and friction are drawn uniformly within 10 % and bulk modulus within 20 %;
    geometry and pump are not changed.

    Returns
    -------
    dict[str, pandas.DataFrame]
        ``classification`` (accuracy by bank and variant), one confusion matrix for each bank and variant, and
        ``score_example``, the mathematical bank's scores in the nine conditions.
    """
    bank = mathematical_bank(rig)
    tables: dict[str, pd.DataFrame] = {}
    summary: list[dict[str, object]] = []
    for variant in VARIANTS:

        def classify(seed: int, variant: str = variant) -> list[dict[str, Scores]]:
            runs = (_random_run(rig, name, variant, settings, seed) for name in CONDITIONS)
            return [_all_scores(run, bank, library) for run in runs]

        done = map_in_parallel(classify, range(settings.seeds))
        done = track(done, settings.seeds, description=f"classifying, {variant} parameters")
        runs = [scores for of_seed in done for scores in of_seed]
        true = list(CONDITIONS) * settings.seeds
        for label in BANKS:
            confusion = confusion_matrix(true, [scores[label].condition for scores in runs])
            tables[f"confusion {label} {variant}"] = confusion
            summary.append({"bank": label, "variant": variant, "runs": len(true), "accuracy": accuracy(confusion)})
        tables.setdefault("score_example", _score_example(runs))
    return {"classification": pd.DataFrame(summary), **tables}


def _score_example(runs: list[dict[str, Scores]]) -> pd.DataFrame:
    """Return the first run's scores: one row for each true condition, one column for each model."""
    first = zip(CONDITIONS, runs, strict=False)
    return pd.DataFrame.from_dict({name: dict(run[WITH_PRESSURE].by_condition) for name, run in first}, orient="index")


def _random_run(rig: EhaParameters, condition: str, variant: str, settings: StudySettings, seed: int) -> Record:
    rng = stream(settings.seed, "classification", variant, condition, seed)
    p = parameters_for(CONDITIONS[condition], rig)
    return _nine_steps(varied_actuator(p, rng) if variant == "spread" else p, settings, rng)


def _all_scores(
    record: Record, bank: Mapping[str, EhaParameters], library: Mapping[str, LinearModel]
) -> dict[str, Scores]:
    with_pressure = score_mathematical(record, bank)
    return {
        WITH_PRESSURE: with_pressure,
        WITHOUT_PRESSURE: with_pressure.of_one("velocity_m_s"),
        TRANSFER_FUNCTIONS: score_transfer_functions(record, library),
    }
