"""Findings from a study's tables: where bulk modulus was recovered, and which classes were found."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np
import pandas as pd

from estimation.finding import Outcome
from experiments.nine_conditions.bulk_modulus import (
    POSITION_STEPS,
    PRESSURE_SINE,
    PRESSURE_STEPS,
    PUBLISHED_METHOD,
    Experiment,
)
from experiments.nine_conditions.validation import WITHOUT_PRESSURE
from experiments.page.frames import Tables, cell
from experiments.page.words import condition_in_words

WANTED_PERCENT: Mapping[Experiment, float] = {
    PUBLISHED_METHOD: 3.0,
    PRESSURE_SINE: 1.0,
    PRESSURE_STEPS: 1.0,
    POSITION_STEPS: 3.0,
}
"""The largest error allowed for each experiment [percent]; experiments not listed show a limitation and have no
target."""


@dataclass(frozen=True)
class Recovery:
    """Result of one experiment over all conditions and first guesses.

    Parameters
    ----------
    recovered : int
        Number of conditions in which every estimate is a number within `wanted_percent`, or within 3 % if there is no
        target.
    unobservable : tuple of str
        Conditions in which bulk modulus is not observable, from any first guess.
    missed : tuple of str
        The other conditions as text, with the error or the outcome.
    passed, covered : int
        Number of estimates that pass the filter's own gate, and number whose 95 % interval covers the truth.
    wanted_percent : float or None
        The largest error allowed [percent].
    mean_pa, worst_error_percent : float or None
        Mean of the numbers [Pa] and the largest absolute error [percent]; None without a number.
    lowest_bound_percent, highest_bound_percent : float
        Range of the relative Cramér-Rao bound [percent].
    settled_low_pa, settled_high_pa : float
        Range of values at which the filter settles, reported or not [Pa].
    """

    key: Experiment
    claim: str
    estimates: int
    conditions: int
    recovered: int
    unobservable: tuple[str, ...]
    missed: tuple[str, ...]
    passed: int
    covered: int
    wanted_percent: float | None
    mean_pa: float | None
    worst_error_percent: float | None
    lowest_bound_percent: float
    highest_bound_percent: float
    settled_low_pa: float
    settled_high_pa: float


@dataclass(frozen=True)
class ClassAccuracy:
    """Accuracy of one bank of models as a classifier.

    Parameters
    ----------
    bank, variant : str
        The bank, and whether parameters were nominal or spread.
    percent : float
        Share of right classes [percent].
    likeliest_error : str
        The most frequent confusion in words; empty if there was none.
    """

    bank: str
    variant: str
    runs: int
    percent: float
    likeliest_error: str


def truth_of(tables: Tables) -> float:
    """Return the simulated bulk modulus.

    Returns
    -------
    float
        Value in the table ``parameters`` [Pa].
    """
    return cell(tables["parameters"].set_index("parameter"), "bulk_modulus", "value")


def by_experiment(estimates: pd.DataFrame) -> Iterator[tuple[Experiment, pd.DataFrame]]:
    """Split the table of estimates into its experiments, in the study's order.

    Yields
    ------
    tuple of Experiment and pandas.DataFrame
        An experiment and its rows.
    """
    for key, rows in estimates.groupby(list(Experiment._fields), sort=False):
        plant, form, drive, logged = cast(tuple[str, str, str, bool], key)
        yield Experiment(plant, form, drive, bool(logged)), rows


def experiment_in_words(key: Experiment) -> str:
    """Return an experiment's name for a reader.

    Returns
    -------
    str
        The filter form, the plant, the drive and the sensors, separated by commas.

    Examples
    --------
    >>> experiment_in_words(PRESSURE_STEPS)
    'pressure form, plant sticks, nine steps, with pressure'
    """
    plants = {"reduced": "never sticks", "lumped": "sticks"}
    drives = {"sine": "10 Hz sine", "steps": "nine steps"}
    sensors = "with pressure" if key.pressure_logged else "without pressure"
    return f"{key.form} form, plant {plants.get(key.plant, key.plant)}, {drives.get(key.drive, key.drive)}, {sensors}"


def recoveries(estimates: pd.DataFrame) -> Mapping[Experiment, Recovery]:
    """Summarise every experiment on bulk modulus.

    Returns
    -------
    Mapping[Experiment, Recovery]
        One summary for each experiment, in the study's order.
    """
    return {key: _recovery(key, rows) for key, rows in by_experiment(estimates)}


def _recovery(key: Experiment, rows: pd.DataFrame) -> Recovery:
    wanted = WANTED_PERCENT.get(key)
    limit = max(WANTED_PERCENT.values()) if wanted is None else wanted
    unobservable: list[str] = []
    missed: list[str] = []
    groups = list(rows.groupby("condition", sort=False))
    for name, found in groups:
        errors = found["error_percent"].astype(float)
        worst = float(errors.abs().max())
        outcomes = [str(outcome).replace("_", " ") for outcome in found["outcome"][errors.isna()].unique()]
        if (found["outcome"] == Outcome.NOT_OBSERVABLE.value).all():
            unobservable.append(condition_in_words(str(name)))
        elif outcomes or worst > limit:
            why = [*outcomes, *([f"{worst:.3g} % off"] if np.isfinite(worst) else [])]
            missed.append(f"{condition_in_words(str(name))} ({', '.join(why)})")
    values = rows["value_pa"].astype(float).dropna()
    return Recovery(
        key=key,
        claim=str(rows["claim"].iloc[0]),
        estimates=len(rows),
        conditions=len(groups),
        recovered=len(groups) - len(unobservable) - len(missed),
        unobservable=tuple(unobservable),
        missed=tuple(missed),
        passed=int(rows["gate_passed"].sum()),
        covered=_covered_count(rows),
        wanted_percent=wanted,
        mean_pa=float(values.mean()) if len(values) else None,
        worst_error_percent=float(rows["error_percent"].astype(float).abs().max()) if len(values) else None,
        lowest_bound_percent=float(rows["bound_percent"].min()),
        highest_bound_percent=float(rows["bound_percent"].max()),
        settled_low_pa=float(rows["filter_settled_at_pa"].min()),
        settled_high_pa=float(rows["filter_settled_at_pa"].max()),
    )


def _covered_count(rows: pd.DataFrame) -> int:
    """Return the number of intervals that cover the truth, from which the errors are counted."""
    known = rows.dropna(subset=["value_pa", "error_percent"])
    truth = known["value_pa"].astype(float) / (1.0 + known["error_percent"].astype(float) / 100.0)
    low, high = known["ci95_low_pa"].astype(float), known["ci95_high_pa"].astype(float)
    return int(((low <= truth) & (truth <= high)).sum())


def class_accuracies(tables: Tables) -> tuple[ClassAccuracy, ...]:
    """Summarise the classification, bank by bank."""
    rows = tables["classification"][["bank", "variant", "runs", "accuracy"]].itertuples(index=False, name=None)
    return tuple(
        ClassAccuracy(bank, variant, runs, 100.0 * share, _likeliest_error(tables[f"confusion {bank} {variant}"]))
        for bank, variant, runs, share in rows
    )


def _likeliest_error(confusion: pd.DataFrame) -> str:
    counts = confusion.to_numpy(dtype=np.int64)
    wrong = np.where(np.eye(len(counts), dtype=bool), 0, counts)
    true, found = np.unravel_index(int(wrong.argmax()), wrong.shape)
    if wrong[true, found] == 0:
        return ""
    names = [condition_in_words(str(name)) for name in confusion.columns]
    return f"{names[true]} taken for {names[found]}, {wrong[true, found]} of {counts[true].sum()}"


def bank_in_words(bank: str) -> str:
    """Return a classifier's name for a reader.

    Returns
    -------
    str
        The name, with a note on what was not logged.

    Examples
    --------
    >>> bank_in_words("mathematical")
    'mathematical, velocity alone'
    """
    return f"{bank}, velocity alone" if bank == WITHOUT_PRESSURE else bank
