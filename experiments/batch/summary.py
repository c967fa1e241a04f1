"""What a store says, as tables: computed from its rows alone."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import pyarrow as pa

from faults.conditions import CONDITIONS
from faults.scores import confusion_matrix

METHOD = ["plant", "drive", "sensors", "verb", "form", "method", "pressure"]
"""What tells one way of doing it from another."""

OUTCOME_NAMES = ("ok", "not_observable", "mismatch", "diverged", "failed")

NEAR_PERCENT = 3.0
"""An estimate within this of the truth counts as near [%]."""

NORMAL_95 = 1.959963984540054

MOST_LISTED = 200
"""Most rows of a table that lists cases one by one on a page; its CSV holds all."""


def frame_of(rows: pa.Table) -> pd.DataFrame:
    """Return a store's rows as a data frame whose conditions have a name throughout.

    Parameters
    ----------
    rows : pyarrow.Table
        Rows of a store.

    Returns
    -------
    pandas.DataFrame
        One row a case. A condition is its name, its severities where it has no name, or ``unknown``.
    """
    frame = rows.to_pandas()
    free = frame["condition"].isna() & frame["leakage_severity"].notna()
    named = frame["condition"].fillna("unknown").astype(object)
    pairs = zip(frame.loc[free, "leakage_severity"], frame.loc[free, "friction_severity"], strict=True)
    named[free] = [f"leakage {leakage:g}, friction {friction:g}" for leakage, friction in pairs]
    for name in METHOD:
        frame[name] = frame[name].astype(object).where(frame[name].notna(), "")
    return frame.assign(condition=named)


def summary_tables(frame: pd.DataFrame) -> Mapping[str, pd.DataFrame]:
    """Return the tables of a batch study.

    Parameters
    ----------
    frame : pandas.DataFrame
        From `frame_of`.

    Returns
    -------
    Mapping[str, pandas.DataFrame]
        By name, those that the rows have something for: ``outcomes``, ``bulk modulus``, ``diagnosis``, ``confusion``,
        ``classes``, ``logs``, ``failures``.
    """
    tables = {
        "outcomes": outcome_table(frame),
        "bulk modulus": bulk_modulus_table(frame),
        "diagnosis": diagnosis_table(frame),
        "confusion": confusion_table(frame),
        "classes": class_table(frame),
        "logs": log_table(frame),
        "failures": failure_table(frame),
    }
    return {name: table for name, table in tables.items() if len(table)}


def outcome_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Count outcomes.

    Parameters
    ----------
    frame : pandas.DataFrame
        From `frame_of`.

    Returns
    -------
    pandas.DataFrame
        One row a way of doing it: counts of cases, and of each outcome.
    """
    rows: list[dict[str, object]] = []
    for keys, group in frame.groupby(METHOD, sort=False):
        counts = group["outcome"].value_counts()
        entries = {name: int(counts.get(name, 0)) for name in OUTCOME_NAMES}
        rows.append({**dict(zip(METHOD, keys, strict=True)), "cases": len(group), **entries})
    return pd.DataFrame(rows)


def bulk_modulus_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Return how far estimates lie from a truth that is known.

    Parameters
    ----------
    frame : pandas.DataFrame
        From `frame_of`.

    Returns
    -------
    pandas.DataFrame
        One row a way of doing it and condition: count of cases and of estimates, errors [%], share within
        `NEAR_PERCENT` and share of 95 % intervals that cover the truth [%].
    """
    known = frame[frame["verb"].isin(["filter", "estimate"]) & frame["true_bulk_modulus_pa"].notna()]
    rows: list[dict[str, object]] = []
    for keys, group in known.groupby([*METHOD, "condition"], sort=False):
        found = group[group["error_percent"].notna()]
        error = found["error_percent"].to_numpy()
        miss = (found["bulk_modulus_pa"] - found["true_bulk_modulus_pa"]).abs()
        covered = miss <= NORMAL_95 * found["bulk_modulus_std_pa"]
        entries = {"cases": len(group), "estimates": len(found)}
        entries |= dict(zip(("low_percent", "median_percent", "high_percent"), _spread(error), strict=True))
        entries |= {
            "rms_percent": float(np.sqrt(np.mean(error**2))) if len(error) else None,
            "near_percent": 100.0 * float(np.mean(np.abs(error) <= NEAR_PERCENT)) if len(error) else None,
            "covered_percent": 100.0 * float(covered.mean()) if len(error) else None,
        }
        rows.append({**dict(zip([*METHOD, "condition"], keys, strict=True)), **entries})
    return _by_way(rows)


def _by_way(rows: list[dict[str, object]]) -> pd.DataFrame:
    """Return rows with each way of doing it in one block, in the order of first appearance."""
    first: dict[tuple[object, ...], int] = {}
    return pd.DataFrame(sorted(rows, key=lambda row: first.setdefault(tuple(row[name] for name in METHOD), len(first))))


def _spread(error: np.ndarray) -> Sequence[float | None]:
    if not len(error):
        return (None, None, None)
    return [float(value) for value in np.quantile(error, [0.05, 0.5, 0.95])]


def diagnosis_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Return how often the class is right, where it is known.

    Parameters
    ----------
    frame : pandas.DataFrame
        From `frame_of`.

    Returns
    -------
    pandas.DataFrame
        One row a way of doing it and condition: counts, share that is right [%], and the ratio of the best probability
        to the runner-up's, at the median [dimensionless].
    """
    rows: list[dict[str, object]] = []
    for keys, group in _classified(frame).groupby([*METHOD, "condition"], sort=False):
        right = group["found_condition"] == group["condition"]
        entries = {"cases": len(group), "right": int(right.sum()), "right_percent": 100.0 * float(right.mean())}
        entries["median_margin"] = float(group["margin"].median())
        rows.append({**dict(zip([*METHOD, "condition"], keys, strict=True)), **entries})
    return _by_way(rows)


def confusion_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Count which class was found for which, over all ways of doing it.

    Parameters
    ----------
    frame : pandas.DataFrame
        From `frame_of`.

    Returns
    -------
    pandas.DataFrame
        A row for each true condition, a column for each found one [count]; empty where no class is known.
    """
    known = _classified(frame)
    known = known[known["found_condition"].notna()]
    if not len(known):
        return pd.DataFrame()
    return confusion_matrix(known["condition"].tolist(), known["found_condition"].tolist())


def _classified(frame: pd.DataFrame) -> pd.DataFrame:
    return frame[(frame["verb"] == "diagnose") & frame["condition"].isin(list(CONDITIONS))]


def class_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Count the classes that were found in logs.

    Parameters
    ----------
    frame : pandas.DataFrame
        From `frame_of`.

    Returns
    -------
    pandas.DataFrame
        One row a condition that was found, or ``none``: count of logs, and share [%].
    """
    logs = frame[(frame["plant"] == "log") & (frame["verb"] == "diagnose")]
    counts = logs["found_condition"].fillna("none").value_counts()
    names = [name for name in (*CONDITIONS, "none") if name in counts]
    shares = [100.0 * int(counts[name]) / len(logs) for name in names]
    return pd.DataFrame({"class": names, "logs": [int(counts[name]) for name in names], "percent": shares})


def log_table(frame: pd.DataFrame) -> pd.DataFrame:
    """List logs with what was found in them.

    Parameters
    ----------
    frame : pandas.DataFrame
        From `frame_of`.

    Returns
    -------
    pandas.DataFrame
        One row a log and verb.
    """
    names = ["file", "verb", "outcome", "found_condition", "runner_up", "margin", "bulk_modulus_pa"]
    names += ["bulk_modulus_std_pa", "trusted", "reason", "warnings"]
    return frame.loc[frame["plant"] == "log", names].reset_index(drop=True)


def failure_table(frame: pd.DataFrame) -> pd.DataFrame:
    """List cases that failed.

    Parameters
    ----------
    frame : pandas.DataFrame
        From `frame_of`.

    Returns
    -------
    pandas.DataFrame
        One row a case, with its reason and its key.
    """
    names = ["plant", "file", "drive", "condition", "seed", "verb", "form", "method", "start_pa", "reason", "key"]
    return frame.loc[frame["outcome"] == "failed", names].reset_index(drop=True)
