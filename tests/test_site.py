"""The site: links are valid, every public name is documented, the diagram matches the code, and the site builds."""

import importlib
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS))
site_pages = importlib.import_module("site_pages")
sys.path.remove(str(DOCS))

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md")), *sorted(DOCS.glob("tutorials/*.md"))]
LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchor_of(heading: str) -> str:
    """Return the anchor of a Markdown heading: lower-case letters and digits, with hyphens for spaces."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def prose(page: Path) -> str:
    """Return a page without its code blocks and inline code."""
    return re.sub(r"```.*?```|`[^`\n]*`", "`", page.read_text("utf-8"), flags=re.DOTALL)


@cache
def anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE)
    return {anchor_of(heading) for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_to_an_existing_page_and_heading(page: Path) -> None:
    for link in LINK.findall(prose(page)):
        parts = urlsplit(link)
        if parts.scheme:
            assert parts.scheme == "https"
            assert "." in parts.netloc
            continue
        if parts.path.startswith("generated/"):
            assert parts.path.removeprefix("generated/") in {"house.md", "house.svg"}
            continue
        target = (page.parent / parts.path).resolve() if parts.path else page
        assert target.is_file(), link
        assert not parts.fragment or parts.fragment in anchors(target), link


def test_every_test_that_a_page_names_exists() -> None:
    tests = sorted((ROOT / "tests").rglob("test_*.py"))
    defined = {name for file in tests for name in re.findall(r"^def (test_\w+)", file.read_text("utf-8"), re.MULTILINE)}
    named = {(page, name) for page in PAGES for name in re.findall(r"`([^`\n]*)`", page.read_text("utf-8"))}
    functions = {(page, name) for page, name in named if re.fullmatch(r"test_\w+", name)}
    paths = {(page, name) for page, name in named if re.fullmatch(r"tests/[\w/.]+", name)}
    assert functions
    assert paths
    assert not [one for one in functions if one[1] not in defined]
    assert not [one for one in paths if not (ROOT / one[1]).exists()]


def test_every_python_file_that_a_page_names_exists() -> None:
    records = {DOCS / "decisions.md"}  # may name files that no longer exist
    made = {DOCS / "add-a-plant.md"}  # its files are written by the reader
    folders = ("plant", "estimation", "faults", "experiments", "benchmarks", "tests", "docs")
    known = ["/hydrostate.py", *(file.as_posix() for folder in folders for file in (ROOT / folder).rglob("*.py"))]
    for page in (page for page in PAGES if page not in records | made):
        named = re.findall(r"`([\w/]+\.py)`", page.read_text("utf-8"))
        assert not [name for name in named if not any(one.endswith(f"/{name}") for one in known)], page.name


def test_the_site_holds_every_page_once() -> None:
    text = (DOCS / "index.md").read_text("utf-8")
    held = [
        line.strip() for block in re.findall(r"```{toctree}\n(.*?)```", text, re.DOTALL) for line in block.splitlines()
    ]
    wanted = {str(page.relative_to(DOCS).with_suffix("")) for page in PAGES if DOCS in page.parents} - {"index"}
    assert sorted(line for line in held if line and not line.startswith(":")) == sorted(wanted)


def test_every_public_name_of_the_packages_has_an_api_entry() -> None:
    pages = site_pages.api_pages()
    for face in site_pages.FACES:
        names = {name for name in importlib.import_module(face).__all__ if not name.startswith("_")}
        headings = set(re.findall(r"^(\w+)\n-+$", pages[f"api_{face}.rst"], re.MULTILINE))
        assert headings == names


def test_the_drawing_shows_every_subpackage_and_imports_point_only_left() -> None:
    found = site_pages.house()
    drawing = site_pages.house_drawing()
    assert all(f">{room.partition('.')[2]}<" in drawing for room in found.rooms if "." in room)
    layers = [(user.split(".")[0], used.split(".")[0]) for user, used in found.imports]
    assert all(site_pages.LAYERS.index(used) <= site_pages.LAYERS.index(user) for user, used in layers)


@pytest.fixture(scope="module")
def built_site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the built site, of which a warning is an error."""
    pytest.importorskip("sphinx")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", str(DOCS), str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)  # noqa: S603  our own pages
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.slow
def test_the_site_builds_without_a_warning(built_site: Path) -> None:
    assert (built_site / "generated" / "api_plant.html").is_file()


@pytest.mark.slow
def test_the_site_prints_code_whole_ranks_decisions_last_and_has_no_error(built_site: Path, browser: Any) -> None:
    """Before, a line of code was cut at the edge of a sheet, and decisions came before the tutorials in the search."""
    page = browser.new_page(viewport={"width": 720, "height": 900})
    complaints: list[str] = []
    page.on("console", lambda said: said.type == "error" and complaints.append(said.text))
    page.goto((built_site / "tutorials" / "leaking.html").as_uri())
    page.emulate_media(media="print")
    assert page.locator("pre").evaluate_all("all => all.every(one => one.scrollWidth <= one.clientWidth)")
    assert complaints == []
    page.emulate_media(media="screen")
    page.goto((built_site / "search.html").as_uri() + "?q=leakage_flow")
    page.locator("#search-results li >> nth=3").wait_for()
    found = page.locator("#search-results li > a").evaluate_all("all => all.map(one => one.getAttribute('href'))")
    decisions = [one.startswith("decisions") for one in found]
    assert decisions == sorted(decisions)
    assert not decisions[0]
    page.close()
