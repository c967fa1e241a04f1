"""HTML pages of a batch study and of a comparison of two: one file each, from stored rows alone."""

import json
from collections.abc import Mapping, Sequence
from functools import partial
from posixpath import commonpath
from types import MappingProxyType
from typing import Any

import pandas as pd
from markupsafe import Markup

from experiments.batch.compare import in_sentences
from experiments.batch.figures import method_in_words
from experiments.batch.standing import standing_in_words, with_standing
from experiments.batch.summary import MOST_LISTED, NEAR_PERCENT
from experiments.fleet.rows import STATES, LogRow
from experiments.page.frames import Tables
from experiments.page.names_shown import QUANTITY_NAMES
from experiments.page.numbers import MISSING, decimals_of, fixed, number, pretty_unit, shop_unit
from experiments.page.render import render_page
from experiments.page.tables import Cell, Column, Row, decimals, name_in_words, right_aligned
from experiments.page.words import condition_in_words

MOST_TIMES = 1000.0
"""Ratio of two probabilities beyond which its digits are meaningless [dimensionless]."""


def _or_dash(value: Any) -> str:
    return MISSING if pd.isna(value) or value == "" else str(value)


def _quantities(text: Any) -> str:
    """Return the findings; severities of a log without their intervals, which are in the CSV file, others with them."""
    if pd.isna(text):
        return MISSING
    told = {name: one for name, one in json.loads(text).items() if one["value"] is not None}
    return "; ".join(f"{QUANTITY_NAMES.get(name, name.replace('_', ' '))} {_amount(one)}" for name, one in told.items())


def _amount(one: Mapping[str, Any]) -> str:
    scale, unit = shop_unit(one["unit"])
    ends = [scale * end for end in one["ci95"] or () if end is not None]
    if "healthy" in one and len(ends) == 2:
        return f"{fixed(scale * one['value'], decimals_of(*ends))} {pretty_unit(unit)}"
    told = f"{number(scale * one['value'])} {pretty_unit(unit).removeprefix('1')}"
    return f"{told} ({number(ends[0])} to {number(ends[1])})" if len(ends) == 2 else told


def _log(row: Row) -> Cell:
    """Return the name of a log, linked to its page if there is one."""
    name = _or_dash(row["file"])
    return Cell(Markup('<a href="{}">{}</a>').format(row["page"], name) if row["page"] else name, "name")


def _state(name: Any) -> Cell:
    """Return how near a log is to a limit, in the words of the fleet report."""
    return Cell(MISSING) if pd.isna(name) else Cell(STATES[name], f"fleet-{name}")


def _times(margin: float | None) -> Cell:
    """Return a ratio of probabilities in digits, up to `MOST_TIMES`."""
    if margin is None or not margin > MOST_TIMES:
        return right_aligned(number(margin, 3))
    return right_aligned(f"over {MOST_TIMES:.0f}")


_text = partial(Column, words=_or_dash)
_condition = partial(Column, words=lambda value: condition_in_words(_or_dash(value)))
_percent = partial(Column, unit="%", words=decimals(2))
_percent_column = partial(Column, unit="%", words=decimals(0))

COLUMNS: Mapping[str, Sequence[Column]] = {
    "outcomes": (
        _text("way", "how"),
        *(Column(name) for name in ("cases", "ok", "not_observable", "mismatch", "diverged", "failed")),
    ),
    "bulk modulus": (
        _text("way", "how"),
        _condition("condition"),
        Column("estimates"),
        _percent("low_percent", "5 %"),
        _percent("median_percent", "median error"),
        _percent("high_percent", "95 %"),
        _percent("rms_percent", "RMS error"),
        _percent_column("near_percent", f"within {NEAR_PERCENT:g} %"),
        _percent_column("covered_percent", "interval covers"),
    ),
    "diagnosis": (
        _text("way", "how"),
        _condition("condition", "true class"),
        Column("cases"),
        _percent_column("right_percent", "right"),
        Column("median_margin", "times as probable as runner-up, median", digits=3),
    ),
    "classes": (_condition("class"), Column("logs"), Column("percent", "of logs", "%", words=decimals(1))),
    "logs": (
        Column("file", "log", of_row=_log),
        Column("state", words=_state),
        _text("worst"),
        _text("verb", "asked"),
        Column("outcome", words=lambda value: name_in_words(_or_dash(value))),
        _condition("found_condition", "class"),
        _condition("runner_up", "runner-up"),
        Column("margin", "times as probable as runner-up", words=_times),
        Column("bulk_modulus_pa"),
        Column("bulk_modulus_std_pa", "std", digits=2),
        Column("quantities", "found", words=_quantities),
        _text("reason", "why, or what speaks against it"),
    ),
    "failures": (
        *(_text("plant"), _text("file", "log"), _text("condition"), _text("seed"), _text("verb", "asked")),
        _text("reason"),
    ),
}

LISTED = ("logs", "failures")
"""Tables that list cases one by one."""

VERDICT_TONES: Mapping[str, str] = {"better": "good", "worse": "bad"}


def render_batch_report(
    manifest: Mapping[str, Any],
    tables: Tables,
    files: Mapping[str, bytes],
    done: int,
    pages: Mapping[str, str] = MappingProxyType({}),
    worst: Sequence[LogRow] = (),
) -> str:
    """Return the report of a batch study as one HTML page.

    Parameters
    ----------
    manifest : Mapping[str, Any]
        Manifest of the study's store.
    tables : Mapping[str, pandas.DataFrame]
        From `experiments.batch.summary.summary_tables`.
    files : Mapping[str, bytes]
        Figures of the study, by path.
    done : int
        Number of finished cases [count].
    pages : Mapping[str, str]
        Path of each log's own page, relative to the report.
    worst : sequence of LogRow
        Diagnosed logs, the worst first, from `experiments.batch.standing.logs_by_standing`.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    listed = {name: one_row_a_log(table) if name in LISTED else table for name, table in tables.items()}
    if "logs" in listed:
        listed["logs"] = with_standing(listed["logs"], worst)
    shown = {name: _listed_rows(listed[name], pages) for name in COLUMNS if name in listed}
    logs_alone = "logs" in shown and manifest["cases"] == len(tables["logs"]) == done
    if logs_alone:
        shown["logs"] = _without_repetition(shown["logs"])
    columns = {
        name: [column for column in COLUMNS[name] if table[column.source].notna().any()]
        for name, table in shown.items()
    }
    facts = {
        "manifest": manifest,
        "done": done,
        "shown": shown,
        "linked": len(pages),
        "rows": {name: len(table) for name, table in listed.items()},
        "failed": int(tables["outcomes"]["failed"].sum()) if "outcomes" in tables else 0,
        "most_listed": MOST_LISTED,
        "standing": standing_in_words(worst),
        "logs_alone": logs_alone,
        "found": _classes_in_words(tables["classes"]) if "classes" in tables else "",
        "pictures": {path.removeprefix("figures/").removesuffix(".svg") for path in files},
        **shown,
    }
    return render_page("batch/report.html", facts, columns, files)


def _without_repetition(logs: pd.DataFrame) -> pd.DataFrame:
    """Return the table of logs without a constant verb or what the severities replace; the CSV file has all."""
    empty: dict[str, None] = {"verb": None} if logs["verb"].nunique() == 1 else {}
    if logs["quantities"].notna().any():
        empty |= dict.fromkeys(("runner_up", "margin", "bulk_modulus_pa", "bulk_modulus_std_pa"))
    return logs.assign(**empty)


def _classes_in_words(classes: pd.DataFrame) -> str:
    """Return the number of logs per class, in one line."""
    counts = zip(classes["class"], classes["logs"], strict=True)
    return ", ".join(
        f"{'no class' if name == 'none' else condition_in_words(name)} in {count}" for name, count in counts
    )


def one_row_a_log(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table with one row for each log, even if several verbs analysed it, in the order of first appearance.

    Parameters
    ----------
    table : pandas.DataFrame
        Table with ``file`` and ``verb``; a log that the same verb analysed twice keeps its rows, as do cases without a
        file.

    Returns
    -------
    pandas.DataFrame
        Each cell has the value that all verbs share, or the value of each verb.
    """
    if not {"file", "verb"} <= set(table) or not len(table):
        return table
    rows: list[Mapping[Any, Any]] = []
    for _, group in table.groupby(table["file"].fillna(table.index.to_series().astype(str)), sort=False):
        each = group.to_dict("records")
        once = len(each) > 1 and len({one["verb"] for one in each}) == len(each)
        merged = {name: _merged_cell(str(name), each) for name in table} if once else {}
        rows += [merged] if once and not any(isinstance(one, _DifferingNumbers) for one in merged.values()) else each
    return pd.DataFrame(rows, columns=table.columns)


class _DifferingNumbers:
    """Marks numbers that differ between verbs and so do not fit in one cell."""


def _merged_cell(name: str, rows: Sequence[Mapping[Any, Any]]) -> Any:
    """Return the text of a column: once, or for each verb if verbs differ."""
    told = {row["verb"]: row[name] for row in rows if not pd.isna(row[name])}
    distinct = list(dict.fromkeys(told.values()))
    if name == "verb":
        return ", ".join(told)
    if len(distinct) < 2:
        return distinct[0] if distinct else None
    if name in ("key", "trusted"):
        return None
    if not all(isinstance(one, str) for one in distinct):
        return _DifferingNumbers()
    return "; ".join(f"{verb}: {one}" for verb, one in told.items())


def _listed_rows(table: pd.DataFrame, pages: Mapping[str, str]) -> pd.DataFrame:
    """Return the rows listed on the page, with the method in words and the path of each log's page."""
    head = table.head(MOST_LISTED)
    if "file" in head:
        files = head["file"].tolist()
        head = head.assign(file=below_one_folder(files), page=[pages.get(file, "") for file in files])
    return head.assign(way=[method_in_words(row) for row in head.to_dict("records")]) if "pressure" in head else head


def below_one_folder(files: Sequence[Any]) -> list[Any]:
    """Return paths without their common folder, which is specific to one machine; keep entries that are not paths.

    Examples
    --------
    >>> below_one_folder(["/home/ann/logs/a/1.csv", "/home/ann/logs/b/2.csv", None])
    ['a/1.csv', 'b/2.csv', None]
    """
    folders = [file.rpartition("/")[0] for file in files if isinstance(file, str)]
    shared = (
        f"{commonpath(folders)}/" if folders and all(folders) and len({one[:1] == "/" for one in folders}) == 1 else ""
    )
    return [file.removeprefix(shared) if isinstance(file, str) else file for file in files]


def _compared(name: str, header: str | None = None) -> Column:
    """Return a column of a comparison, with the decimals that the interval of the row's difference has."""

    def cell(row: Row) -> Cell:
        ends = [row["low"], row["high"]]
        if any(end is None or end != end for end in ends):
            ends = sorted((row["first"], row["second"]))
        return right_aligned(fixed(row[name], decimals_of(*ends, most=6)))

    return Column(name, header or name, "%", of_row=cell)


def render_comparison(table: pd.DataFrame, names: Sequence[str]) -> str:
    """Return the comparison of two studies as one HTML page.

    Parameters
    ----------
    table : pandas.DataFrame
        From `experiments.batch.compare.compare_studies`.
    names : sequence of str
        Names of the first and the second study.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    columns = (
        *(_text("verb", "asked"), _text("measure"), _condition("condition"), "cases", "series"),
        *(_compared("first", names[0]), _compared("second", names[1])),
        *(_compared("difference"), _compared("low", "95 % from"), _compared("high", "to")),
        Column("verdict", words=lambda said: Cell(said, VERDICT_TONES.get(said, "none"))),
    )
    facts = {"first": names[0], "second": names[1], "sentences": in_sentences(table, names), "comparison": table}
    return render_page("batch/comparison.html", facts, {"comparison": columns}, {})
