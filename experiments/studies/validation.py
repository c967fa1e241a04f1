"""Section 6: both kinds of model on the nine steps (Table 5), and as classifiers over many seeds."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from estimation.identification.linear_model import LinearModel
from experiments.executors import side_by_side
from experiments.frames import cell
from experiments.published import load
from experiments.streams import stream
from experiments.studies.settings import StudySettings
from faults.bank import mathematical_bank, predict_run
from faults.classify import Scores, score_mathematical, score_transfer_functions
from faults.conditions import CONDITIONS, parameters_for
from faults.inject import spread
from faults.scores import accuracy, confusion_matrix
from plant.eha import EhaParameters
from plant.record import Record
from plant.sensors import BENCH
from plant.signals import make_drive
from plant.simulate import LUMPED, simulate

BANKS = ("mathematical, pressure logged", "mathematical", "transfer functions")
"""The classifiers that are compared."""

VARIANTS = ("nominal", "spread")
"""Parameters as in the tables, and spread around them."""


def validation_run(rig: EhaParameters, condition: str, settings: StudySettings, seed: int = 0) -> Record:
    """Simulate the nine steps of section 6 in a condition, at the transfer functions' sample time.

    Parameters
    ----------
    rig : EhaParameters
        The healthy actuator.
    condition : str
        Condition name.
    settings : StudySettings
        Size and seed.
    seed : int
        Which of the runs.

    Returns
    -------
    Record
        The run as the bench would log it.
    """
    p = parameters_for(CONDITIONS[condition], rig)
    return _nine_steps(p, settings, stream(settings.seed, "validation", condition, seed))


def _nine_steps(p: EhaParameters, settings: StudySettings, rng: np.random.Generator) -> Record:
    T = settings.classification_sample_time
    drive = make_drive("steps", settings.duration, T, p, rng)
    return simulate(LUMPED, drive, T, p, sensors=BENCH, rng=rng)


def validation_study(
    rig: EhaParameters, library: Mapping[str, LinearModel], settings: StudySettings
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compare both kinds of model on the nine steps in their own condition, as Table 5 does.

    Parameters
    ----------
    rig : EhaParameters
        The healthy actuator.
    library : Mapping[str, LinearModel]
        Transfer functions by condition.
    settings : StudySettings
        Size and seed.

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
        record = validation_run(rig, name, settings)
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
        predicted = predict_run(record, bank[name])["velocity_m_s"]
        runs.append(_run_frame(name, record, predicted, library[name].simulate(record["motor_speed_rad_s"])))
    return pd.DataFrame(rows), pd.concat(runs, ignore_index=True)


def _run_frame(name: str, record: Record, mathematical: np.ndarray, identified: np.ndarray) -> pd.DataFrame:
    frame = pd.DataFrame(
        {
            "condition": name,
            "time_s": record.time,
            "motor_speed_rad_s": record["motor_speed_rad_s"],
            "velocity_m_s": record["velocity_m_s"],
            "mathematical_m_s": mathematical,
            "transfer_function_m_s": identified,
        }
    )
    return frame.iloc[::5]


def classification_study(
    rig: EhaParameters,
    library: Mapping[str, LinearModel],
    settings: StudySettings,
    advance: Callable[[], None],
) -> dict[str, pd.DataFrame]:
    """Classify many runs with each bank, at nominal and at spread parameters.

    Spread draws leakage, flow bias and friction uniformly within 10 % and bulk modulus within 20 %; geometry and pump
    stay.

    Parameters
    ----------
    rig : EhaParameters
        The healthy actuator.
    library : Mapping[str, LinearModel]
        Transfer functions by condition.
    settings : StudySettings
        Size and seed.
    advance : callable
        Called once a seed of a variant.

    Returns
    -------
    dict[str, pandas.DataFrame]
        ``classification`` (accuracy by bank and variant), one confusion matrix a bank and variant, and
        ``score_example``, the mathematical bank's scores in the nine conditions.
    """
    bank = mathematical_bank(rig)
    tables: dict[str, pd.DataFrame] = {}
    summary: list[dict[str, object]] = []
    for variant in VARIANTS:

        def classify(seed: int, variant: str = variant) -> list[dict[str, Scores]]:
            runs = (_drawn_run(rig, name, variant, settings, seed) for name in CONDITIONS)
            return [_all_scores(run, bank, library) for run in runs]

        runs: list[dict[str, Scores]] = []
        for scores in side_by_side(classify, range(settings.seeds)):
            runs += scores
            advance()
        true = list(CONDITIONS) * settings.seeds
        for label in BANKS:
            confusion = confusion_matrix(true, [scores[label].condition for scores in runs])
            tables[f"confusion {label} {variant}"] = confusion
            summary.append({"bank": label, "variant": variant, "runs": len(true), "accuracy": accuracy(confusion)})
        tables.setdefault("score_example", _score_example(runs))
    return {"classification": pd.DataFrame(summary), **tables}


def _score_example(runs: list[dict[str, Scores]]) -> pd.DataFrame:
    """Return the first run's scores in each condition: one row a true condition, one column a model."""
    first = zip(CONDITIONS, runs, strict=False)
    return pd.DataFrame.from_dict({name: dict(run[BANKS[0]].by_condition) for name, run in first}, orient="index")


def _drawn_run(rig: EhaParameters, condition: str, variant: str, settings: StudySettings, seed: int) -> Record:
    rng = stream(settings.seed, "classification", variant, condition, seed)
    p = parameters_for(CONDITIONS[condition], rig)
    return _nine_steps(spread(p, rng) if variant == "spread" else p, settings, rng)


def _all_scores(
    record: Record, bank: Mapping[str, EhaParameters], library: Mapping[str, LinearModel]
) -> dict[str, Scores]:
    with_pressure = score_mathematical(record, bank)
    return {
        BANKS[0]: with_pressure,
        BANKS[1]: with_pressure.of_one("velocity_m_s"),
        BANKS[2]: score_transfer_functions(record, library),
    }
