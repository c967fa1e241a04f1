"""The report is one complete file, and agrees with the tables."""

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from experiments.nine_conditions.figures import FIGURES
from experiments.nine_conditions.findings import recoveries
from experiments.nine_conditions.sentences import verdict
from experiments.page.errata import ERRATA
from experiments.page.numbers import exact, number
from experiments.running.study import StudyResult, versions
from tests.experiments.conftest import SMALL

SECTIONS = (
    "verdict",
    "simulated",
    "bulk-modulus",
    "transfer-functions",
    "validation",
    "classification",
    "published",
    "again",
    "errata",
)


@pytest.fixture(scope="session")
def page(written: Path) -> str:
    """Return the report with plain spaces instead of its non-breaking ones."""
    return (written / "report.html").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")


class _Balance(HTMLParser):
    """Collects open tags, ids and links, to check that all tags are closed and all internal links have a target."""

    VOID = frozenset({"meta", "img", "br", "link"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.targets: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        self.ids += [value for name, value in attrs if name == "id" and value]
        self.targets += [value[1:] for name, value in attrs if name == "href" and value and value[0] == "#"]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_every_section_exists_and_every_internal_link_has_a_target(page: str) -> None:
    parser = _Balance()
    parser.feed(page)
    assert parser.open == []
    assert set(SECTIONS) <= set(parser.ids)
    assert set(parser.targets) <= set(parser.ids)
    assert len(parser.ids) == len(set(parser.ids))


def test_the_page_loads_nothing(page: str) -> None:
    without_images = re.sub(r'src="data:image/svg\+xml;base64,[A-Za-z0-9+/=]+"', "", page)
    assert not re.search(r"https?:|src=|@import|url\(|<script|<link", without_images)


def test_the_page_contains_every_figure(page: str) -> None:
    assert page.count('src="data:image/svg+xml;base64,') == len(FIGURES)
    assert all(f'id="figure-{name}"' in page for name in FIGURES)


def test_the_verdict_opens_the_page(page: str, study: StudyResult) -> None:
    places = [page.index(sentence.replace("'", "&#39;")) for sentence in verdict(study.frames)]
    assert places == sorted(places)
    assert places[-1] < page.index("<figure")


def test_the_page_shows_the_velocity_errors_of_the_table(page: str, study: StudyResult) -> None:
    for row in study.tables["validation_rmse"].itertuples():
        cells = [
            number(1e3 * value, digits)
            for value, digits in (
                (row.rmse_transfer_function_m_s, 3),
                (row.rmse_mathematical_m_s, 3),
                (row.published_rmse_transfer_function_m_s, 2),
                (row.published_rmse_mathematical_m_s, 2),
            )
        ]
        assert "".join(f'<td class="number">{cell}</td>' for cell in cells) in page


def test_the_page_lists_transfer_functions_beside_the_published_ones(page: str, study: StudyResult) -> None:
    for row in study.tables["transfer_functions"].to_dict("records"):
        names = ("b0", "b1", "b2", "a1", "a2")
        assert "".join(f'<td class="number">{number(row[name])}</td>' for name in names) in page
        assert "".join(f'<td class="number">{exact(row[f"published_{name}"])}</td>' for name in names) in page


def test_the_page_lists_scalars_with_their_notes_and_bulk_modulus_in_mpa(page: str, study: StudyResult) -> None:
    for row in study.tables["scalars"].to_dict("records"):
        assert row["note"].split(" (errata")[0].replace("'", "&#39;") in page
    first = study.tables["scalars"].iloc[0]
    assert first["unit"] == "Pa"
    assert f'<td class="number">{number(1e-6 * float(first["ours"]))}</td><td>MPa</td>' in page
    assert (
        "1e8" not in page.split("<h2>Errata</h2>")[0].split("<main>")[1]
    )  # bulk modulus has one unit, in text and tables


def test_the_page_shows_the_recovered_conditions_and_worst_errors_of_the_table(page: str, study: StudyResult) -> None:
    for found in recoveries(study.tables["bulk_modulus"]).values():
        assert f"{found.recovered} of {found.conditions}" in page
        assert number(found.worst_error_percent, 2) in page


def test_every_parameter_is_listed_with_unit_and_source(page: str, study: StudyResult) -> None:
    for row in study.tables["parameters"].to_dict("records"):
        assert f"<code>{row['parameter']}</code>" in page
        assert exact(float(row["value"])) in page


def test_exactly_the_cited_errata_are_listed(page: str) -> None:
    cited = set(re.findall(r'href="#(E\d+)"', page))
    assert {"E9", "E13", "E14", "E15"} <= cited
    assert all(f'<dt id="{erratum}">' in page for erratum in cited)
    assert not any(f'<dt id="{erratum}">' in page for erratum in set(ERRATA) - cited)


def test_the_page_states_the_seed_and_package_versions(page: str) -> None:
    assert f"--seed {SMALL.seed}" in re.sub("<[^>]*>", "", page)
    assert versions()["numpy"] in page
