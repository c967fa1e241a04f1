"""Characters that would control a terminal, or reverse the direction of text, are spelt out."""

import pytest
from jinja2 import DictLoader, Environment

from experiments.command.visible_text import visible_page
from experiments.page import render


def test_a_page_keeps_its_lines_and_escapes_invisible_characters(monkeypatch: pytest.MonkeyPatch) -> None:
    assert visible_page("a\tb\r\n\x1b[31m\u202ec\x85") == "a\tb\r\n\\x1b[31m\\u202ec\\x85"
    words = Environment(loader=DictLoader({"page": "<p>{{ name }}</p>"}), autoescape=True)
    monkeypatch.setattr(render, "_templates", lambda: words)
    assert "<p>&lt;b&gt;\\x1b[2J\\u2066.csv</p>" in render.render_page("page", {"name": "<b>\x1b[2J\u2066.csv"}, {}, {})
