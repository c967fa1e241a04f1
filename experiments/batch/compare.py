"""Compares two studies case by case: what improved, what got worse, and whether chance explains the difference."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from experiments.page.numbers import MINUS
from plant.errors import HydrostateError

SERIES_COLUMNS = ["plant", "file", "drive", "sensors", "condition", "seed", "duration_s", "sample_time_s"]
"""Columns that identify a series. Cases of one series share its noise, so the bootstrap draws whole series."""

METHOD_COLUMNS = ["form", "method", "pressure", "told", "start_pa", "start_std_pa"]

RESAMPLES = 2000
"""Bootstrap draws of series for an interval [count]: fifty of them lie beyond each end of a 95 % interval."""

BLOCK = 200
"""Number of draws held in memory at a time [count]."""

MEASURES = (
    ("error of bulk modulus", "%", "size_percent", -1.0),
    ("right class", "%", "right_percent", 1.0),
    ("cases with an answer", "%", "answered_percent", 1.0),
)
"""The measures to compare: name, unit, column, and the sign: 1 if more is better, -1 if less is better."""


def compare_studies(first: pd.DataFrame, second: pd.DataFrame, seed: int = 2024) -> pd.DataFrame:
    """Compare the cases that two studies have in common.

    If each study uses a single method and the two methods differ (for example two filters), the methods are compared
    and all other settings must agree. Cases are paired, so that what they share cancels; intervals are percentiles of a
    bootstrap that draws whole series (Efron and Tibshirani 1993, chapter 13).

    Parameters
    ----------
    first, second : pandas.DataFrame
        Rows of the two studies, from `experiments.batch.summary.frame_of`.

    Returns
    -------
    pandas.DataFrame
        One row for each verb, measure and condition, with ``all`` for all conditions together: pairs, series, the two
        means [%], their difference (second minus first) with its 95 % interval [%], and ``better``, ``worse`` or ``no
        difference shown``.

    Raises
    ------
    HydrostateError
        If they have no case in common.
    """
    rng = np.random.default_rng(seed)
    rows: list[dict[str, object]] = []
    for verb in dict.fromkeys(first["verb"]):
        pairs, changed = _paired_cases(first[first["verb"] == verb], second[second["verb"] == verb])
        groups = [("all", pairs), *((str(name), group) for name, group in pairs.groupby("condition", sort=False))]
        for words, unit, column, better in MEASURES:
            for condition, group in groups if len(pairs) else ():
                both = group[group[f"{column}_a"].notna() & group[f"{column}_b"].notna()]
                if len(both):
                    head = {"verb": verb, "changed": changed, "measure": words, "unit": unit, "condition": condition}
                    rows.append({**head, **_difference(both, column, better, rng)})
    if not rows:
        raise HydrostateError(
            "the two studies must have cases in common: the same series, estimated or diagnosed in the same way"
        )
    return pd.DataFrame(rows)


def _paired_cases(first: pd.DataFrame, second: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Return cases side by side, and a description of what changed between the studies."""
    changed: list[str] = []
    on = list(SERIES_COLUMNS)
    for name in (*METHOD_COLUMNS, *SERIES_COLUMNS[:1], "drive", "sensors"):
        here, there = (list(frame[name].map(str).unique()) for frame in (first, second))
        if len(here) == len(there) == 1 and here != there:
            changed.append(f"{name}: {here[0] or 'none'} to {there[0] or 'none'}")
            on = [one for one in on if one != name]
        elif name not in on:
            on.append(name)
    columns = [column for _, _, column, _ in MEASURES]
    left, right = (_with_gaps_filled(_with_measures(frame)[[*on, *columns]], on) for frame in (first, second))
    return left.merge(right, on=on, suffixes=("_a", "_b")), "; ".join(changed)


def _with_gaps_filled(frame: pd.DataFrame, on: list[str]) -> pd.DataFrame:
    """Return cases with gaps filled in the matching columns, so that an entry missing from both counts as equal."""
    filled = {name: frame[name].astype(object).where(frame[name].notna(), "") for name in on}
    return frame.assign(**filled).drop_duplicates(on)


def _with_measures(frame: pd.DataFrame) -> pd.DataFrame:
    right = (frame["found_condition"] == frame["condition"]).astype(float)
    known = (frame["verb"] == "diagnose") & (frame["condition"] != "unknown")
    return frame.assign(
        size_percent=frame["error_percent"].abs(),
        right_percent=(100.0 * right).where(known),
        answered_percent=100.0 * (frame["outcome"] == "ok").astype(float),
    )


def _difference(pairs: pd.DataFrame, column: str, better: float, rng: np.random.Generator) -> dict[str, object]:
    first, second = (pairs[f"{column}_{side}"] for side in "ab")
    drawn = [name for name in SERIES_COLUMNS if name in pairs]
    groups = (second - first).groupby([pairs[name] for name in drawn], sort=False)
    low, high = _interval(groups.sum().to_numpy(), groups.size().to_numpy(), rng)
    verdict = "no difference shown"
    if low is not None and high is not None and (low > 0.0 or high < 0.0):
        verdict = "better" if better * low > 0.0 else "worse"
    return {
        "cases": len(pairs),
        "series": len(groups),
        "first": float(first.mean()),
        "second": float(second.mean()),
        "difference": float((second - first).mean()),
        "low": low,
        "high": high,
        "verdict": verdict,
    }


def _interval(sums: np.ndarray, counts: np.ndarray, rng: np.random.Generator) -> tuple[float | None, float | None]:
    """Return the 95 % bootstrap interval of a mean, drawing whole series; no interval for fewer than five series."""
    n = len(sums)
    if n < FEWEST_SERIES:
        return None, None
    means: list[np.ndarray] = []
    for begin in range(0, RESAMPLES, BLOCK):
        weights = rng.multinomial(n, np.full(n, 1.0 / n), size=min(BLOCK, RESAMPLES - begin))
        means.append((weights @ sums) / (weights @ counts))
    low, high = np.quantile(np.concatenate(means), [0.025, 0.975])
    return float(low), float(high)


FEWEST_SERIES = 5
"""Minimum number of series for an interval: a bootstrap of fewer is not informative."""


def in_sentences(table: pd.DataFrame, names: Sequence[str]) -> list[str]:
    """Describe what improved and what got worse.

    Parameters
    ----------
    table : pandas.DataFrame
        From `compare_studies`.
    names : sequence of str
        Names of the first and the second study.

    Returns
    -------
    list of str
        One sentence for each verb and measure, over all conditions.
    """

    def signed(value: float) -> str:
        return "0" if value == 0.0 else f"{value:+.3g}".replace("-", MINUS)

    sentences: list[str] = []
    for row in table[table["condition"] == "all"].to_dict("records"):
        change = f" ({row['changed']})" if row["changed"] else ""
        interval = ""
        if row["low"] is not None and not pd.isna(row["low"]):
            interval = f", 95 % interval {signed(row['low'])} to {signed(row['high'])}"
        sentences.append(
            f"{row['verb']}{change}, {row['measure']}: {row['first']:.3g} {row['unit']} in {names[0]}, "
            f"{row['second']:.3g} {row['unit']} in {names[1]}, difference {signed(row['difference'])}{interval}: "
            f"{row['verdict']}"
        )
    return sentences
