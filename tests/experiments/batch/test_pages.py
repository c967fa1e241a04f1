"""Cells of a batch's page: quantities of another actuator in words, and a dash for a missing value."""

import json
import re

import numpy as np
import pandas as pd
import pyarrow as pa

from experiments.batch.pages import _or_dash, _quantities, _times, one_row_a_log, render_batch_report
from experiments.batch.rows import SCHEMA
from experiments.batch.standing import logs_by_standing, standing_in_words
from experiments.batch.summary import frame_of, summary_tables
from experiments.page.numbers import MISSING
from tests.experiments.fleet.conftest import store_row


def test_quantities_are_listed_with_their_intervals_and_those_without_a_value_are_omitted() -> None:
    entries = {
        "spring_stiffness": {"value": 1e4, "unit": "N/m", "ci95": [9e3, 1.1e4]},
        "gain": {"value": 2.0, "unit": "1", "ci95": None},
        "leakage": {"value": None, "unit": "L/min", "ci95": None},
    }
    first, second = _quantities(json.dumps(entries)).split("; ")
    assert first.startswith("spring stiffness ")
    assert "N/m (" in first
    assert " to " in first
    assert second.rstrip() == "gain 2.000"


def test_a_missing_entry_is_shown_as_a_dash() -> None:
    assert _quantities(None) == _quantities(np.nan) == MISSING
    assert [_or_dash(one) for one in (None, np.nan, "", "normal")] == [MISSING] * 3 + ["normal"]


def test_the_report_rounds_quantities_and_shows_logs_without_their_folder() -> None:
    noise = {"value": 1.1e-15, "unit": "%", "ci95": [-0.025, 0.027], "healthy": 0.0}
    found = {
        "velocity_lost": noise,
        "bulk_modulus": {**noise, "value": 2.0673e8, "unit": "Pa", "ci95": [2.061e8, 2.073e8]},
    }
    rows = [
        {"plant": "log", "file": f"/home/ann/logs/{name}.csv", "verb": "diagnose", "outcome": "ok"} for name in "ab"
    ]
    rows[0]["quantities"] = json.dumps(found)
    table = frame_of(pa.Table.from_pylist(rows, schema=SCHEMA))
    manifest = dict.fromkeys(("study", "question", "source", "config_hash", "rig", "python", "machine", "commit"), "x")
    page = render_batch_report({**manifest, "cases": 2, "versions": {}}, summary_tables(table), {}, 2)
    assert "velocity lost 0.000 %; bulk modulus 206.7 MPa" in page.replace("\N{NO-BREAK SPACE}", " ")
    assert "/home/ann" not in page
    assert '<td class="name" data-head="log">a.csv</td>' in page
    page = render_batch_report(
        {**manifest, "cases": 2, "versions": {}}, summary_tables(table), {}, 2, {"/home/ann/logs/b.csv": "pages/b.html"}
    )
    assert '<td class="name" data-head="log"><a href="pages/b.html">b.csv</a></td>' in page
    assert page.count("pages/") == 1


def test_two_verbs_on_one_log_share_a_row() -> None:
    table = pd.DataFrame(
        {
            "file": ["a.csv", "b.csv", "a.csv", "b.csv", "c.csv", "c.csv", None, None],
            "verb": ["diagnose", "diagnose", "estimate", "estimate", "estimate", "estimate", "diagnose", "estimate"],
            "outcome": ["ok", "failed", "mismatch", "failed", "ok", "ok", "ok", "ok"],
            "bulk_modulus_pa": [np.nan, np.nan, 2e8, np.nan, 1e8, 3e8, np.nan, np.nan],
            "reason": [None, "no columns", None, "no columns", None, None, None, None],
        }
    )
    made = one_row_a_log(table)
    assert made["verb"].tolist() == ["diagnose, estimate"] * 2 + ["estimate"] * 2 + ["diagnose", "estimate"]
    assert made["outcome"].tolist()[:2] == ["diagnose: ok; estimate: mismatch", "failed"]
    assert made["bulk_modulus_pa"].tolist()[0] == 2e8
    assert made["bulk_modulus_pa"].tolist()[2:4] == [1e8, 3e8]  # two methods of one verb keep a row each
    assert made["reason"].tolist()[1] == "no columns"


def test_a_ratio_of_probabilities_over_1000_is_shown_as_over_1000() -> None:
    assert [_times(one).text for one in (None, 1.0, 113.2, 1.13e5)] == [MISSING, "1.00", "113", "over 1000"]


def test_the_report_says_first_how_many_cases_failed() -> None:
    rows = [{"plant": "log", "file": "a.csv", "verb": "diagnose", "outcome": one} for one in ("ok", "failed", "failed")]
    rows[0]["found_condition"] = "minor_leakage"
    tables = summary_tables(frame_of(pa.Table.from_pylist(rows, schema=SCHEMA)))
    manifest = dict.fromkeys(("study", "question", "source", "config_hash", "rig", "python", "machine", "commit"), "x")
    page = render_batch_report({**manifest, "cases": 3, "versions": {}}, tables, {}, 3)
    assert "All 3 cases are done; 2 failed." in " ".join(page.split())
    assert "Found in the logs: minor leakage in 1, no class in 2." in page


def test_a_report_of_logs_opens_with_the_worst_and_lists_them_first() -> None:
    rows = [store_row(f"/home/ann/{name}.csv", leakage) for name, leakage in (("a", 1.0), ("b", 5.0), ("c", 3.1))]
    rows.append({**store_row("/home/ann/d.csv", 1.0), "outcome": "failed", "quantities": None, "found_condition": None})
    table = pa.Table.from_pylist([{"plant": "log", **row} for row in rows], schema=SCHEMA)
    worst = logs_by_standing(table)
    others = "1 probably past one, 1 within limits, 1 could not be read"
    said = (f"1 of 4 logs is past a limit; {others}.", "Start with b.csv, c.csv.")
    assert standing_in_words(worst) == said
    manifest = dict.fromkeys(("study", "question", "source", "config_hash", "rig", "python", "machine", "commit"), "x")
    tables = summary_tables(frame_of(table))
    page = render_batch_report({**manifest, "cases": 4, "versions": {}}, tables, {}, 4, worst=worst)
    assert f"<h1>{said[0]}</h1>" in page
    assert f'<p class="answer">{said[1]}</p>' in page
    assert "Classes found in the logs" not in page  # the line at the top already says it
    assert re.findall(r'data-head="log">(.)\.csv', page) == ["b", "c", "a", "d"]
    assert page.index('<section id="logs">') < page.index('<section id="outcomes">')
    assert 'class="fleet-over" data-head="state">past a limit<' in page
    assert "200 % of the limit" in page.replace("\N{NO-BREAK SPACE}", " ")
