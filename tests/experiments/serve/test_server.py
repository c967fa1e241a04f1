"""A whole server in its own process: hostile clients, a kill during uploads, a fast stream, and a browser.

`python -m benchmarks server` measures the same at full length.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.server.hostile_client import MIX, server_errors
from benchmarks.server.server_process import Server
from benchmarks.server.server_trials import attack, kill, last_gauges, send_rows, stream
from experiments.page.numbers import MINUS

pytestmark = pytest.mark.slow

MB = 1 << 20

PATIENCE = 120_000
"""How long a browser waits for a busy server [ms]."""

MARK = """([selector, name]) => new MutationObserver(() => { document.documentElement.dataset[name] = "" })
    .observe(document.querySelector(selector), { childList: true })"""
"""Sets an attribute of the page when an element's content is next set, whether or not it changes. Tests can wait for
attributes, but not for expressions, since the page's policy forbids eval."""


def test_hostile_clients_cause_no_server_error_no_stray_file_and_no_memory_growth(tmp_path: Path) -> None:
    found = attack(tmp_path, 240, 80, {**MIX, "chunked": 0.5})
    assert not server_errors(found.answers)
    assert not found.strange
    assert found.most - found.memory[0] < 60 * MB
    assert set(found.polite) <= {200, 429}
    assert found.slowest < 10.0
    slow = {kind: count for kind, count in found.answers.items() if kind.startswith(("slow", "huge", "chunked"))}
    assert set(slow) <= {"slow 408", "huge 413", "huge 429", "chunked 413", "chunked 429"}


def test_killing_the_server_during_uploads_loses_no_result_and_the_rest_is_resumed(tmp_path: Path) -> None:
    found = kill(tmp_path, 8, 2)
    assert found.finished >= 2
    assert found.accepted > found.finished
    assert not found.lost
    assert not found.unfinished


def test_a_stream_of_10_khz_is_received_without_loss(tmp_path: Path) -> None:
    found = stream(tmp_path, 5.0, 10_000.0)
    assert found.taken == found.sent == 50_000
    assert found.gaps == 0


def test_generated_requests_are_answered_as_the_openapi_schema_says(tmp_path: Path) -> None:
    pytest.importorskip("schemathesis", reason="needs schemathesis")
    with Server(tmp_path / "kept") as server:
        command = [str(Path(sys.executable).with_name("schemathesis")), "run", f"{server.base}/openapi.json"]
        how = ["--checks", "all", "--max-examples", "10", "--phases", "coverage,fuzzing", "--seed", "1", "--no-color"]
        done = subprocess.run([*command, *how], capture_output=True, text=True, check=False, cwd=tmp_path)  # noqa: S603
    assert done.returncode == 0, done.stdout[-4000:]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with (
        send_rows(1800.0, 500.0) as (address, _),  # longer than all tests on these pages take
        Server(tmp_path_factory.mktemp("served") / "kept", "--watch", f"bench={address}") as server,
    ):
        yield server


@pytest.fixture(scope="module")
def paths(served: Server, log: bytes) -> dict[str, str]:
    both = [served.upload_log(name, log, "diagnose") for name in ("one.csv", "two.csv")]
    assert [served.finished(one)["state"] for one in both] == ["done", "done"]
    last_gauges(served, 1)
    return {
        "home": "/",
        "log": f"/logs/{both[0]}",
        "fleet": "/fleet",
        "compare": f"/compare?first={both[0]}&second={both[1]}",
        "live": "/live/bench",
    }


@pytest.fixture
def opened(browser: Any, served: Server, paths: dict[str, str]) -> Iterator[Any]:
    contexts: list[Any] = []

    def visit(name: str, width: int = 1280, scheme: str = "light") -> Any:
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        contexts.append(context)
        context.set_default_timeout(PATIENCE)
        page = context.new_page()
        page.complaints, page.asked = [], []
        page.on("console", lambda one: page.complaints.append(one.text))
        page.on("pageerror", lambda one: page.complaints.append(str(one)))
        page.on("request", lambda one: page.asked.append(one.url))
        page.goto(served.base + paths[name])
        if name == "home":
            page.wait_for_selector(".logs tbody a")
        if name == "live":
            page.wait_for_selector("html.live-drawn", state="attached")
        return page

    yield visit
    for context in contexts:
        context.close()


@pytest.mark.parametrize("name", ["home", "log", "fleet", "compare", "live"])
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_server_pages_fit_the_screen_are_accessible_and_load_nothing_from_elsewhere(
    opened: Any, served: Server, name: str, width: int, scheme: str
) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    page = opened(name, width, scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    found = axe.Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []
    assert page.complaints == []
    assert [url for url in page.asked if not url.startswith((served.base, "data:", "blob:"))] == []


def test_a_chosen_log_is_uploaded_and_listed_and_two_ticked_ones_are_compared(
    opened: Any, log: bytes, tmp_path: Path
) -> None:
    (tmp_path / "<i>three.csv").write_bytes(log)
    page = opened("home")
    page.select_option("#verb", "inspect")
    page.set_input_files("#file", str(tmp_path / "<i>three.csv"))
    page.get_by_role("link", name="<i>three.csv").wait_for()
    for name in ("one.csv", "two.csv"):
        page.get_by_role("checkbox", name=f"Compare {name}").check()
    page.get_by_role("button", name="Compare the two ticked").click()
    page.wait_for_url("**/compare?*")
    assert page.locator("h1").inner_text() == "Normal in both logs."


def test_a_failed_diagnosis_suggests_inspect_and_a_failed_inspection_does_not(opened: Any, tmp_path: Path) -> None:
    page = opened("home")
    rows: list[Any] = []
    for verb, name, content in (("diagnose", "no log.csv", b"a,b\n1,2\n3,4\n"), ("inspect", "nothing.mat", b"\0\1\2")):
        (tmp_path / name).write_bytes(content)
        page.select_option("#verb", verb)
        page.set_input_files("#file", str(tmp_path / name))
        rows.append(page.locator("tr", has_text=name))
        rows[-1].locator("td", has_text=f"failed ({verb})").wait_for()
    said = [row.get_by_text("choose inspect and drop it again").count() for row in rows]
    assert said == [1, 0]


def test_a_log_that_could_not_be_deleted_stays_listed_with_the_reason(opened: Any, tmp_path: Path) -> None:
    page = opened("home")
    (tmp_path / "stays.csv").write_text("a,b\n1,2\n3,4\n")
    page.set_input_files("#file", str(tmp_path / "stays.csv"))
    row = page.locator("tr", has_text="stays.csv")
    row.locator("td", has_text="failed").wait_for()
    page.on("dialog", lambda dialog: dialog.accept())
    page.route("**/api/logs/*", lambda route: route.fulfill(status=429, json={"detail": "the server is busy"}))
    page.get_by_role("button", name="Delete stays.csv").click()
    page.get_by_text("stays.csv was not deleted: the server is busy").wait_for()
    page.unroute("**/api/logs/*")
    page.get_by_role("button", name="Delete stays.csv").click()
    row.wait_for(state="detached")


def test_a_log_can_be_dropped_anywhere_and_a_refusal_stays_visible(opened: Any) -> None:
    page = opened("home")
    drop = """([name, text]) => {
        const files = new DataTransfer();
        files.items.add(new File([text], name));
        document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true }));
    }"""
    page.evaluate(drop, ["empty.csv", ""])
    page.get_by_text("Not taken: empty.csv: the body must be the file itself, but it is empty.").wait_for()
    page.evaluate(MARK, ["[role=status]", "looked"])
    # the list was requested again, and the status was written anew
    page.wait_for_selector("html[data-looked]", state="attached")
    assert "Not taken: empty.csv" in page.get_by_role("status").inner_text()
    page.evaluate(drop, ["dropped beside.csv", "a,b\n1,2\n3,4\n"])
    page.locator("tr", has_text="dropped beside.csv").locator("td", has_text="failed").wait_for()
    assert "Not taken" not in page.get_by_role("status").inner_text()


def test_a_late_answer_does_not_overwrite_a_newer_one(opened: Any, tmp_path: Path) -> None:
    """Before, a log that had failed was shown as waiting again, until the next request to the server."""
    page, asked, held = opened("home"), list[Any](), list[Any]()

    def answer(route: Any) -> None:
        asked.append(route)
        if len(asked) > 1:
            route.continue_()
        else:  # further requests may come while this one is fetched; only the first is held
            held.append((route, route.fetch()))

    page.route("**/api/logs?most=*", answer)
    (tmp_path / "late answer.csv").write_text("a,b\n1,2\n3,4\n")
    page.set_input_files("#file", str(tmp_path / "late answer.csv"))
    row = page.locator("tr", has_text="late answer.csv")
    row.locator("td", has_text="failed").wait_for()
    while not held:  # the first answer may arrive after the second
        page.wait_for_timeout(20)
    (route, old) = held[0]
    with page.expect_response("**/api/logs?most=*") as late:
        route.fulfill(response=old)
    late.value.finished()
    # by then the page has handled all earlier answers
    page.evaluate("fetch('api/health').then((answer) => answer.text())")
    assert "failed" in row.inner_text()


@pytest.mark.parametrize(
    ("raised", "state", "begin"),
    [
        (0, "watching", "Watching: learning is over."),
        (2, "watching", "2 alarms, the last at "),
        (0, "failed", "Failed: learning is over. It is tried again every few seconds."),
    ],
)
def test_the_heading_of_the_live_view_shows_alarms_or_the_state(
    opened: Any, raised: int, state: str, begin: str
) -> None:
    alarm = {"event": "alarm", "time_s": 9.0, "received": 1.7e9, "message": "the flow balance changed"}
    ready = {"event": "ready", "time_s": 5.0, "received": 1.7e9, "message": "learning is over"}
    told = {"name": "bench", "state": state, "message": "learning is over", "gauges": None, "history": []}
    body = f"event: history\ndata: {json.dumps({**told, 'events': [ready, *[alarm] * raised]})}\n\n"
    page = opened("live")
    page.route("**/events", lambda route: route.fulfill(content_type="text/event-stream", body=body))
    page.add_init_script(  # the stream of events ends at once, which does not matter here
        "addEventListener('DOMContentLoaded', () => new MutationObserver((all) => all.forEach((one) => {"
        "document.documentElement.dataset.said ??= one.target.textContent }))"
        ".observe(document.querySelector('.live-state'), { childList: true }))"
    )
    page.reload()
    page.wait_for_selector("html[data-said]", state="attached")
    assert page.locator("html").get_attribute("data-said").startswith(begin)
    assert page.locator(".live-state").evaluate("one => one.classList.contains('alarmed')") is (raised > 0)


def test_the_live_view_shows_gauges_charts_and_events(opened: Any) -> None:
    from playwright.sync_api import expect  # not every developer has it

    page = opened("live")
    assert page.locator(".gauges li").count() == 7
    assert page.locator(".histories canvas").count() >= 3  # one per channel; a balance has one after it is learnt
    assert page.locator(".alarms tbody tr").first.is_visible()
    when = page.locator(".alarms tbody th").first  # date and time are on one line
    assert when.evaluate("one => one.offsetHeight < 3 * parseFloat(getComputedStyle(one).fontSize)")
    told = page.locator(".gauges strong").last
    rows = told.inner_text()
    expect(told).not_to_have_text(rows, timeout=PATIENCE)
    assert int(told.inner_text().replace(",", "")) > int(rows.replace(",", ""))


def test_many_events_scroll_in_a_box_of_limited_height(opened: Any) -> None:
    alarm = {"event": "alarm", "time_s": 9.0, "received": 1.7e9, "message": "the flow balance changed"}
    told = {"name": "bench", "state": "watching", "message": "", "gauges": None, "history": [], "events": [alarm] * 200}
    page = opened("live")
    body = f"event: history\ndata: {json.dumps(told)}\n\n"
    page.route("**/events", lambda route: route.fulfill(content_type="text/event-stream", body=body))
    page.reload()
    page.locator(".alarms tbody tr").nth(199).wait_for(state="attached")
    box = page.locator(".events")
    assert box.bounding_box()["height"] < 400.0
    assert box.evaluate("one => one.scrollHeight > one.clientHeight")


@pytest.mark.parametrize(
    ("state", "age", "words"),
    [("watching", 72.0, "No row has arrived for 70 s"), ("watching", 0.0, ""), ("failed", 72.0, "")],
)
def test_the_live_view_says_that_rows_have_stopped(opened: Any, state: str, age: float, words: str) -> None:
    gauge = {"time_s": 1.0, "rows": 9, "gaps": 0, "left_out": 0, "number": 1, "received": 1.7e9}
    channels = {"values": {"pressure_a_pa": 1.0}, "low": {"pressure_a_pa": 1.0}, "high": {"pressure_a_pa": 1.0}}
    gauge |= {**channels, "scores": {}, "thresholds": {}}
    told = {"name": "bench", "state": state, "message": "", "gauges": None, "history": [gauge], "events": []}
    body = f"event: history\ndata: {json.dumps({**told, 'now': 1.7e9 + age})}\n\n"
    page = opened("live")
    page.route("**/events", lambda route: route.fulfill(content_type="text/event-stream", body=body))
    page.reload()
    page.wait_for_selector("html.live-drawn", state="attached")
    page.wait_for_timeout(1200)
    quiet = page.locator(".live-quiet")
    assert quiet.is_visible() is bool(words)
    assert quiet.inner_text().startswith(words) or not words
    # the stream of events has ended, and this stays in sight
    assert page.locator(".live-state").inner_text().startswith("The server does not answer")


def test_a_silent_stream_waits_for_rows_and_is_watched_again_when_they_come(opened: Any) -> None:
    gauge = {"time_s": 1.0, "rows": 9, "gaps": 0, "left_out": 0, "number": 1, "received": 1.7e9}
    gauge |= {"values": {"a_pa": 1.0}, "low": {"a_pa": 1.0}, "high": {"a_pa": 1.0}, "scores": {}, "thresholds": {}}
    told = {
        "name": "bench",
        "state": "watching",
        "message": "",
        "gauges": None,
        "history": [gauge],
        "now": 1.7e9 + 72.0,
    }
    page = opened("live")
    page.add_init_script(
        "window.EventSource = class { constructor() { window.events = new EventTarget() }"
        "addEventListener(name, take) { window.events.addEventListener(name, take) } };"
        "window.tell = (name, data) => window.events.dispatchEvent(new MessageEvent(name, { data }))"
    )
    page.reload()
    state = page.locator(".live-state")
    page.evaluate("([name, data]) => tell(name, data)", ["history", json.dumps({**told, "events": []})])
    page.wait_for_selector(".live-quiet:not([hidden])")
    assert state.inner_text() == "Waiting for rows."
    page.evaluate("([name, data]) => tell(name, data)", ["gauges", json.dumps({**gauge, "time_s": 2.0})])
    page.wait_for_selector(".live-quiet", state="hidden")
    assert state.inner_text() == "Watching."


def test_negative_gauges_have_a_minus_sign_and_a_balance_being_learnt_has_no_chart(opened: Any) -> None:
    gauge = {"time_s": 1.0, "rows": 9, "gaps": 0, "left_out": 0, "number": 1}
    channels = {"values": {"pressure_a_pa": -2.5e5}, "low": {"pressure_a_pa": -3e5}, "high": {"pressure_a_pa": 1e5}}
    learnt = {"scores": {"flow": 0.0, "loss": 1.0}, "thresholds": {"flow": None, "loss": 4.0}, "unlearnt_s": 86.2}
    told = {"name": "bench", "state": "learning", "message": "learning", "gauges": None, "events": []}
    body = f"event: history\ndata: {json.dumps({**told, 'history': [{**gauge, **channels, **learnt}] * 2})}\n\n"
    page = opened("live")
    page.route("**/events", lambda route: route.fulfill(content_type="text/event-stream", body=body))
    page.reload()
    page.wait_for_selector("html.live-drawn", state="attached")
    tiles = page.locator(".gauges li").all_inner_texts()
    assert tiles[0].split("\n") == [f"{MINUS}2.5 bar", "pressure A", f"last quarter second: {MINUS}3 to 1 bar"]
    assert [tile.split("\n")[:2] for tile in tiles[1:3]] == [
        ["learning", "flow balance: how close to an alarm"],
        ["25 %", "lost flow: how close to an alarm"],
    ]
    assert "alarms are possible after 87 s more of motion" in tiles[1].replace("\N{NO-BREAK SPACE}", " ")
    assert page.locator(".histories figcaption").all_inner_texts() == [
        "pressure A [bar]",
        "lost flow: how close to an alarm [%]",
    ]
