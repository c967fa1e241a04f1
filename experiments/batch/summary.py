"""Summary tables of a store, computed from its rows alone."""

from collections.abc import Callable, Mapping
from typing import cast

import numpy as np
import pandas as pd
import pyarrow as pa

from estimation.finding import NORMAL_95
from faults.conditions import CONDITIONS
from faults.scores import confusion_matrix

METHOD = ["plant", "drive", "sensors", "verb", "form", "method", "pressure"]
"""Columns that distinguish methods."""

LOG_COLUMNS = [
    *("file", "verb", "outcome", "found_condition", "runner_up", "margin", "bulk_modulus_pa", "bulk_modulus_std_pa"),
    *("quantities", "trusted", "reason", "warnings"),
]
FAILURE_COLUMNS = ["plant", "file", "drive", "condition", "seed", "verb", "form", "method", "start_pa", "reason", "key"]
"""Columns of the tables that list logs and failed cases."""

OUTCOME_NAMES = ("ok", "not_observable", "mismatch", "diverged", "failed")

NEAR_PERCENT = 3.0
"""Maximum error of an estimate that counts as near the truth [%]."""


MOST_LISTED = 200
"""Maximum number of rows in a table on a page that lists cases one by one; its CSV holds all."""


def frame_of(rows: pa.Table) -> pd.DataFrame:
    """Return a store's rows as a data frame in which every condition has a name.

    Returns
    -------
    pandas.DataFrame
        One row for each case. A condition is given by its name, by its severities if it has no name, or as ``unknown``;
        ``known`` tells whether a diagnosis can name it.
    """
    frame = rows.to_pandas()
    free = frame["condition"].isna() & frame["leakage_severity"].notna()
    named = frame["condition"].fillna("unknown").astype(object)
    pairs = zip(frame.loc[free, "leakage_severity"], frame.loc[free, "friction_severity"], strict=True)
    known = frame["condition"].isin(list(CONDITIONS)) | (frame["condition"].notna() & (frame["plant"] != "log"))
    named[free] = [f"leakage {leakage:g}, friction {friction:g}" for leakage, friction in pairs]
    for name in METHOD:
        frame[name] = frame[name].astype(object).where(frame[name].notna(), "")
    return frame.assign(condition=named, known=known)


def summary_tables(frame: pd.DataFrame) -> Mapping[str, pd.DataFrame]:
    """Return the tables of a batch study.

    Returns
    -------
    Mapping[str, pandas.DataFrame]
        Tables by name, if the rows have content for them: ``outcomes``, ``bulk modulus``, ``diagnosis``, ``confusion``,
        ``classes``, ``logs``, ``failures``.
    """
    tables = {
        "outcomes": _outcome_table(frame),
        "bulk modulus": bulk_modulus_table(frame),
        "diagnosis": _diagnosis_table(frame),
        "confusion": _confusion_table(frame),
        "classes": _class_table(frame),
        "logs": frame.loc[frame["file"].notna(), LOG_COLUMNS].reset_index(drop=True),
        "failures": frame.loc[frame["outcome"] == "failed", FAILURE_COLUMNS].reset_index(drop=True),
    }
    return {name: table for name, table in tables.items() if len(table)}


def _outcome_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Count outcomes. One row for each method: number of cases, and of each outcome."""

    def entries(group: pd.DataFrame) -> dict[str, object]:
        counts = group["outcome"].value_counts()
        return {"cases": len(group), **{name: int(counts.get(name, 0)) for name in OUTCOME_NAMES}}

    return _row_per_group(frame, METHOD, entries)


def bulk_modulus_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of estimates against the known truth.

    Returns
    -------
    pandas.DataFrame
        One row for each method and condition: number of cases and of estimates, errors [%], share within `NEAR_PERCENT`
        and share of 95 % intervals that cover the truth [%].
    """
    known = frame[frame["verb"].isin(["filter", "estimate"]) & frame["true_bulk_modulus_pa"].notna()]
    return _row_per_group(known, [*METHOD, "condition"], _error_entries)


def _error_entries(group: pd.DataFrame) -> dict[str, object]:
    found = group[group["error_percent"].notna()]
    error = found["error_percent"].to_numpy()
    miss = (found["bulk_modulus_pa"] - found["true_bulk_modulus_pa"]).abs()
    covered = miss <= NORMAL_95 * found["bulk_modulus_std_pa"]
    names = ("low_percent", "median_percent", "high_percent", "rms_percent", "near_percent", "covered_percent")
    counts = {"cases": len(group), "estimates": len(found)}
    if not len(error):
        return {**counts, **dict.fromkeys(names)}
    shares = [100.0 * np.mean(np.abs(error) <= NEAR_PERCENT), 100.0 * covered.mean()]
    values = [*np.quantile(error, [0.05, 0.5, 0.95]), np.sqrt(np.mean(error**2)), *shares]
    return {**counts, **dict(zip(names, map(float, values), strict=True))}


def _row_per_group(
    frame: pd.DataFrame, by: list[str], entries: Callable[[pd.DataFrame], dict[str, object]]
) -> pd.DataFrame:
    """Return one row for each group, with each method in one block, in the order of first appearance."""
    groups = frame.groupby(by, sort=False)
    rows = [{**dict(zip(by, cast(tuple[object, ...], keys), strict=True)), **entries(group)} for keys, group in groups]
    first: dict[tuple[object, ...], int] = {}
    return pd.DataFrame(sorted(rows, key=lambda row: first.setdefault(tuple(row[name] for name in METHOD), len(first))))


def _diagnosis_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the share of right classes, if the true class is known.

    One row for each method and condition: counts, share of right classes [%], and the median ratio of the best
    probability to the runner-up's [dimensionless].
    """

    def entries(group: pd.DataFrame) -> dict[str, object]:
        right = group["found_condition"] == group["condition"]
        shares = {"right": int(right.sum()), "right_percent": 100.0 * float(right.mean())}
        return {"cases": len(group), **shares, "median_margin": float(group["margin"].median())}

    return _row_per_group(_classified_cases(frame), [*METHOD, "condition"], entries)


def _confusion_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Count which class was found for which true class, over all methods.

    One row for each true condition, one column for each found condition [count]; empty if no true class is known.
    """
    known = _classified_cases(frame)
    known = known[known["found_condition"].notna()]
    if not len(known):
        return pd.DataFrame()
    true, found = known["condition"].tolist(), known["found_condition"].tolist()
    names = dict.fromkeys((*true, *found))
    return confusion_matrix(true, found, CONDITIONS if set(names) <= set(CONDITIONS) else names)


def _classified_cases(frame: pd.DataFrame) -> pd.DataFrame:
    return frame[(frame["verb"] == "diagnose") & frame["known"]]


def _class_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Count the classes that were found in logs.

    One row for each condition that was found, or ``none``: number of logs, and share [%].
    """
    logs = frame[frame["file"].notna() & (frame["verb"] == "diagnose")]
    counts = logs["found_condition"].fillna("none").value_counts()
    names = [
        name for name in dict.fromkeys((*CONDITIONS, *sorted(set(counts.index) - {"none"}), "none")) if name in counts
    ]
    shares = [100.0 * int(counts[name]) / len(logs) for name in names]
    return pd.DataFrame({"class": names, "logs": [int(counts[name]) for name in names], "percent": shares})
