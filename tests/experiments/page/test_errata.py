"""The one-line errata agree with the list in the documents."""

import re
from pathlib import Path

from experiments.page.errata import ERRATA, link_errata, linked_errata

UNKNOWN = "E99"
"""A number that no erratum has."""


ROOT = Path(__file__).resolve().parents[3]


def test_the_errata_are_those_listed_in_the_documentation() -> None:
    listed = re.findall(r"^\| ([EPM]\d+) \|", (ROOT / "docs/errata.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert list(ERRATA) == listed


def test_numbers_without_an_erratum_stay_plain() -> None:
    assert "<a" not in link_errata(f"errata {UNKNOWN} of 1E8")


def test_columns_and_actuators_named_like_an_erratum_are_not_linked() -> None:
    assert "<a" not in link_errata("P1 follows M1 (correlation 0.97); start with E9, P2")


def test_every_erratum_of_a_list_is_linked_even_across_a_line_break() -> None:
    assert list(linked_errata(link_errata("(errata\n  E2, E8 and E17)"))) == ["E2", "E8", "E17"]


def test_only_linked_errata_are_listed() -> None:
    assert list(linked_errata(link_errata("errata E13, E9"))) == ["E9", "E13"]
