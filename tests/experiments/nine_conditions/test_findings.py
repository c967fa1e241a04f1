"""The counts in the summary of the tables are right."""

import numpy as np
import pandas as pd

from experiments.nine_conditions.bulk_modulus import POSITION_SINE, PRESSURE_SINE, PRESSURE_STEPS
from experiments.nine_conditions.findings import class_accuracies, recoveries
from experiments.nine_conditions.sentences import verdict
from experiments.running.study import StudyResult


def _estimates(errors: dict[str, list[float | None]], outcome: str = "ok") -> pd.DataFrame:
    rows = [
        {
            **PRESSURE_SINE._asdict(),
            "condition": condition,
            "outcome": outcome if error is None else "ok",
            "error_percent": np.nan if error is None else error,
            "value_pa": np.nan if error is None else 2.07e8 * (1.0 + error / 100.0),
            "ci95_low_pa": np.nan if error is None else 2.07e8 * (1.005 + error / 100.0 - 0.01),
            "ci95_high_pa": np.nan if error is None else 2.07e8 * (1.005 + error / 100.0),
            "gate_passed": error is not None and error > 0.0,
            "bound_percent": 0.1,
            "filter_settled_at_pa": 2e8,
            "claim": "",
        }
        for condition, starts in errors.items()
        for error in starts
    ]
    return pd.DataFrame(rows)


def test_a_condition_is_recovered_if_the_estimate_from_every_first_guess_is() -> None:
    found = recoveries(_estimates({"normal": [0.2, -0.9], "minor_leakage": [0.1, -1.1]}))[PRESSURE_SINE]
    assert (found.recovered, found.conditions, found.estimates) == (1, 2, 4)
    assert found.worst_error_percent is not None
    assert round(found.worst_error_percent, 6) == 1.1
    assert found.missed == ("minor leakage (1.1 % off)",)


def test_passed_gates_and_covering_intervals_are_counted() -> None:
    found = recoveries(_estimates({"normal": [0.2, -0.9], "minor_leakage": [0.1, None]}))[PRESSURE_SINE]
    assert (found.passed, found.covered, found.estimates) == (2, 2, 4)


def test_a_condition_that_is_not_observable_is_neither_recovered_nor_missed() -> None:
    found = recoveries(_estimates({"normal": [None, None]}, "not_observable"))[PRESSURE_SINE]
    assert (found.recovered, found.unobservable, found.missed) == (0, ("normal",), ())
    assert found.mean_pa is None


def test_a_diverged_estimate_counts_as_missed_and_is_named() -> None:
    found = recoveries(_estimates({"normal": [None, 0.1]}, "diverged"))[PRESSURE_SINE]
    assert found.missed == ("normal (diverged, 0.1 % off)",)


def test_the_most_frequent_confusion_is_named(study: StudyResult) -> None:
    tables = dict(study.tables)
    confusion = tables["confusion transfer functions nominal"].copy()
    confusion.loc["minor_leakage", "major_friction"] = 12
    tables["confusion transfer functions nominal"] = confusion
    entry = next(
        found for found in class_accuracies(tables) if (found.bank, found.variant) == ("transfer functions", "nominal")
    )
    assert entry.likeliest_error.startswith("minor leakage taken for major friction, 12 of 1")


def test_the_classification_accuracies_are_taken_from_the_table(study: StudyResult) -> None:
    shares = [entry.percent / 100.0 for entry in class_accuracies(study.tables)]
    assert np.allclose(shares, study.tables["classification"]["accuracy"])


def test_the_verdict_quotes_the_tables(study: StudyResult) -> None:
    estimates = study.tables["bulk_modulus"]
    found = recoveries(estimates)
    bulk, classes, limits = verdict(study.frames)
    worst = max(found[key].worst_error_percent or 0.0 for key in (PRESSURE_SINE, PRESSURE_STEPS))
    assert f"{worst:.2g} % off" in bulk
    assert f"{100.0 * study.tables['classification']['accuracy'].iloc[0]:.3g} % of 9 runs" in classes
    assert f"does not show bulk modulus in {len(found[POSITION_SINE].unobservable)} of 9 conditions" in limits
