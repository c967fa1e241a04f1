"""Writes docs/decisions.md, which lists the decisions by subject.

Run it as ``python docs/decisions_index.py`` after a decision was added. A decision is a file of docs/decisions, named
by its number; its subjects stand in docs/decision_themes.toml.
"""

import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
FOLDER, THEMES, PAGE = DOCS / "decisions", DOCS / "decision_themes.toml", DOCS / "decisions.md"

HEAD = """# Decisions by subject

What we chose, what we turned down, and why. Each decision is a file of `docs/decisions`, named by its number. Here they
stand under their subjects, newest first.
A number that is missing was given out and not used. *Changed by* names what a later decision changed of an earlier one;
the rest of the earlier one holds. *No change* marks what was measured or built and not taken. Written by
`python docs/decisions_index.py` from `decision_themes.toml`.
"""

FILES = """```{toctree}
:hidden:
:glob:

decisions/*
```
"""


def file_of(number: int) -> Path:
    """Return the file of a decision."""
    return FOLDER / f"{number:03d}.md"


def headings() -> dict[int, str]:
    """Return the headings of the decisions by number."""
    return {int(file.stem): file.read_text("utf-8").partition("\n")[0][2:] for file in sorted(FOLDER.glob("*.md"))}


def by_subject(titles: Mapping[int, str], themes: Mapping[str, Any]) -> str:
    """Return the page of subjects.

    Raises
    ------
    KeyError
        If a number is none of a decision.
    """
    later, left = themes["later"], themes["turned_down"]

    def link(number: int) -> str:
        return file_of(number).relative_to(DOCS).as_posix()

    def entry(number: int) -> str:
        changed = [f"[{by}]({link(by)}) ({what})" for by, what in later.get(str(number), ())]
        marks = [f"*No change*: {left[str(number)]}."] if str(number) in left else []
        marks += [f"*Changed by* {', '.join(changed)}."] if changed else []
        return " ".join([f"- [{titles[number]}]({link(number)})", *marks])

    parts = [HEAD]
    for theme in themes["theme"]:
        listed = sorted(theme["decisions"], reverse=True)
        parts.append("\n".join([f"## {theme['name']}\n", f"{theme['about']}\n", *map(entry, listed), ""]))
    sorted_already = {number for theme in themes["theme"] for number in theme["decisions"]}
    others = sorted(titles.keys() - sorted_already, reverse=True)
    if others:
        parts.append("\n".join(["## Not sorted yet\n", *map(entry, others), ""]))
    return "\n".join([*parts, FILES])


if __name__ == "__main__":
    PAGE.write_text(by_subject(headings(), tomllib.loads(THEMES.read_text("utf-8"))), encoding="utf-8")
    sys.stdout.write(f"wrote {PAGE}\n")
