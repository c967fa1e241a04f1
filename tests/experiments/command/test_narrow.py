"""At any width of the terminal, no number and no verdict of a table is cut off."""

import re

import pytest
from rich.table import Table

from experiments.command import terminal
from experiments.command.narrow import as_lines, fit_to_width
from experiments.command.terminal import render_text, table


def shown() -> Table:
    made = table("log", "bulk modulus [MPa]", "95 % interval [MPa]", "bound [%]", "verdict")
    made.add_row("run.csv", "206.0", "204.8 to 207.2", "0.3", "not observable")
    made.add_row("a-log-with-a-name-that-no-terminal-shows-whole.csv", "1207.1", "-", "", "ok")
    return made


@pytest.mark.parametrize("width", [20, 30, 44, 60, 80, 120])
def test_every_number_and_verdict_is_shown_complete_at_any_width(monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    monkeypatch.setattr(terminal.sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", str(width))
    text = re.sub("\x1b\\[[0-9;]*m", "", render_text(shown()))
    # a row given as lines keeps a name without blanks in one piece
    assert max(map(len, text.splitlines())) <= max(width, 54)
    for whole in ("206.0", "1207.1", "0.3", "observable", "ok"):
        assert re.search(rf"(?<!\S){re.escape(whole)}(?!\S)", text), (whole, text)
    assert re.search(r"204\.8\s+to\s+207\.2", text)


def test_headings_are_broken_into_lines_before_the_table_is_given_up() -> None:
    wide, narrow = fit_to_width(shown(), 100), fit_to_width(shown(), 78)
    assert wide is not None
    assert str(wide.columns[1].header) == "bulk modulus [MPa]"
    assert narrow is not None
    assert str(narrow.columns[1].header) == "bulk\nmodulus\n[MPa]"
    assert fit_to_width(shown(), 60) is None


def test_a_row_shown_as_lines_omits_empty_cells_and_indents_further_lines() -> None:
    made = table("log", "gain", "coefficients", title="two")
    made.add_row("a.csv", "", "b 1\nf 2")
    assert as_lines(made) == "two\n\na.csv\n  coefficients   b 1\n                 f 2"
