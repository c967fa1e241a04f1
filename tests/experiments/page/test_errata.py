"""The one-line errata follow the list in the documents."""

import re
from pathlib import Path

from experiments.page.errata import ERRATA, linked, linked_errata

ROOT = Path(__file__).resolve().parents[3]


def test_every_erratum_of_the_documents_has_its_line() -> None:
    listed = re.findall(r"^\| ([EPM]\d+) \|", (ROOT / "docs/errata.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert list(ERRATA) == listed


def test_numbers_without_an_erratum_stay_plain() -> None:
    assert "<a" not in linked("E99 of 1E8")


def test_only_what_is_linked_is_listed() -> None:
    assert list(linked_errata(linked("errata E13, E9"))) == ["E9", "E13"]
