"""The look-up table of the documents tells the truth."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROWS = re.findall(r"^\| (.+?) \| `(.+?)` \| `(.+?)` \|$", (ROOT / "docs" / "where.md").read_text("utf-8"), re.MULTILINE)


@pytest.mark.parametrize(("what", "path", "name"), ROWS, ids=[row[0] for row in ROWS])
def test_what_is_looked_for_stands_where_the_table_says(what: str, path: str, name: str) -> None:
    text = (ROOT / path).read_text(encoding="utf-8")
    assert re.search(rf"^(?: {{4}})?(?:def|class) {name}\b|^{name}\b", text, re.MULTILINE), f"{what}: not in {path}"


def test_the_table_is_read() -> None:
    assert len(ROWS) > 40
