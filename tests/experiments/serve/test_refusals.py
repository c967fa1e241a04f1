"""A refused request shows its reason to a person, in light and in dark, on a page with its own style only."""

from typing import Any

import pytest

from experiments.serve.refusals import POLICY, refusal_page
from tests.experiments.serve.conftest import Served

BROWSER = {"accept": "text/html,*/*;q=0.8"}


def test_a_refusal_page_escapes_the_text_of_the_request() -> None:
    page = refusal_page("there is no <script>alert(1)</script>.", "/fleet")
    assert "<script" not in page
    assert "There is no &lt;script&gt;" in page


@pytest.mark.parametrize("path", ["/nothing", "/logs/0000000000000000", "/live/press"])
def test_a_browser_gets_a_refusal_page_that_allows_only_its_own_style(served: Served, path: str) -> None:
    answer = served().get(path, headers=BROWSER)
    assert answer.status_code == 404
    assert answer.headers["content-security-policy"] == POLICY
    assert "<style>" in answer.text


def test_a_missing_query_parameter_is_named(served: Served) -> None:
    """Before, a comparison without logs was refused with "Query first: Field required"."""
    client = served()
    assert "The query has no &#x27;first&#x27;; it must give one." in client.get("/compare", headers=BROWSER).text
    assert client.post("/api/logs", content=b"x").json() == {"detail": "the query has no 'name'; it must give one"}


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_refusal_page_is_accessible_in_light_and_dark_mode(browser: Any, scheme: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    page = browser.new_page(viewport={"width": 390, "height": 800}, color_scheme=scheme)
    page.set_content(refusal_page("there is no log 0000000000000000", "/fleet"))
    found = axe.Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []
    page.close()
