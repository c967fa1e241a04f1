"""The report of a batch study, and that of two beside each other: one HTML file each, from stored rows alone."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd
from markupsafe import Markup

from experiments.batch.compare import in_sentences
from experiments.batch.summary import MOST_LISTED, NEAR_PERCENT
from experiments.figures.batch import BATCH_FIGURES, way_in_words
from experiments.report.sectioned import Section, render_sections
from experiments.report.tables import MISSING, Cell, Column, fixed, html_table
from experiments.report.words import in_words


def _percent(header: str, source: str, decimals: int = 2) -> Column:
    return Column(source, header, "%", words=lambda value: fixed(_or_none(value), decimals))


def _or_none(value: Any) -> float | None:
    return None if pd.isna(value) else float(value)


def _text(source: str, header: str) -> Column:
    return Column(source, header, words=lambda value: MISSING if pd.isna(value) or value == "" else str(value))


def _condition(source: str, header: str) -> Column:
    return Column(source, header, words=lambda value: MISSING if pd.isna(value) else in_words(str(value)))


def _count(source: str, header: str) -> Column:
    return Column(source, header, words=lambda value: str(int(value)))


COLUMNS: Mapping[str, tuple[tuple[Column, ...], str]] = {
    "outcomes": (
        (
            _text("way", "how"),
            _count("cases", "cases"),
            _count("ok", "ok"),
            _count("not_observable", "not observable"),
            _count("mismatch", "mismatch"),
            _count("diverged", "diverged"),
            _count("failed", "failed"),
        ),
        "What came of the cases.",
    ),
    "bulk modulus": (
        (
            _text("way", "how"),
            _condition("condition", "condition"),
            _count("estimates", "estimates"),
            _percent("5 %", "low_percent"),
            _percent("median error", "median_percent"),
            _percent("95 %", "high_percent"),
            _percent("RMS error", "rms_percent"),
            _percent(f"within {NEAR_PERCENT:g} %", "near_percent", 0),
            _percent("interval covers", "covered_percent", 0),
        ),
        "Error of bulk modulus against the value that was simulated. The last column is how many of the stated 95 % "
        "intervals hold it.",
    ),
    "diagnosis": (
        (
            _text("way", "how"),
            _condition("condition", "true class"),
            _count("cases", "cases"),
            _percent("right", "right_percent", 0),
            Column("median_margin", "times as probable as runner-up, median", digits=3),
        ),
        "How often the class is right.",
    ),
    "classes": (
        (_condition("class", "class"), _count("logs", "logs"), _percent("of logs", "percent", 1)),
        "Classes found.",
    ),
    "logs": (
        (
            _text("file", "log"),
            _text("verb", "asked"),
            _text("outcome", "outcome"),
            _condition("found_condition", "class"),
            _condition("runner_up", "runner-up"),
            Column("margin", "best is so many times as probable", digits=3),
            Column("bulk_modulus_pa", "bulk modulus", "MPa", 1e-6),
            Column("bulk_modulus_std_pa", "std", "MPa", 1e-6, 2),
            _text("reason", "why, or what speaks against it"),
        ),
        "Logs, one by one.",
    ),
    "failures": (
        (
            _text("plant", "plant"),
            _text("file", "log"),
            _text("condition", "condition"),
            _text("seed", "seed"),
            _text("verb", "asked"),
            _text("reason", "reason"),
        ),
        "Cases that failed.",
    ),
}
"""How each table is shown."""

UNDER: Mapping[str, str] = {"bulk modulus": "bulk modulus", "diagnosis": "confusion", "classes": "classes"}
"""The figure that stands above a table."""

HEADINGS: Mapping[str, str] = {
    "outcomes": "Outcomes",
    "bulk modulus": "Bulk modulus",
    "diagnosis": "Diagnosis",
    "classes": "Classes found in the logs",
    "logs": "Logs",
    "failures": "Failed cases",
}


def render_batch_report(
    manifest: Mapping[str, Any], tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes], done: int
) -> str:
    """Return the report of a batch study as one HTML page.

    Parameters
    ----------
    manifest : Mapping[str, Any]
        Of its store.
    tables : Mapping[str, pandas.DataFrame]
        From `experiments.batch.summary.summary_tables`.
    figures : Mapping[str, bytes]
        SVG files, by the names of `BATCH_FIGURES`.
    done : int
        Cases in the store.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    sections = [
        Section(
            name.replace(" ", "-"),
            HEADINGS[name],
            _cut(tables[name]),
            figures.get(UNDER.get(name, "")),
            BATCH_FIGURES[UNDER[name]].caption if UNDER.get(name) in figures else "",
            [_shown(name, tables[name])],
        )
        for name in COLUMNS
        if name in tables
    ]
    sections.append(Section("again", "Run it again", _again(manifest)))
    total = manifest["cases"]
    state = (
        f"All {total} cases are done." if done == total else f"{done} of {total} cases are done; the rest is to come."
    )
    return render_sections(manifest["study"], "batch study", f"{manifest['question']} {state}".strip(), sections)


def _cut(table: pd.DataFrame) -> Sequence[str]:
    if len(table) <= MOST_LISTED:
        return ()
    return (f"The first {MOST_LISTED} of {len(table)} rows; the CSV file in the folder tables has all.",)


def _shown(name: str, table: pd.DataFrame) -> Markup:
    columns, caption = COLUMNS[name]
    shown = table.head(MOST_LISTED)
    if "way" in {column.source for column in columns}:
        shown = shown.assign(way=[way_in_words(row) for row in shown.to_dict("records")])
    return html_table(shown, [column for column in columns if shown[column.source].notna().any()], caption)


def _again(manifest: Mapping[str, Any]) -> Sequence[str]:
    versions = ", ".join(f"{name} {number}" for name, number in manifest["versions"].items())
    commit = f", commit {manifest['commit']}" if manifest["commit"] else ""
    return (
        f"Study file {manifest['source']}, hash {manifest['config_hash']}, rig {manifest['rig']}. Made with Python "
        f"{manifest['python']} on {manifest['machine']}, {versions}{commit}.",
        "Every case depends on its own content and seed alone: whatever ran beside it, in which order and on how many "
        "machines, its numbers are the same.",
    )


def render_comparison(table: pd.DataFrame, names: Sequence[str]) -> str:
    """Return the comparison of two studies as one HTML page.

    Parameters
    ----------
    table : pandas.DataFrame
        From `experiments.batch.compare.compare_studies`.
    names : sequence of str
        What the first and the second study are called.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    tones = {"better": "good", "worse": "bad"}
    columns = (
        _text("verb", "asked"),
        _text("measure", "measure"),
        _condition("condition", "condition"),
        _count("cases", "cases"),
        _count("series", "series"),
        _percent(names[0], "first"),
        _percent(names[1], "second"),
        _percent("difference", "difference"),
        _percent("95 % from", "low"),
        _percent("to", "high"),
        Column("verdict", "verdict", words=lambda said: Cell(str(said), tones.get(str(said), "none"))),
    )
    introduction = (
        f"{names[1]} against {names[0]}, on the cases that both have. Each case is set against its counterpart, and "
        "whole series are drawn for the 95 % intervals, so that what shares its noise counts as evidence once. "
        "Many conditions are compared at once: one verdict in twenty is chance."
    )
    shown = html_table(table, columns, "Difference is the second study less the first.")
    sections = [Section("verdict", "What got better, what worse", in_sentences(table, names), tables=[shown])]
    return render_sections(f"{names[0]} and {names[1]}", "comparison of two studies", introduction, sections)
