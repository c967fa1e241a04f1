"""Every entry of the look-up table in docs/where.md is correct."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROWS = re.findall(r"^\| (.+?) \| `(.+?)` \| `(.+?)` \|$", (ROOT / "docs" / "where.md").read_text("utf-8"), re.MULTILINE)


def test_every_definition_in_the_look_up_table_is_in_the_file_named() -> None:
    assert len(ROWS) > 40
    texts = {path: (ROOT / path).read_text(encoding="utf-8") for _, path, _ in ROWS}
    wrong = [
        f"{what}: {name} is not in {path}"
        for what, path, name in ROWS
        if not re.search(rf"^(?: {{4}})?(?:def|class) {name}\b|^{name}\b", texts[path], re.MULTILINE)
    ]
    assert not wrong, "\n".join(wrong)
