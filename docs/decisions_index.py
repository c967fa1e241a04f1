"""Writes the index at the top of docs/decisions.md, and docs/decisions_by_theme.md.

Run it as ``python docs/decisions_index.py`` after a decision was added; give the decision a subject in
docs/decision_themes.toml.
"""

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
PAGE, THEMES, BY_THEME = DOCS / "decisions.md", DOCS / "decision_themes.toml", DOCS / "decisions_by_theme.md"

HEAD = """# Decisions

One entry a decision: what we chose, what we turned down, and why. Newest last. A number that is missing was given out
and not used. [Decisions by subject](decisions_by_theme.md) says which were changed by later ones. The index is written
by `python docs/decisions_index.py`.
"""

THEMES_HEAD = """# Decisions by subject

Every [decision](decisions.md) under its subjects, newest first. *Changed by* names what a later decision changed of an
earlier one; the rest of the earlier one holds. *No change* marks what was measured or built and not taken. Written by
`python docs/decisions_index.py` from `decision_themes.toml`.
"""


def anchor_of(heading: str) -> str:
    """Return the anchor that a heading of Markdown gets: small letters, hyphens for spaces, nothing else but digits."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def headings_of(text: str) -> dict[int, str]:
    """Return the headings of the decisions by number."""
    headings = re.findall(r"^## (\d+\. .+)$", text, re.MULTILINE)
    return {int(heading.partition(".")[0]): heading for heading in headings}


def with_index(text: str) -> str:
    """Return the page with its index."""
    lines = [f"- [{heading}](#{anchor_of(heading)})" for heading in headings_of(text).values()]
    body = text[text.index("\n## ") :]
    return "\n".join([HEAD, *lines, ""]) + body


def by_theme(text: str, themes: dict[str, Any]) -> str:
    """Return the page of subjects.

    Raises
    ------
    KeyError
        If a number is none of a decision.
    """
    headings, later, left = headings_of(text), themes["later"], themes["turned_down"]

    def link(number: int) -> str:
        return f"decisions.md#{anchor_of(headings[number])}"

    def entry(number: int) -> str:
        changed = [f"[{by}]({link(by)}) ({what})" for by, what in later.get(str(number), ())]
        marks = [f"*No change*: {left[str(number)]}."] if str(number) in left else []
        marks += [f"*Changed by* {', '.join(changed)}."] if changed else []
        return " ".join([f"- [{headings[number]}]({link(number)})", *marks])

    parts = [THEMES_HEAD]
    for theme in themes["theme"]:
        listed = sorted(theme["decisions"], reverse=True)
        parts.append("\n".join([f"## {theme['name']}\n", f"{theme['about']}\n", *map(entry, listed), ""]))
    sorted_already = {number for theme in themes["theme"] for number in theme["decisions"]}
    others = sorted(headings.keys() - sorted_already, reverse=True)
    if others:
        parts.append("\n".join(["## Not sorted yet\n", *map(entry, others), ""]))
    return "\n".join(parts)


if __name__ == "__main__":
    indexed = with_index(PAGE.read_text("utf-8"))
    PAGE.write_text(indexed, encoding="utf-8")
    BY_THEME.write_text(by_theme(indexed, tomllib.loads(THEMES.read_text("utf-8"))), encoding="utf-8")
    sys.stdout.write(f"wrote {PAGE} and {BY_THEME}\n")
