"""The page of a fleet, also in a browser."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from experiments.fleet import page as subject
from experiments.fleet.actuators import ActuatorRow, actuator_rows
from experiments.fleet.log_pages import file_name, write_pages
from experiments.fleet.naming import by_dates, by_pattern
from experiments.fleet.page import fleet_page, rig_hint, row_cells, sickest_of, title_of
from experiments.fleet.rows import STATES, log_rows
from tests.experiments.fleet.conftest import between, store_row

ROWS = 10_000


def page_of(count: int, links: bool = False) -> str:
    files = [f"/private/hall/P-{i}_{i % 9}.csv" for i in range(count)]
    rows = [store_row(file, 1.0 + (7 * i % count) / count * 3.0) for i, file in enumerate(files)]
    found = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {}))
    return fleet_page(found, {found[0].name: "pages/first.html"} if links else {}, "hall")


def test_the_page_counts_actuators_past_a_limit_and_names_those_to_begin_with() -> None:
    page = page_of(9)
    assert "<h1>2 of 9 actuators are past a limit.</h1>" in page
    assert "Start with P-5, P-1." in page


def test_an_actuator_named_like_an_erratum_is_not_linked_to_one() -> None:
    files = ["P1_1.csv", "E9_1.csv"]
    rows = log_rows([store_row(file, 4.0) for file in files], by_pattern(files, "{actuator}_{date}.csv"), {})
    page = fleet_page(actuator_rows(rows), {}, "hall")
    assert "Start with" in page
    assert 'href="#P1"' not in page
    assert 'id="errata"' not in page


def test_the_title_counts_actuators_near_a_limit_and_names_them_if_none_is_past_one() -> None:
    def row(name: str, state: str) -> ActuatorRow:
        (log,) = log_rows([store_row(f"{name}.csv", 1.0)], {}, {})
        made = ActuatorRow(name, (log,))
        vars(made)["state"] = state
        return made

    near, sound, sick = row("A", "alarm"), row("B", "within"), row("C", "over")
    assert (title_of([near]), sickest_of([near])) == ("The actuator nears a limit.", ["A"])
    assert title_of([near, sound]) == "None of 2 actuators is past a limit; 1 nears one."
    assert title_of([sick, near, near]) == "1 of 3 actuators is past a limit; 2 near one."
    maybe = row("D", "likely")
    assert title_of([sick, maybe, near]) == "1 of 3 actuators is past a limit, 1 more probably; 1 nears one."
    assert title_of([maybe, near]) == "1 of 2 actuators is probably past a limit; 1 nears one."
    assert sickest_of([sick, near]) == ["C"]


def test_the_printed_page_lists_faulty_actuators_and_counts_the_rest() -> None:
    def paper(**counts: int) -> tuple[int, str]:
        found: list[ActuatorRow] = []
        for state in STATES:
            for i in range(counts.get(state, 0)):
                (log,) = log_rows([store_row(f"{state}{i}.csv", 1.0)], {}, {})
                row = ActuatorRow(f"{state}{i}", (log,))
                vars(row)["state"] = state
                found.append(row)
        page = fleet_page(found, {}, "hall").split('<div class="still">')[1].split("</section>")[0]
        shown = re.split("screen-only|<script", page)[0]
        assert "within0" not in shown
        (said,) = re.findall(r"<p>(Not listed.*?)</p>", shown) or [""]
        return len(re.findall(r'<td class="fleet-', shown)), said

    assert paper(over=2, unknown=3, within=95) == (5, "Not listed on paper: 95 within limits.")
    assert paper(within=3) == (0, "Not listed on paper: 3 within limits.")
    assert paper(over=2, unknown=40) == (25, "Not listed on paper: 17 no verdict.")
    assert paper(over=60, likely=20, unknown=40, within=1)[0] == 80
    assert paper(over=130, within=1) == (100, "Not listed: 30 past a limit, 1 within limits.")
    assert paper(over=3) == (3, "")
    assert paper(within=30, failed=2) == (2, "Not listed on paper: 30 within limits.")


def test_many_actuators_without_a_verdict_lead_to_a_hint_on_the_rig_file() -> None:
    def rows(unknown: int) -> list[ActuatorRow]:
        outcomes = ["mismatch"] * unknown + ["ok"] * (8 - unknown)
        return actuator_rows(
            log_rows([store_row(f"{i}.csv", 1.0, outcome=one) for i, one in enumerate(outcomes)], {}, {})
        )

    assert rig_hint(rows(2)) == ""
    assert "3 of 8 actuators have no verdict. If" in rig_hint(rows(3))
    assert rig_hint(rows(3)) in fleet_page(rows(3), {}, "hall")
    assert title_of(rows(3)) == "None of 8 actuators is past a limit; 3 have no verdict."


def test_an_actuator_whose_last_log_is_unknown_has_no_forecast() -> None:
    files = [f"A_{place}.csv" for place in range(6)]
    rows = [store_row(file, 3.6) for file in files[:5]]
    rows.append(store_row(files[5], 3.6, outcome="mismatch", found_condition=None, reason="the pump is worn"))
    (row,) = actuator_rows(log_rows(rows, by_pattern(files, "{actuator}_{date}.csv"), {}))
    _, state, _, _, _, outlook, left, *_ = row_cells(row)
    assert (state, outlook, left) == ("unknown", "no verdict since 5", None)


def test_actuators_without_a_readable_log_are_not_counted_in_the_title() -> None:
    def title(*outcomes: str) -> str:
        rows = [store_row(f"{i}.csv", 1.0, outcome=one) for i, one in enumerate(outcomes)]
        return fleet_page(actuator_rows(log_rows(rows, {}, {})), {}, "hall").split("<h1>")[1].split("</h1>")[0]

    assert title("ok", "failed", "ok") == "None of 2 actuators is past a limit."
    assert title("ok", "failed") == "The actuator is past no limit."
    assert title("failed", "failed") == "No log could be read."


def test_fleet_pages_import_neither_matplotlib_nor_scipy() -> None:
    code = (
        "import sys\nimport experiments.fleet.log_pages\nimport experiments.fleet.page\n"
        "print(sorted({'matplotlib', 'scipy', 'faults.diagnosis'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)  # noqa: S603
    assert done.stdout.splitlines() == ["[]"]


def test_a_fleet_page_has_relative_links_and_shows_no_folder() -> None:
    page = page_of(30, links=True)
    assert "pages/first.html" in page
    assert "/private" not in page
    assert "file:" not in page


def test_the_reason_of_an_unreadable_log_is_shown_without_its_folder() -> None:
    row = store_row(
        "a.csv", 1.0, outcome="failed", quantities=None, found_condition=None, reason="/private/a.csv: no time"
    )
    page = fleet_page(actuator_rows(log_rows([row], {}, {})), {}, "hall")
    assert "no time" in page
    assert "/private" not in page


def test_severities_of_a_model_that_does_not_fit_are_not_shown() -> None:
    row = store_row(
        "a.csv", 9.0, outcome="mismatch", found_condition=None, reason="the pump is worn; in none of the nine"
    )
    (found,) = actuator_rows(log_rows([row], {}, {}))
    _, state, said, worst, share, *_ = row_cells(found)
    assert (state, said, worst, share) == ("unknown", "the pump is worn; in none of the nine", "", None)


def test_a_log_between_two_conditions_is_shown_with_its_levels_and_severity() -> None:
    row = store_row("a.csv", 1.8, outcome="mismatch", found_condition=None, against=between(0.5, 1.0))
    (found,) = actuator_rows(log_rows([row], {}, {}))
    _, state, said, worst, share, *_ = row_cells(found)
    assert (state, said, worst, share) == (
        "open",
        "leakage between none and minor; minor friction",
        "leakage 1.80 L/min",
        40.0,
    )


def test_logs_that_could_not_be_read_are_listed_with_the_reason() -> None:
    rows = [
        store_row("A_1.csv", 1.0),
        store_row("A_2.csv", 1.0, outcome="failed", found_condition=None, reason="A_2.csv: no time"),
    ]
    named = by_pattern(["A_1.csv", "A_2.csv"], "{actuator}_{date}.csv")
    page = fleet_page(actuator_rows(log_rows(rows, named, {})), {}, "hall")
    assert '<td class="name">A_2.csv</td>' in page.replace(' data-head="log"', "")
    assert "no time" in page
    assert "Logs that could not be read" in page
    assert "Logs that could not be read" not in fleet_page(actuator_rows(log_rows(rows[:1], named, {})), {}, "hall")


def test_the_printed_page_hides_rows_beyond_the_stated_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "MOST_LISTED", 3)
    bad: dict[str, Any] = {"outcome": "failed", "found_condition": None, "reason": "no time"}
    rows = [store_row(f"A_{number}.csv", 1.0, **bad) for number in range(4)]
    page = fleet_page(actuator_rows(log_rows(rows, {}, {})), {}, "hall")
    assert "on paper, at most 3." in page
    assert "on paper, at most" not in fleet_page(actuator_rows(log_rows(rows[:3], {}, {})), {}, "hall")
    assert re.findall(r"@media print { :is\(#unread, #undated\) tbody tr:nth-child\(n \+ (\d+)\)", page) == ["4"]


def test_the_page_says_how_many_rows_have_a_page() -> None:
    assert "1 of 9 rows have a page" in page_of(9, links=True).replace("\n", " ")


def test_the_page_explains_each_state_under_its_displayed_name() -> None:
    page = page_of(2)
    told = set(re.findall(r"<dt>([^<]+)</dt>", page))
    assert told >= set(STATES.values()) - {"within limits"}


def test_a_file_name_with_a_script_tag_is_escaped_in_the_page() -> None:
    row = store_row("a</script><b>.csv", 1.0)
    page = fleet_page(actuator_rows(log_rows([row], {}, {})), {}, "hall")
    assert "</script><b>" not in page


def test_pages_are_written_for_the_sickest_that_can_be_read(tmp_path: Path) -> None:
    rows = [store_row("A_1.csv", 4.0), store_row("B_1.csv", 5.0, outcome="failed"), store_row("C_1.csv", 3.6)]
    found = actuator_rows(log_rows(rows, by_pattern(["A_1.csv", "B_1.csv", "C_1.csv"], "{actuator}_{date}.csv"), {}))
    written: list[str] = []

    def write(file: str, path: Path) -> bool:
        written.append(f"{file} {path.parent.name}")
        return file != "C_1.csv"

    assert list(write_pages(found, tmp_path, 5, write)) == ["A"]
    assert written == ["A_1.csv pages", "C_1.csv pages"]


def test_names_of_pages_are_safe_and_differ() -> None:
    names = {file_name(one) for one in ("a b/../c.csv", "c.csv", "", "x" * 300, "ü/é.csv")}
    assert len(names) == 5
    assert all(one.isascii() and "/" not in one and len(one) < 90 for one in names)
    assert len({file_name(f"{place}/run.csv") for place in range(20000)}) == 20000


@pytest.fixture(scope="module")
def big(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fleet") / "index.html"
    path.write_text(page_of(ROWS, links=True), encoding="utf-8")
    return path


@pytest.fixture
def page(browser: Any, big: Path) -> Any:
    context = browser.new_context(viewport={"width": 390, "height": 800}, color_scheme="dark")
    one = context.new_page()
    one.complaints = []
    one.on("console", lambda said: one.complaints.append(said.text))
    one.on("pageerror", lambda said: one.complaints.append(str(said)))
    one.on("request", lambda asked: asked.url.startswith("file:") or one.complaints.append(asked.url))
    one.goto(big.as_uri())
    one.wait_for_selector("html.table-drawn", state="attached")
    yield one
    context.close()


@pytest.mark.slow
def test_ten_thousand_rows_sort_and_filter_with_few_in_the_page(page: Any) -> None:
    first = page.locator(".window tbody th").first
    begin = first.inner_text()
    assert page.locator(".window tbody tr").count() < 100
    page.get_by_role("button", name="actuator").click()
    assert first.inner_text() == "P-0"
    assert page.locator(".window th[aria-sort=ascending]").inner_text().startswith("actuator")
    page.get_by_role("button", name="of the limit").click()
    assert first.inner_text() == begin
    page.get_by_label("Show rows with").fill("p-99")
    assert page.get_by_role("status").inner_text() == "111 of 10000 rows"
    page.get_by_label("Show rows with").fill("p-9 may be")  # the words that are shown, not what stands for them
    by_words = page.get_by_role("status").inner_text()
    page.get_by_label("Show rows with").fill("p-9")
    page.get_by_label("in state").select_option("open")
    assert page.get_by_role("status").inner_text() == by_words != "0 of 10000 rows"
    page.get_by_label("in state").select_option("over")
    assert all(words == "past a limit" for words in page.locator(".window td.fleet-over").all_inner_texts())
    assert page.complaints == []


@pytest.mark.slow
def test_the_last_row_is_reached_by_scrolling(page: Any) -> None:
    page.evaluate("document.querySelector('.window').scrollTop = 1e9")
    page.wait_for_selector(f'.window tr[aria-rowindex="{ROWS + 1}"]')


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 768, 1280])
def test_a_table_counts_the_rows_below_until_the_last_is_reached(page: Any, width: int) -> None:
    from playwright.sync_api import expect  # not every developer has it

    page.set_viewport_size({"width": width, "height": 800})
    more = page.locator(".more-rows")
    expect(more).to_have_text(re.compile(r"^\d{4} more rows below: scroll in the table\.$"))
    page.evaluate("document.querySelector('.window').scrollTop = 1e9")
    expect(more).to_have_text("")


@pytest.mark.slow
def test_the_page_is_accessible_and_fits_a_phone(page: Any) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    found = axe.Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 768, 1280])
def test_a_long_condition_and_a_long_reason_are_not_cut_off(browser: Any, tmp_path: Path, width: int) -> None:
    reason = "differential_pressure_pa is missing in 900 of 1000 samples"
    rows = [
        store_row("P-12_2026-11-22.csv", 4.0, found_condition="minor_leakage_minor_friction"),
        store_row("b.csv", 1.0, outcome="failed", quantities=None, found_condition=None, reason=reason),
    ]
    path = tmp_path / "index.html"
    path.write_text(fleet_page(actuator_rows(log_rows(rows, {}, {})), {}, "hall"), encoding="utf-8")
    page = browser.new_page(viewport={"width": width, "height": 800})
    page.goto(path.as_uri())
    page.wait_for_selector("html.table-drawn", state="attached")
    lines = page.locator('td[data-head="found"] .two-lines')
    assert lines.all_inner_texts() == ["minor leakage + minor friction", reason]
    whole = page.locator(":is(th, td[data-head=found]) .two-lines").evaluate_all(
        "all => all.map(one => one.scrollHeight <= one.clientHeight + 1 && one.scrollWidth <= one.clientWidth + 1)"
    )
    assert whole == [True] * 4
    page.close()


def in_sight(page: Any, heading: str) -> bool:
    """Return whether a cell of the first row is visible in the scrolling window."""
    cell = page.locator(f'.window tbody tr >> nth=0 >> td[data-head="{heading}"]').bounding_box()
    window = page.locator(".window").bounding_box()
    return cell is not None and cell["x"] + cell["width"] <= window["x"] + window["width"]


@pytest.mark.slow
def test_a_phone_shows_the_most_important_columns_and_a_wide_screen_further_ones(page: Any) -> None:
    assert all(in_sight(page, heading) for heading in ("found", "worst", "of the limit", "outlook"))
    assert page.locator(".window").evaluate("one => one.scrollWidth <= one.clientWidth")
    page.set_viewport_size({"width": 1280, "height": 800})
    page.evaluate("new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
    assert all(in_sight(page, heading) for heading in ("worst", "logs left", "last log", "logs"))


def test_the_title_counts_logs_of_no_actuator_that_have_no_verdict() -> None:
    def of(*alone: str) -> str:
        files = [f"P-{i}_2026-01-0{k}.csv" for i in range(3) for k in (1, 2)]
        more = {"unknown": {"outcome": "mismatch"}, "over": {}, "within": {}}
        odd = [(f"odd {i}.csv", 9.0 if name == "over" else 1.0, more[name]) for i, name in enumerate(alone)]
        rows = [store_row(file, 1.0) for file in files] + [store_row(file, one, **told) for file, one, told in odd]
        return title_of(actuator_rows(log_rows(rows, by_dates([row["file"] for row in rows]), {})))

    none = "None of 3 actuators is past a limit"
    assert of() == of("within") == f"{none}."
    assert of("unknown") == f"{none}; the log without an actuator has no verdict."
    assert of("unknown", "within") == f"{none}; of 2 logs without an actuator, 1 has no verdict."
    assert of("over", "unknown", "unknown") == (
        f"{none}; of 3 logs without an actuator, 1 is past one and 2 have no verdict."
    )
