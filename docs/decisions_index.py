"""Writes the index at the top of docs/decisions.md.

Run it as ``python docs/decisions_index.py`` after a decision was added.
"""

import re
import sys
from pathlib import Path

PAGE = Path(__file__).resolve().parent / "decisions.md"

HEAD = """# Decisions

One entry a decision: what we chose, what we turned down, and why. Newest last. A number that is missing was given out
and not used. The index is written by `python docs/decisions_index.py`.
"""


def anchor_of(heading: str) -> str:
    """Return the anchor that a heading of Markdown gets: small letters, hyphens for spaces, nothing else but digits."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def with_index(text: str) -> str:
    """Return the page with its index."""
    headings = re.findall(r"^## (\d+\. .+)$", text, re.MULTILINE)
    lines = [f"- [{heading}](#{anchor_of(heading)})" for heading in headings]
    body = text[text.index("\n## ") :]
    return "\n".join([HEAD, *lines, ""]) + body


if __name__ == "__main__":
    PAGE.write_text(with_index(PAGE.read_text("utf-8")), encoding="utf-8")
    sys.stdout.write(f"wrote {PAGE}\n")
