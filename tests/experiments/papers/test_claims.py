"""The content of the two tables of claims and figures, without a run."""

import re
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

from experiments.page.errata import ERRATA
from experiments.papers.claims import DRAWN_BY, PAPERS, read_csv
from experiments.papers.verdict import OurResult, Row, accepted_range

CLAIMS, FIGURES = read_csv("claims.csv"), read_csv("figures.csv")


@pytest.mark.parametrize(("paper", "count"), [("002", 11), ("000", 14), ("001", 50)])
def test_every_figure_of_each_paper_has_one_row(paper: str, count: int) -> None:
    assert [int(row["figure"]) for row in FIGURES if row["paper"] == paper] == list(range(1, count + 1))


def test_every_figure_is_drawn_by_a_study_or_has_a_reason_why_not() -> None:
    for row in FIGURES:
        if row["drawing"]:
            assert row["drawing"] in DRAWN_BY[row["study"]][0], row
        else:
            assert row["difference"], row
            assert not row["study"], row


def test_every_claim_has_a_tolerance_that_can_be_read_and_errata_that_exist() -> None:
    for row in CLAIMS:
        assert row["paper"] in PAPERS
        for number in re.findall(r"\b[EPM]\d+\b", f"{row['errata']} {row['note']}"):
            assert number in ERRATA, row
        if row["accept"] == "same":
            assert row["value"], row
            continue
        value = float(row["value"]) if row["value"] else None
        low, high = accepted_range(
            Row(
                paper=row["paper"],
                where=row["where"],
                claim=row["claim"],
                printed=row["value"],
                value=value,
                unit=row["unit"],
                accept=row["accept"],
                basis="model",
                ours=OurResult(None),
                shown_by="",
            )
        )
        assert low <= high
        if value is not None and re.search(r"\d", row["printed"]) and "least" not in row["accept"]:
            assert low <= value <= high, row


def test_the_compared_value_of_each_claim_is_the_printed_number() -> None:
    words = {"linearly", "the same value", "second", "third", "nine", "each", "all", "1/2", "√5", "eight"}
    superscripts = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
    for row in CLAIMS:
        printed = row["printed"].replace(",", "").replace(" \N{MULTIPLICATION SIGN} 10", "e").translate(superscripts)
        number = re.search(r"-?\d+\.?\d*(?:e-?\d+)?", printed)
        if number is None or row["printed"] in words or not row["value"] or row["accept"] == "same":
            continue
        assert float(number[0]) == float(row["value"]), row


def test_the_tables_are_part_of_the_package() -> None:
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"]["experiments"]
    for name in ("claims.csv", "figures.csv", "report.html"):
        assert any(fnmatch(f"papers/{name}", pattern) for pattern in patterns), name
