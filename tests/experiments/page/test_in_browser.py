"""Pages in a real browser: drawing, zoom, fit to screen and paper, no loading from elsewhere, and accessibility."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation.eha.bulk_modulus import EstimateOptions
from estimation.eha.estimate import estimate_log
from estimation.identification.from_record import identify_record, record_signals
from estimation.identification.model.linear_model import LinearModel
from experiments.eha.diagnosis_page import diagnosis_page
from experiments.eha.entries import diagnosis_entries, estimate_entries
from experiments.identification.entries import linear_entries
from experiments.log_pages.finding_page import finding_page
from experiments.log_pages.identified_page import identified_page
from experiments.log_pages.identified_view import view_of_channels
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH

pytestmark = pytest.mark.slow

WIDTHS = (390, 768, 1280)
SHEET = 703
"""Width of an A4 sheet between its margins of 12 mm [pixel]."""

DARKEST_LIGHT, LIGHTEST_DARK = 200, 60
"""Lowest mean brightness of a light figure, and highest of a dark one [0 to 255]."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    rng = np.random.default_rng(3)
    drive = make_drive("steps", 4.0, 1e-3, EhaParameters(), rng)
    log = simulate(CIRCUIT, drive, 1e-3, parameters_for(CONDITIONS["minor_leakage"]), sensors=BENCH, rng=rng)
    found, rig = diagnose_log(log, Rig()), {"file": "/private/place/run.csv", "rig": "paper"}
    estimate = estimate_log(log, Rig(), EstimateOptions())
    model, signals = identify_record(log), record_signals(log)
    fit = {**linear_entries(model), "validation": {"whiteness_p": 0.0, "cross_correlation_p": 0.0}, "notes": []}
    fit |= {"file": rig["file"], "held_back_percent": 87.0, "input": model.input_name, "output": model.output_name}
    fit["dc_gain"] = {"value": model.dc_gain, "std": model.dc_gain_std, "ci95": None}
    folder = tmp_path_factory.mktemp("pages")
    texts = {
        "diagnosis": diagnosis_page({**rig, **diagnosis_entries(found)}, found, log),
        "unknown": diagnosis_page(
            {**rig, **diagnosis_entries(found), "unknown": True, "reasons": ["motor speed reads wrong"]},
            replace(found, unknown=True),
            log,
        ),
        "estimate": finding_page({**rig, **estimate_entries(estimate)}, estimate, log),
        "identified": identified_page(view_of_channels(fit, model, *signals)),
    }
    for name, text in texts.items():
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
    return {name: folder / f"{name}.html" for name in texts}


PAGES = ("diagnosis", "unknown", "estimate", "identified")


@pytest.fixture
def opened(browser: Any, pages: dict[str, Path]) -> Iterator[Any]:
    contexts: list[Any] = []

    def visit(name: str, width: int = 1280, scheme: str = "light", script: bool = True) -> Any:
        context = browser.new_context(
            viewport={"width": width, "height": 900}, color_scheme=scheme, java_script_enabled=script
        )
        contexts.append(context)
        page = context.new_page()
        page.complaints, page.asked = [], []
        page.on("console", lambda one: page.complaints.append(one.text))
        page.on("pageerror", lambda one: page.complaints.append(str(one)))
        page.on("request", lambda one: page.asked.append(one.url))
        page.goto(pages[name].as_uri())
        if script:
            page.wait_for_selector("html.charts-drawn", state="attached")
        return page

    yield visit
    for context in contexts:
        context.close()


def brightness(page: Any, selector: str) -> float:
    """Return the brightness of an element's background, from its median."""
    from io import BytesIO

    from matplotlib.image import imread

    picture = imread(BytesIO(page.locator(selector).first.screenshot()), format="png")[..., :3]
    return float(255.0 * np.median(picture.reshape(-1, 3).mean(axis=1)))


@pytest.mark.parametrize("name", PAGES)
def test_a_page_draws_its_charts_without_errors_or_network_requests(opened: Any, name: str) -> None:
    page = opened(name)
    assert page.locator(".live canvas").count() >= 3
    assert page.complaints == []
    assert [url for url in page.asked if not url.startswith(("file:", "data:", "blob:"))] == []
    assert len([url for url in page.asked if url.startswith("file:")]) == 1


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_have_no_serious_accessibility_violation(opened: Any, name: str, scheme: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    found = axe.Axe().run(opened(name, 390, scheme)).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.parametrize("width", WIDTHS)
def test_a_page_is_not_wider_than_the_screen(opened: Any, name: str, width: int) -> None:
    page = opened(name, width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator(".live canvas").first.bounding_box()["width"] <= width


def test_zoom_by_button_key_and_drag_moves_every_chart_of_the_log(opened: Any) -> None:
    page = opened("diagnosis")

    def labels() -> list[bytes]:
        return [page.locator(".live .panel").nth(i).screenshot() for i in (0, 3)]

    whole = labels()
    page.get_by_role("button", name="Zoom in").first.click()
    by_button = labels()
    assert all(one != other for one, other in zip(by_button, whole, strict=True))
    page.get_by_role("button", name="Show all").last.click()
    page.locator(".live .panel").first.focus()
    page.keyboard.press("+")
    by_key = labels()
    assert by_key[1] != whole[1]
    page.keyboard.press("0")
    box = page.locator(".live .u-over").first.bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + 500, box["y"] + 50)
    page.mouse.up()
    assert labels()[1] != whole[1]


def test_arrow_keys_move_the_cursor_and_its_values_are_shown(opened: Any) -> None:
    page = opened("diagnosis")
    page.locator(".live .panel").first.focus()
    page.keyboard.press("ArrowRight")
    assert re.match(r"time \[s\]: \d", page.locator(".place").first.inner_text())
    assert page.locator(".live .value").first.inner_text().strip()[-1:].isdigit()


def test_a_curve_is_hidden_by_its_button(opened: Any) -> None:
    page = opened("diagnosis")
    before = page.locator(".live .panel").first.screenshot()
    button = page.get_by_role("button", name="fitted").first
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    page.mouse.move(0, 0)
    assert page.locator(".live .panel").first.screenshot() != before


def test_severities_of_an_unknown_log_stay_not_reliable_with_any_limit(opened: Any) -> None:
    page = opened("unknown")
    assert set(page.locator(".state").all_inner_texts()) == {"not reliable"}
    page.locator("input.limit[name=leakage_flow]").fill("50")
    assert set(page.locator(".state").all_inner_texts()) == {"not reliable"}


def test_a_limit_that_the_reader_sets_changes_the_state_and_is_remembered(opened: Any) -> None:
    page = opened("diagnosis")
    limit, state = page.locator("input.limit[name=leakage_flow]"), page.locator(".state").first
    assert state.inner_text() == "past the limit"
    limit.fill("50")
    assert state.inner_text() == "within the limit"
    page.reload()
    page.wait_for_selector("html.charts-drawn", state="attached")
    assert page.locator(".state").first.inner_text() == "within the limit"
    page.get_by_role("button", name="Reset the limits").click()
    assert page.locator(".state").first.inner_text() == "past the limit"


def test_the_numbers_beneath_a_figure_are_downloaded_as_csv(opened: Any, tmp_path: Path) -> None:
    page = opened("diagnosis")
    with page.expect_download() as started:
        page.get_by_role("button", name="Download the numbers").first.click()
    started.value.save_as(tmp_path / "numbers.csv")
    lines = (tmp_path / "numbers.csv").read_text("utf-8").splitlines()
    assert started.value.suggested_filename == "run-fit.csv"
    assert lines[0].split(",")[:2] == ['"time [s]"', '"velocity measured [mm/s]"']
    assert len(lines) > 300


@pytest.mark.parametrize(("scheme", "low", "high"), [("light", DARKEST_LIGHT, 256), ("dark", -1, LIGHTEST_DARK)])
@pytest.mark.parametrize("script", [True, False])
def test_figures_have_the_background_of_their_page(opened: Any, scheme: str, low: int, high: int, script: bool) -> None:
    page = opened("diagnosis", 900, scheme, script)
    assert low < brightness(page, ".live .panel" if script else ".still img") < high


def test_without_scripts_the_verdict_and_a_still_picture_are_shown(opened: Any) -> None:
    page = opened("diagnosis", script=False)
    assert "leaks inside" in page.locator("h1").inner_text()
    assert page.locator(".still img").first.is_visible()


@pytest.mark.parametrize("name", ["diagnosis", "identified"])
def test_a_page_prints_on_two_sheets_and_names_no_folder(opened: Any, name: str) -> None:
    page = opened(name, scheme="dark")
    if name == "diagnosis":  # a diagnosis with long notes
        noted = "'beforeend', '<p>What was noted of this log, in words that fill two lines of the sheet. '.repeat(2)"
        page.evaluate(f"for (let i = 0; i < 3; i++) document.getElementById('condition').insertAdjacentHTML({noted})")
    edges = dict.fromkeys(("top", "bottom", "left", "right"), "12mm")
    sheets = len(re.findall(rb"/Type\s*/Page\b", page.pdf(format="A4", margin=edges)))
    assert sheets <= 2
    assert "/private/place" not in page.content()
    page.emulate_media(media="print")
    page.set_viewport_size({"width": SHEET, "height": 900})
    ends = "[...document.querySelectorAll('table, figure')].map(one => one.getBoundingClientRect().right)"
    assert max(page.evaluate(ends)) <= SHEET


def test_a_logarithmic_chart_zooms_in_decades_and_its_model_can_be_downloaded(opened: Any, tmp_path: Path) -> None:
    page = opened("identified")
    figure = page.locator("#figure-bode")
    panel = figure.locator(".panel").first
    panel.focus()
    page.keyboard.press("ArrowRight")
    middle = float(figure.locator(".place").inner_text().split(":")[1])
    assert 2.0 < middle < 12.0  # of 0.25 to 500 Hz, the middle is 11 Hz; 250 Hz on a linear axis
    before = panel.screenshot()
    figure.get_by_role("button", name="Zoom in").click()
    figure.get_by_role("button", name="Higher").click()
    assert panel.screenshot() != before
    with page.expect_download() as started:
        page.get_by_role("link", name="the model as JSON").click()
    started.value.save_as(tmp_path / "model.json")
    assert started.value.suggested_filename == "run-model.json"
    assert LinearModel.from_dict(json.loads((tmp_path / "model.json").read_text("utf-8"))[0]).is_stable
    assert page.complaints == []
