"""Pages with still figures only, of a log's columns and of a study, in a real browser."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from typer.testing import CliRunner

from experiments.cli import app
from experiments.page.render import with_whole_options
from experiments.page.tables import folded_tables

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def pages(written: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("still")
    for arguments in (
        ("simulate", "--duration", "1", "--sample-time", "1e-3", "--out", folder / "run.csv"),
        ("inspect", folder / "run.csv", "--html", folder / "inspect.html"),
    ):
        assert CliRunner().invoke(app, [str(one) for one in arguments]).exit_code == 0
    return {"inspect": folder / "inspect.html", "study": written / "report.html"}


@pytest.mark.parametrize("name", ["inspect", "study"])
def test_figures_can_be_read_on_a_phone(browser: Any, pages: dict[str, Path], name: str) -> None:
    page = browser.new_page(viewport={"width": 390, "height": 800})
    page.goto(pages[name].as_uri())
    picture = page.locator("figure .picture").first
    assert picture.locator("img").bounding_box()["width"] >= 700
    assert picture.evaluate("one => [one.clientWidth <= 390, one.scrollWidth > 600]") == [True, True]
    page.close()


@pytest.mark.parametrize("width", [390, 768])
def test_the_columns_of_a_log_fit_on_the_screen(browser: Any, pages: dict[str, Path], width: int) -> None:
    page = browser.new_page(viewport={"width": width, "height": 800})
    page.goto(pages["inspect"].as_uri())
    cells = page.locator("#columns td")
    boxes = [one.bounding_box() for one in cells.all() if one.is_visible()]
    assert len(boxes) > 20
    assert max(box["x"] + box["width"] for box in boxes) <= width
    assert page.locator('#columns td[data-head="sure [%]"]').count() > 4
    page.close()


def test_the_name_of_a_log_above_a_value_breaks_on_a_phone(browser: Any) -> None:
    """Before, the end of "minor_leakage_minor_friction.csv" was cut off on the page that compares two logs."""
    style = (Path(__file__).parents[3] / "experiments/page/templates/report.css").read_text(encoding="utf-8")
    cells = '<th>leakage</th><td data-head="run.csv">1</td><td data-head="minor_leakage_minor_friction_2026.csv">2</td>'
    page = browser.new_page(viewport={"width": 390, "height": 800})
    page.set_content(f'<style>{style}</style><main><table class="cards"><tbody><tr>{cells}</tr></tbody></table></main>')
    assert page.locator("td").last.evaluate("one => one.scrollWidth <= one.clientWidth")
    page.close()


@pytest.mark.parametrize("width", [390, 768])
def test_a_printed_value_has_its_name_beside_ours_on_a_phone_and_a_tablet(browser: Any, width: int) -> None:
    """Before, the page of the papers had a number without a name above the one called "ours"."""
    style = (Path(__file__).parents[3] / "experiments/page/templates/report.css").read_text(encoding="utf-8")
    cells = "".join(f'<td data-head="{name}">1</td>' for name in ("claim", "printed", "ours", "unit", "note"))
    page = browser.new_page(viewport={"width": width, "height": 800})
    page.set_content(f'<style>{style}</style><table class="cards whole"><tbody><tr>{cells}</tr></tbody></table>')
    named = "one => getComputedStyle(one, '::before').display"
    assert [page.locator("td").nth(place).evaluate(named) for place in range(3)] == ["none", "block", "block"]
    page.close()


def test_a_wide_table_on_a_phone_has_a_gradient_and_a_fixed_first_column(browser: Any, pages: dict[str, Path]) -> None:
    page = browser.new_page(viewport={"width": 390, "height": 800})
    page.goto(pages["study"].as_uri())
    wide = page.locator(".scroll:not(:has(.cards))").first
    assert "gradient" in wide.evaluate("one => getComputedStyle(one).backgroundImage")
    wide.evaluate("one => { one.scrollLeft = 60 }")
    assert wide.locator("tbody tr >> nth=0 >> :is(td, th) >> nth=0").bounding_box()["x"] >= 0.0
    page.close()


@pytest.mark.parametrize("name", ["inspect", "study"])
def test_a_still_page_on_a_dark_phone_fits_and_is_accessible_without_errors(
    browser: Any, pages: dict[str, Path], name: str
) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    page = browser.new_page(viewport={"width": 390, "height": 800}, color_scheme="dark")
    complaints: list[str] = []
    page.on("console", lambda said: complaints.append(said.text))
    page.on("pageerror", lambda said: complaints.append(str(said)))
    page.on("request", lambda asked: asked.url.startswith(("file:", "data:")) or complaints.append(asked.url))
    page.goto(pages[name].as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.locator("figure img").first.evaluate("one => getComputedStyle(one).filter").startswith("invert")
    found = axe.Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []
    assert complaints == []
    page.close()


def test_printing_uses_the_same_colours_for_light_and_dark_screens(browser: Any, pages: dict[str, Path]) -> None:
    """Before, marks of states were printed in the pale colours of dark pages."""
    found: list[Any] = []
    for scheme in ("light", "dark"):
        page = browser.new_page(color_scheme=scheme)
        page.goto(pages["study"].as_uri())
        page.emulate_media(media="print")
        names = "['ink', 'paper', 'vermilion', 'orange', 'green', 'purple', 'grey']"
        found.append(
            page.evaluate(
                f"{names}.map(one => getComputedStyle(document.documentElement).getPropertyValue('--' + one))"
            )
        )
        page.close()
    assert found[0] == found[1]


def test_printing_shows_the_open_tables_and_the_checkbox_opens_all(browser: Any, tmp_path: Path) -> None:
    """Before, the page of the papers printed on 60 sheets, since paper showed all rows."""
    style = (Path(__file__).parents[3] / "experiments/page/templates/report.css").read_text(encoding="utf-8")
    frame = pd.DataFrame({"where": ["Table 1"] * 40 + ["Table 2"] * 40, "verdict": ["reproduced"] * 80})
    table = folded_tables(frame, ("where", "verdict"), "where", "verdict")
    text = f'<style>{style}</style><main><input type="checkbox" id="every-row">{table}</main>'
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    page = browser.new_page(viewport={"width": 390, "height": 800})
    page.goto((tmp_path / "page.html").as_uri())
    height = "document.documentElement.scrollHeight"

    def shown() -> list[bool]:
        return [page.locator("tbody").nth(place).is_visible() for place in (0, 1)]

    assert (shown(), page.evaluate(height) <= 800) == ([False, False], True)
    page.locator("summary").first.click()
    assert shown() == [True, False]
    page.emulate_media(media="print")
    assert shown() == [True, False]
    page.emulate_media(media="screen")
    page.locator("#every-row").check()
    assert shown() == [True, True]
    page.emulate_media(media="print")
    assert shown() == [True, True]
    page.close()


def test_no_line_ends_between_the_hyphens_of_an_option(browser: Any) -> None:
    """Before, a page of a log with a wrong sign said "or with -" and, on the next line, "-columns"."""
    style = (Path(__file__).parents[3] / "experiments/page/templates/report.css").read_text(encoding="utf-8")
    page = browser.new_page(viewport={"width": 390, "height": 800})
    for count in range(20, 60):  # one of these ends a line just before the option
        text = with_whole_options(f"<p>{'i' * count} {'i ' * 12}with --columns</p>")
        page.set_content(f"<style>{style}</style>{text}")
        assert page.locator(".option").evaluate("one => one.getClientRects().length") == 1
        assert page.locator(".option").bounding_box()["height"] < 30.0
    page.close()
