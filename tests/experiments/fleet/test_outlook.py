"""The development of an actuator: its outlook, its alarm and its page."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.eha.plain_verdict import WORK_ON_FRICTION
from experiments.fleet.actuator_page import actuator_page, segment_levels
from experiments.fleet.actuators import ActuatorRow, actuator_rows
from experiments.fleet.naming import by_pattern
from experiments.fleet.outlook import outlook_of, read_maintenance
from experiments.fleet.page import row_cells
from experiments.fleet.rows import log_rows
from experiments.fleet.to_do import what_to_do
from experiments.page.sentences import whole_dates
from experiments.page.still import DAYS
from plant.errors import HydrostateError
from tests.experiments.fleet.conftest import between, store_row


def actuator(leakages: Any, maintained: tuple[float, ...] = (), **more: Any) -> ActuatorRow:
    noise = 0.05 * np.random.default_rng(4).standard_normal(len(leakages))
    files = [f"P-1_{place}.csv" for place in range(len(leakages))]
    rows = [
        store_row(file, float(one + more_noise), **more)
        for file, one, more_noise in zip(files, leakages, noise, strict=True)
    ]
    logs = log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {})
    (row,) = actuator_rows(logs, {"P-1": maintained})
    return row


GROWING = 1.0 + 0.05 * np.arange(30)


def test_leakage_that_grows_towards_its_limit_raises_an_alarm_before_the_limit() -> None:
    row = actuator(GROWING)
    assert (row.last.state, row.state) == ("within", "alarm")
    assert row.outlook is not None
    assert row.outlook.left is not None
    assert row.outlook.left[0] < 11.0 < row.outlook.left[2]
    assert re.fullmatch(r"limit in \d+ logs \(\d+ to (\d+|more than 300)\)", row.outlook.words)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("P-1_202601{:02d}.csv", r"limit \d+ January 2026 \(\d+ to \d+ January 2026\)"),
        ("P-1_20260101_{:02d}00.csv", r"limit 2026-01-\d\d \d\d:00 \(2026-01-\d\d \d\d:00 to 2026-01-\d\d \d\d:00\)"),
        ("P-1_{}.csv", r"limit in \d+ logs \(\d+ to \d+\)"),  # names with running hours
    ],
)
def test_a_forecast_contains_the_true_crossing_and_uses_dates_if_logs_are_dated(name: str, words: str) -> None:
    files = [name.format(place + 1) for place in range(18)]
    rows = [store_row(file, 1.0 + 0.09 * place, 0.2) for place, file in enumerate(files)]
    (row,) = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {}))
    assert row.outlook is not None
    assert row.outlook.left is not None
    assert row.outlook.left[0] < 2.0 / 0.09 - 17.0 < row.outlook.left[2]
    assert re.fullmatch(words, row.outlook.words)
    page = actuator_page(row, {}).replace("\N{NO-BREAK SPACE}", " ")
    assert re.search(r"Leakage reaches its limit in about \d logs.* \(50 % interval: .*; 90 %: .*\)\.</p>", page)
    assert whole_dates(row.outlook.when(0, 4)) in page


def test_the_outlook_of_few_logs_gives_since_when_the_limit_is_passed() -> None:
    files = [f"P-1_2026070{day}.csv" for day in range(1, 7)]
    rows = [store_row(file, 1.0 if place < 4 else 3.6) for place, file in enumerate(files)]
    (row,) = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {}))
    assert row.outlook is not None
    assert row.outlook.words == "past the limit since 2026-07-05"
    undated = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_*"), {}))[0].outlook
    assert undated is not None
    assert undated.words == "past the limit for 2 logs"
    always = actuator([4.0] * 5).outlook
    assert always is not None
    assert always.words == "past the limit in every log"


@pytest.mark.parametrize(
    ("leakages", "said"),
    [
        ([1.2], "too few logs"),
        ([1.2, 1.3, 1.2], "too few logs"),
        ([4.0], "past in the only log"),
        ([4.0, 4.1], "past in every log"),
        ([1.2, 1.2, 4.0], "past since 2"),
    ],
)
def test_an_actuator_of_one_to_three_logs_says_since_when_it_is_past_its_limit(
    leakages: list[float], said: str
) -> None:
    """Before, its outlook in the table of the fleet was an empty cell."""
    assert row_cells(actuator(leakages))[5] == said


def test_constant_leakage_raises_no_alarm() -> None:
    row = actuator(np.full(30, 1.5))
    assert row.state == "within"
    assert row.outlook is not None
    assert row.outlook.words == "no certain growth"


def test_a_growing_severity_raises_the_alarm_behind_another_that_is_steadily_worse() -> None:
    """Before, only the worst severity of the last log was followed: friction nearing its limit was "within limits"."""
    files = [f"P-1_{place}.csv" for place in range(30)]
    rows: list[dict[str, Any]] = []
    for place, file in enumerate(files):
        row = dict(store_row(file, 2.6))
        force = 18.0 * place + 10.0 * float(np.sin(7.0 * place))
        ends = [force - 30.0, force + 30.0]
        friction = {"value": force, "unit": "N", "ci95": ends, "healthy": 0.0, "limit": 700.0}
        rows.append({**row, "quantities": json.dumps({**json.loads(row["quantities"]), "added_friction": friction})})
    (row,) = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {}))
    assert row.last.worst is not None
    assert (row.last.worst.name, row.last.state, row.state) == ("leakage_flow", "within", "alarm")
    assert row.deciding == "added_friction"
    cells = row_cells(row)
    assert cells[3].startswith("leakage ")
    assert re.fullmatch(r"added friction: limit in \d+ logs \(\d+ to \d+\)", cells[5]), cells[5]
    assert what_to_do(row, has_page=True) == [WORK_ON_FRICTION["minor"]]
    assert '<p class="answer">Added friction reaches its limit in about' in actuator_page(row, {})


def test_few_logs_give_no_outlook_and_only_logs_after_a_repair_count() -> None:
    assert actuator(GROWING[:3]).outlook is None
    repaired = actuator(GROWING, maintained=(27.0,)).outlook
    assert repaired is not None
    assert repaired.words == "too few logs"


def test_the_trend_line_follows_a_lasting_change_from_its_first_log() -> None:
    outlook = actuator([1.0] * 6 + [2.0] * 5).outlook
    assert outlook is not None
    # up to two logs after the change, it might be chance
    assert [trend.begin for trend in outlook.course][-5:] == [0, 0, 6, 6, 6]
    levels = np.array(segment_levels(outlook))[:, 0]
    np.testing.assert_allclose(levels, [1.0] * 6 + [2.0] * 5, atol=0.15)
    assert levels[-1] == outlook.trend.level[0]


def test_the_outlook_of_growing_leakage_gives_the_log_at_which_the_limit_was_passed() -> None:
    outlook = actuator(1.0 + 0.1 * np.arange(30)).outlook
    assert outlook is not None
    assert outlook.words == "past the limit since 21"


def test_without_certain_growth_the_outlook_is_that_the_trend_is_past_the_limit() -> None:
    row = actuator([3.4, 3.2] * 14 + [2.8])
    assert (row.last.state, row.state) == ("open", "alarm")
    assert row.outlook is not None
    assert not row.outlook.trend.certain
    assert row.outlook.words == "the trend is past the limit"


def test_logs_without_a_verdict_give_no_outlook() -> None:
    assert outlook_of(actuator(GROWING, outcome="mismatch").logs, "leakage_flow") is None


def test_logs_between_two_conditions_count_in_the_trend_and_can_raise_the_alarm() -> None:
    row = actuator(GROWING, outcome="mismatch", found_condition=None, against=between(0.5, 0.0))
    assert row.outlook is not None
    assert len(row.outlook.logs) == 30
    assert (row.last.state, row.state) == ("open", "alarm")
    assert "<h1>P-1: nearing a limit (leakage between none and minor).</h1>" in actuator_page(row, {})


def test_the_page_counts_logs_without_a_reliable_severity() -> None:
    logs = actuator(GROWING).logs
    lost = replace(logs[3], state="unknown")
    page = actuator_page(ActuatorRow("P-1", (*logs[:3], lost, *logs[4:])), {})
    assert "1 of 30 logs has no severity that can be relied on" in page
    assert "relied on" not in actuator_page(actuator(GROWING), {})


def test_the_level_of_a_trend_is_dated_if_the_newest_log_is_not_part_of_it() -> None:
    logs = actuator(GROWING[:5]).logs
    lost = replace(logs[-1], state="unknown")
    assert ", as of 4" not in actuator_page(ActuatorRow("P-1", logs), {})
    page = actuator_page(ActuatorRow("P-1", (*logs[:-1], lost)), {})
    assert "level of the trend" in page
    assert page.count(", as of 3") == 2  # one for leakage, one for bulk modulus


def test_the_page_of_an_actuator_without_severities_gives_the_reason_of_each_log() -> None:
    page = actuator_page(actuator(GROWING[:5], outcome="failed", found_condition=None, reason="no time"), {})
    assert page.count("no time") == 5
    assert "When a limit is reached" not in page


def test_the_chart_range_includes_the_limit_but_not_the_whole_forecast() -> None:
    page = actuator_page(actuator(1.0 + 0.1 * np.arange(10)), {})
    low, high = json.loads(re.findall(r'"ends": ?(\[[^]]*\])', page)[0])
    assert low < 1.0
    assert 3.0 < high < 5.0


def test_the_page_of_an_actuator_shows_every_severity_with_its_forecast() -> None:
    page = actuator_page(actuator(GROWING), {"P-1_29.csv": "../pages/last.html"}).replace("\N{NO-BREAK SPACE}", " ")
    assert "<h1>P-1: nearing a limit.</h1>" in page
    assert page.count('class="charts"') == 1
    assert 'href="../pages/last.html"' in page
    assert re.findall(r'"file": ?"([^"]*)"', page) == ["P-1"]  # one chart for all severities
    assert "Leakage reaches its limit in about" in page
    assert "more than 300 logs" in page


def weekly(leakages: Any, std: float = 0.05) -> ActuatorRow:
    """Return an actuator with one log a week, dated without a time of day."""
    files = [f"P-1_{np.datetime64('2026-01-05') + 7 * place}.csv" for place in range(len(leakages))]
    rows = [store_row(file, float(one), std) for file, one in zip(files, leakages, strict=True)]
    (row,) = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {}))
    return row


def abscissa_of(page: str) -> dict[str, Any]:
    (data,) = re.findall(r'class="numbers">(.*?)</script>', page, re.DOTALL)
    return json.loads(data)["x"]


def test_charts_of_dated_logs_have_a_date_axis_that_extends_to_a_forecast_crossing() -> None:
    grows, rests = (abscissa_of(actuator_page(weekly(one), {})) for one in (1.0 + 0.1 * np.arange(12), np.ones(12)))
    assert grows["label"] == rests["label"] == "date"
    assert rests["count"] == 12 + 5
    assert rests["start"] == float(np.datetime64("2026-01-05").astype(int))
    assert rests["step"] == 7.0
    assert tuple(rests["dates"]) == DAYS
    assert rests["count"] < grows["count"] < 12 + 30
    undated = abscissa_of(actuator_page(actuator(np.ones(12)), {}))
    assert (undated["label"], undated["dates"], undated["start"]) == ("number of the log", False, 1.0)


def test_logs_of_a_single_day_are_numbered_instead_of_dated() -> None:
    files = [f"P-1_2026-01-05_{hour:02d}-00.csv" for hour in range(12)]
    logs = log_rows([store_row(file, 1.0) for file in files], by_pattern(files, "{actuator}_{date}.csv"), {})
    assert not abscissa_of(actuator_page(actuator_rows(logs)[0], {}))["dates"]


def test_the_forecast_of_logs_dated_by_day_has_no_time_of_day() -> None:
    row = weekly(1.0 + 0.18 * np.arange(12), std=0.01)
    assert row.outlook is not None
    assert row.outlook.left is not None
    assert 7.0 * row.outlook.left[2] < 2.0
    assert row.outlook.when(0, 4) == "23 March 2026"


def test_a_severity_that_recedes_from_its_limit_has_no_forecast_date() -> None:
    """Before, reversed futures gave a pressure that fell by 1 % per log a limit reached in "2029 to 2038"."""
    outlook = outlook_of(weekly(1.0 + 2.0 * np.exp(-np.arange(12) / 4.0), std=0.01).logs, "leakage_flow")
    assert outlook is not None
    assert outlook.trend.crossing is not None
    assert np.isfinite(outlook.trend.crossing.quantiles[0])
    assert (outlook.when(1, 3), outlook.when(0, 4)) == ("not within sight", "not within sight")


def test_the_deciding_severity_is_listed_first_and_logs_link_to_their_pages() -> None:
    row = actuator(1.0 + 0.1 * np.arange(30))
    page = actuator_page(row, {"P-1_28.csv": "logs/28", "P-1_29.csv": "logs/29"})
    stiffness_decides = actuator_page(weekly(np.ones(12)), {})
    order = [re.findall(r'<td data-head="severity">(.*?)</td>', one) for one in (page, stiffness_decides)]
    assert order == [["leakage", "bulk modulus"], ["bulk modulus", "leakage"]]
    assert '<a href="logs/28">P-1_28.csv</a>' in page
    assert '<a href="logs/29">Page of the last log</a>' in page
    assert '<td class="name" data-head="log">P-1_27.csv</td>' in page


def test_dates_on_the_page_do_not_break_across_lines() -> None:
    page = actuator_page(weekly([1.0] * 6 + [4.0] * 6), {})
    assert 'past the limit since <span class="date">2026-02-16</span>.</p>' in page


def test_a_limit_passed_by_the_last_logs_is_reached_even_with_the_trend_within_it() -> None:
    page = actuator_page(weekly([1.0] * 8 + [4.0] * 2), {})
    assert "still within it: log again" in page
    assert page.count(">reached</td>") == 2


def test_the_page_names_the_repair_from_which_a_trend_restarts() -> None:
    page = actuator_page(actuator(GROWING, maintained=(9.5,)), {})
    assert "Every severity is followed from the log of 10 on, after a repair." in page
    few = actuator_page(actuator(GROWING, maintained=(27.0,)), {}).replace("\N{NO-BREAK SPACE}", " ")
    assert re.search("no forecast yet, since it needs 4 logs, and there are [23] since the trend restarted", few)


def test_a_lasting_change_is_not_called_a_repair() -> None:
    page = actuator_page(actuator([1.0] * 15 + [2.0] * 15), {})
    assert "Leakage is followed from the log of 15 on, after a lasting change." in page


def test_repairs_are_read_from_a_table(tmp_path: Path) -> None:
    table = tmp_path / "repairs.csv"
    table.write_text("actuator,date,what\nP-1,1970-01-03,seal\nP-1,1970-01-05,pump\n", encoding="utf-8")
    assert read_maintenance(table) == {"P-1": [2.0, 4.0]}
    assert read_maintenance(None) == {}
    table.write_text("actuator,date\nP-1,soon\n", encoding="utf-8")
    with pytest.raises(HydrostateError, match=r"repairs.csv: date must be ISO 8601"):
        read_maintenance(table)


@pytest.mark.slow
def test_the_page_of_an_actuator_works_in_a_browser(browser: Any, tmp_path: Path) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    (tmp_path / "page.html").write_text(actuator_page(weekly(GROWING), {}), encoding="utf-8")
    page = browser.new_page(viewport={"width": 390, "height": 800}, color_scheme="dark")
    complaints: list[str] = []
    page.on("console", lambda said: complaints.append(said.text))
    page.on("pageerror", lambda said: complaints.append(str(said)))
    page.goto((tmp_path / "page.html").as_uri())
    page.wait_for_selector("html.charts-drawn", state="attached")
    assert page.locator(".live canvas").count() == 2
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.locator(".live .panel").first.focus()
    page.keyboard.press("ArrowRight")
    assert re.fullmatch(r"date: 2026-\d\d-\d\d", page.locator(".place").inner_text())
    with page.expect_download() as started:
        page.get_by_role("button", name="Download the numbers").click()
    started.value.save_as(tmp_path / "numbers.csv")
    assert (tmp_path / "numbers.csv").read_text("utf-8").splitlines()[1].startswith("2026-01-05,1,")
    found = axe.Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []
    assert complaints == []
    page.close()


def test_a_last_log_past_the_limit_with_the_trend_within_it_asks_for_another_log() -> None:
    """Before, the page said "past the limit" beside a level far within it."""
    leaks = np.append(np.full(12, 1.2), 6.0)
    row = actuator(leaks)
    assert row.outlook is not None
    assert row.outlook.trend.level[0] < 3.0
    page = actuator_page(row, {})
    assert page.count("its trend is still within it: log again") == 2  # in the first sentence and in the table
    assert "still within" not in actuator_page(actuator(np.full(12, 6.0)), {})


def test_each_of_the_last_logs_is_listed_with_its_worst_severity() -> None:
    page = actuator_page(actuator(np.append(np.full(5, 1.2), 6.0)), {})
    worst = re.findall(r'<td data-head="worst">(.*?)</td>', page)
    assert [one.split()[0] for one in worst] == ["leakage", *5 * ["bulk"]]
